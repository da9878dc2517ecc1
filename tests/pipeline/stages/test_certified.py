"""Modes from stored designs: the way that is taken, its estimates against recomputed modes, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import DESIGN, ModalRecord
from gudgeon.pipeline.design_change.family import flexibility_of
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.reduction.designs import refuse_unlike
from tests.pipeline.small import write_scene

CHANGE = "component.skirt.change"
THINNER = {f"{CHANGE}.profile.offset": -0.3e-3}
"""A wall of 6 mm loses a twentieth."""
STORED = {f"{CHANGE}.designs": [{}, {"offset": -0.6e-3}, {"offset": 0.6e-3}]}
CERTIFIED = {f"{CHANGE}.update": "certified", f"{CHANGE}.tolerance": 1e-3}
STATED = (0.8, 1.25)
"""Stated over true error."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scene(tmp_path_factory.mktemp("certified") / "scene")


def solved(place: Path, settings: dict[str, object]) -> tuple[ModalRecord, list[str]]:
    report = run(place, set=settings, db=place / "db", out=place / "out", until="morph")
    return open_job(place, set=settings, db=place / "db").record("skirt"), report.notes


@pytest.fixture(scope="module")
def exact(place: Path) -> ModalRecord:
    return solved(place, THINNER | {f"{CHANGE}.update": "recompute"})[0]


def errors(modal: ModalRecord, exact: ModalRecord) -> tuple[float, float]:
    """Return the largest relative errors of frequencies and of the flexibility of a row."""
    C, truth = flexibility_of(modal).diagonal(), flexibility_of(exact).diagonal()
    return tuple(float(np.abs(a / b - 1).max()) for a, b in ((modal.frequencies, exact.frequencies), (C, truth)))


def test_three_designs_give_a_fourth(place: Path, exact: ModalRecord) -> None:
    modal, notes = solved(place, THINNER | STORED | CERTIFIED)
    design = modal.quality[DESIGN]
    assert design["way"] == "project"
    frequency, row = errors(modal, exact)
    assert frequency < 1e-5
    assert row < 3e-4
    assert STATED[0] < max(design["frequency_errors"]) / frequency < STATED[1]
    for name in ("mass", "centre", "inertia", "rigid_twists"):
        np.testing.assert_allclose(getattr(modal, name), getattr(exact, name), rtol=1e-9, atol=1e-12)
    for name in ("points", "normals", "areas"):
        np.testing.assert_array_equal(
            getattr(modal.interfaces["thrust"], name), getattr(exact.interfaces["thrust"], name)
        )
    (note,) = [line for line in notes if "stored designs" in line]
    assert note.startswith("component.skirt.change: modes by 'project' from 3 stored designs; estimated errors: ")
    assert note.endswith("tolerance: 0.10%")


def test_one_design_takes_steps_with_its_factor(place: Path, exact: ModalRecord) -> None:
    modal, notes = solved(place, THINNER | CERTIFIED | {f"{CHANGE}.tolerance": 0.005})
    design = modal.quality[DESIGN]
    assert (design["way"], design["steps"]) == ("inverse", 1)
    frequency, _ = errors(modal, exact)
    assert STATED[0] < max(design["frequency_errors"]) / frequency < STATED[1]
    assert any("modes by 'inverse' in 1 step from 1 stored design;" in line for line in notes)


def test_a_part_that_grows_has_the_displacements_of_the_stored_one(place: Path) -> None:
    growth = {f"{CHANGE}.growth": 1.5e-3}
    modal, _ = solved(place, CERTIFIED | growth)
    base, _ = solved(place, {})
    assert modal.quality[DESIGN]["way"] == "project"
    np.testing.assert_allclose(modal.frequencies * 1.0015, base.frequencies, rtol=1e-8)
    assert modal.mass == pytest.approx(base.mass * 1.0015**3, rel=1e-12)
    _, notes = solved(place, growth)
    assert any("modes are reused; estimated change of frequencies by up to -0.15%" in line for line in notes)


def test_a_tolerance_that_no_way_meets_ends_in_new_modes(place: Path, exact: ModalRecord) -> None:
    modal, notes = solved(place, THINNER | CERTIFIED | {f"{CHANGE}.tolerance": 1e-12})
    assert modal.quality[DESIGN]["way"] == "recompute"
    np.testing.assert_allclose(modal.frequencies, exact.frequencies, rtol=1e-9)
    assert any("modes are recomputed: from 1 stored design no way is within the tolerance" in line for line in notes)


def test_stored_designs_are_those_of_their_own_scenes(place: Path) -> None:
    """Their keys hold what they depend on, so that designs of a study share them."""
    job, other = (open_job(place, set=s | STORED | CERTIFIED, db=place / "db")
                  for s in (THINNER, {f"{CHANGE}.profile.offset": 0.2e-3}))  # fmt: skip
    steps, more = job.components()["skirt"], other.components()["skirt"]
    assert steps["designs.0 mesh"].key == steps["base-mesh"].key
    assert [steps[f"designs.{n} modes"].key for n in range(3)] == [more[f"designs.{n} modes"].key for n in range(3)]
    assert len({step.key for step in steps.values() if step.stage == "modes"}) == 4


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (THINNER | STORED, "designs given; allowed with update 'certified', not 'reuse'"),
        (THINNER | CERTIFIED | {"component.skirt.modes.reduction": "ritz"}, "modes.reduction = 'macneal'"),
        (THINNER | CERTIFIED | {f"{CHANGE}.designs": [{}] * 6}, "designs"),
        (THINNER | CERTIFIED | {f"{CHANGE}.designs": [{"table": "none.csv"}]}, "change.designs.0.table"),
    ],
)  # fmt: skip
def test_bad_input(place: Path, settings: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        run(place, set=settings, db=place / "db", out=place / "none", until="modes")
    assert not (place / "none" / "summary.json").exists()


def test_stored_designs_with_other_contact_points_are_named(place: Path) -> None:
    modal, _ = solved(place, {})
    other = replace(modal, interface_rows={name: [0, 1] for name in modal.interface_rows})
    refuse_unlike([modal, modal], "component.skirt.change.designs")
    with pytest.raises(InputError, match=r"component\.skirt\.change\.designs: design 2 has "):
        refuse_unlike([modal, other], "component.skirt.change.designs")
