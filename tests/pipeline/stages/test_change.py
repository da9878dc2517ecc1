"""Reuse of modes after a design change: its estimates are printed, and above the tolerance it is refused."""

import json
from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from gudgeon import modaldb
from gudgeon.modaldb.stores.query import Query
from gudgeon.pipeline.cli import main
from gudgeon.pipeline.design_change import estimate
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements import ELEMENTS
from gudgeon.pipeline.kinds import run
from tests.pipeline.small import TABLE, UPDATE, write_scene

OFFSET = "component.skirt.change.profile.offset"
TOLERANCE = "component.skirt.change.tolerance"
THINNER = {OFFSET: -0.5e-3}
"""A wall of 6 mm loses 0.5 mm."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scene(tmp_path_factory.mktemp("change") / "scene")


def test_a_small_change_passes_with_its_estimates(place: Path) -> None:
    report = run(place, set={TABLE: "barrel.csv"}, db=place / "db", out=place / "out", until="solve")
    (note,) = [note for note in report.notes if "modes are reused" in note]
    assert note.startswith("component.skirt.change: modes are reused; estimated change of frequencies by up to -0.")
    assert "compliance by up to +0." in note
    assert note.endswith("tolerance: 2.00%")
    estimates = report.as_json()["changes"]["skirt"]
    assert len(estimates["frequency_changes"]) == 8
    assert 1e-4 < abs(estimates["compliance_changes"]["thrust"]) < 0.02
    json.dumps(estimates)


def test_a_large_change_is_refused_in_one_line(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["solve", str(place), "--db", str(place / "db"), "--out", str(place / "none")]
    assert main([*command, "--set", f"{OFFSET}=-0.0005"]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(
        f"gudgeon: {place / 'scene.toml'}: component.skirt.change.update: 'reuse' given, the profile"
    )
    assert "compliance by up to +1" in line
    assert line.endswith(
        "allowed: component.skirt.change.tolerance = 2.00%; use update = 'certified' or 'recompute', or a larger"
        " tolerance"
    )
    assert not (place / "none" / "summary.json").exists()


def test_the_tolerance_holds_for_designs_in_the_database_too(place: Path) -> None:
    """It is part of no key: a larger one makes nothing stale, and a smaller one refuses what ran before."""

    def solved(**settings: object) -> str | None:
        return run(place, set=THINNER | settings, db=place / "db", out=place / "out", until="solve").result

    assert solved(**{TOLERANCE: 0.5}) == "FINISHED"
    for until in ("morph", "solve"):
        with pytest.raises(InputError, match="estimated to change"):
            run(place, set=THINNER, db=place / "db", out=place / "out", until=until)
    assert solved(**{UPDATE: "recompute"}) == "FINISHED"


def test_derivatives_are_found_once_for_designs_with_the_same_modes(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A design assembles nothing, and later ones take the derivatives of the first."""
    counts: Counter[str] = Counter()

    def counted(name: str, own: Callable[..., object]) -> Callable[..., object]:
        def called(*arguments: object) -> object:
            counts[name] += 1
            return own(*arguments)

        return called

    run(place, db=place / "own", out=place / "out", until="modes")
    monkeypatch.setattr(estimate, "_FOUND", OrderedDict())
    monkeypatch.setattr(estimate, "sensitivity_of", counted("derivatives", estimate.sensitivity_of))
    solid = ELEMENTS["tetra10"]
    assemble = counted("assemblies", solid.assemble)
    monkeypatch.setitem(ELEMENTS, "tetra10", replace(solid, assemble=assemble))
    for offset in (-11e-6, -12e-6):
        run(place, set={OFFSET: offset}, db=place / "own", out=place / "out", until="morph")
    assert counts == {"derivatives": 1}
    # A later process, which has them from the database, makes the same designs.
    estimate._FOUND.clear()
    report = run(place, set={OFFSET: -13e-6}, db=place / "own", out=place / "out", until="morph")
    assert counts == {"derivatives": 1}
    store = modaldb.open(place / "own")
    (kept,) = store.find(Query(kind="sensitivity"))
    design = store.get(report.stages["morph"].keys["skirt"], "morph")
    base = store.get(design.mesh_key, "mesh")
    record = store.get(kept.key, "sensitivity")
    assert (record.mesh_key, record.modes_key) == (design.mesh_key, design.modes_key)
    assert estimate.estimated(record, design.nodes - base.nodes).quality().items() <= design.quality.items()
