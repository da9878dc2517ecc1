"""Bases that change as a force passes: their record, what neighbours share, the change itself, and refusals."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.records.traction import spread
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.kinds import open_job, run, simulation
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.swapped import LARGEST_JUMP
from gudgeon.solver.linear.state import linearised
from gudgeon.solver.system.bases.swaps import Swaps, swaps_of

SCENE = """
component.beam.geometry = { kind = "box", lx = 0.3, ly = 0.02, lz = 0.02 }
component.beam.material = { E = 210e9, nu = 0.3, rho = 7850 }
component.beam.mesh.size = 0.02
component.beam.supports = ["left", "right"]
component.beam.interface.top = { surface = "top", kind = "traction", spacing = [0.02, 0.02], along = [1, 0, 0] }
component.beam.modes = { reduction = "normal+static", normal_count = 8, swap = { bases = 3, vectors = 4 } }
body.beam = {}
force.load = { kind = "moving", body = "beam", interface = "top", at = [0, -0.13], force = 9, speed = 20, rise = 1e-3 }
run = { duration = 0.013, frames = 130, samples = 1300 }
"""
OTHER = {"kind": "moving", "body": "beam", "interface": "top", "force": 1.0, "at": [0.0, 0.0]}
GROUND = {
    "component.beam.interface.foot": {"surface": "bottom"},
    "contact.floor": {
        "body": "beam", "interface": "foot", "method": "penalty", "law": {"kind": "linear", "stiffness": 1e6},
        "against": {"shape": "plane", "point": [0, 0, -1], "normal": [0, 0, 1]},
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("swap")
    (path / "scene.toml").write_text(SCENE)
    return path


def opened(folder: Path, **changes: Any) -> Job:
    return open_job(folder / "scene.toml", set=changes, db=folder / "db", out=folder / "out")


def made(folder: Path, **changes: Any) -> tuple[ModalRecord, Swaps]:
    """Return the modes of the beam, and its bases."""
    job = opened(folder, **changes)
    run_job(job, "morph")
    swaps = swaps_of(system_of(job))
    assert swaps is not None
    return job.store.get(job.components()["beam"]["modes"].key, "modes"), swaps


def test_neighbours_answer_a_force_at_their_border_alike(folder: Path) -> None:
    """Of a force at a border both have the compliance of many modes with residual flexibility, others have not."""
    modal, swaps = made(folder)
    assert modal.swap is not None
    number, overlap = modal.swap.number, modal.swap.overlap
    assert number.tolist() == [0] * 8 + [1] * 4 + [2] * 4 + [3] * 4
    np.testing.assert_allclose(modal.swap.borders, [-0.05, 0.05], atol=1e-12)
    job = opened(folder, **{"component.beam.modes": {"reduction": "macneal", "swap": "unset", "normal_count": 30}})
    run_job(job, "modes")
    whole = job.store.get(job.components()["beam"]["modes"].key, "modes")
    space, (first, end) = whole.tractions["top"], whole.interface_rows["top"]
    static = (space.rows / whole.angular_frequencies**2) @ space.rows.T
    static += whole.residual_flexibility[first:end, first:end]
    for at, able in ((-0.05, (1, 2)), (0.05, (2, 3))):
        load = spread(space, np.array([[0.0, at]]), np.ones(1))[0]
        for basis in (1, 2, 3):
            own = (number == 0) | (number == basis)
            np.testing.assert_allclose(overlap[np.ix_(own, own)], np.eye(own.sum()), atol=1e-9)
            rows = load @ modal.tractions["top"].rows[:, own]
            share = (rows**2 / modal.angular_frequencies[own] ** 2).sum() / (load @ static @ load)
            assert share == pytest.approx(1.0, abs=1e-8) if basis in able else share < 0.999
    assert [len(swaps.basis(one).columns) for one in (1, 2, 3)] == [12] * 3


def test_change_projects_displacements_by_mass(folder: Path) -> None:
    """Normal modes go on; of the others the new basis has V_newᵀ M V_old, here from shapes and the mass of a solid."""
    modal, swaps = made(folder)
    one, two = swaps.basis(1), swaps.basis(2)
    state = np.random.default_rng(1).normal(size=(2, 12))
    found = swaps.carried(one, two, state)
    np.testing.assert_allclose(found[:, :8], state[:, :8], atol=1e-9)
    assert modal.swap is not None
    np.testing.assert_allclose(found[:, 8:], state[:, 8:] @ modal.swap.overlap[8:12, 12:16], atol=1e-9)
    # Bases with the same border have its static displacement in common: a part of one is kept by the other.
    kept = np.linalg.svd(modal.swap.overlap[8:12, 12:16], compute_uv=False)
    assert 0.5 < kept[0] <= 1 + 1e-9
    assert kept[-1] < 0.5


def test_run_changes_its_basis_at_the_borders(folder: Path) -> None:
    found = run(folder / "scene.toml", db=folder / "db", out=folder / "out", until="solve")
    assert found.result == "FINISHED"
    assert found.quantities["load.basis_changes"]["value"] == 2
    assert 0 < found.quantities["load.energy_jump"]["value"] <= LARGEST_JUMP
    assert found.energy_drift is not None
    assert found.energy_drift < LARGEST_JUMP
    job = opened(folder)
    frames = job.store.get(job.trajectory().key, "trajectory", only=["frames", "frame_times"])
    along = -0.13 + 20 * frames.frame_times
    for basis, span in ((1, slice(8, 12)), (2, slice(12, 16)), (3, slice(16, 20))):
        used = frames.frames[:, span].any(axis=1)
        edges = (-np.inf, -0.05, 0.05, np.inf)
        inside = (along > edges[basis - 1] + 1e-9) & (along < edges[basis] - 1e-9)
        assert used[inside].all()
        assert not used[(along < edges[basis - 1] - 1e-9) | (along > edges[basis] + 1e-9)].any()


def test_one_basis_never_changes(folder: Path) -> None:
    changes = {"component.beam.modes.swap.bases": 1, "component.beam.modes.swap.vectors": 6}
    found = run(folder / "scene.toml", set=changes, db=folder / "db", out=folder / "out", until="solve")
    assert found.quantities["load.basis_changes"]["value"] == 0
    assert found.energy_drift is not None
    assert found.energy_drift < 1e-10


def test_static_shapes_of_interfaces_are_in_every_basis(folder: Path) -> None:
    modal, _ = made(folder, **{"component.beam.modes.static_count": 3})
    assert modal.swap is not None
    assert modal.normal_count == 8
    assert modal.swap.number.tolist() == [0] * 8 + [1] * 7 + [2] * 7 + [3] * 7


def test_jump_of_the_energy_is_refused(folder: Path) -> None:
    """With few modes the next basis cannot go on; the message names what mends it, and it does."""
    few = {"component.beam.modes.normal_count": 1, "component.beam.modes.swap.vectors": 2}
    said = (
        r"component\.beam\.modes\.swap: where force\.load passes \S+ m along, at 0\.0\d+ s, the next basis"
        r" changes the energy of deformation by \S+ of it, allowed: 0\.0001; raise component\.beam\.modes\.normal_count"
    )
    with pytest.raises((InputError, SceneError), match=said):
        run(folder / "scene.toml", set=few, db=folder / "db", out=folder / "out", until="solve")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"component.beam.modes.reduction": "macneal"}, r"swap: is for reduction 'normal\+static', 'macneal' given"),
        ({"component.beam.modes.swap.vectors": 1}, "swap.vectors: .*1 given"),
        ({"force.load": "unset"}, "swap: 1 bodies and 0 forces of kind 'moving'"),
        ({"force.more": OTHER}, "swap: 1 bodies and 2 forces of kind 'moving'"),
        ({"body.other.component": "beam"}, "swap: 2 bodies and 1 forces of kind 'moving'"),
        ({"run.integrator": "event"}, "run.integrator"),
        (GROUND, "swap: contact.floor given; bases change in scenes of given forces"),
        ({"force.load.at": [0.5, -0.13]}, "modes.swap: the force is at 0.5 m across 'top'"),
        (
            {"component.beam.modes.swap.vectors": 5000},
            "vectors: 5000 given in addition to 8 other shapes, its mesh has",
        ),
    ],
    ids=lambda value: "" if isinstance(value, dict) else re.sub(r"\W+", "-", value)[:30],
)
def test_bad_input_is_one_line(changes: dict[str, Any], said: str, folder: Path) -> None:
    with pytest.raises(InputError, match=said) as caught:
        run_job(opened(folder, **changes), "modes")
    assert len(str(caught.value).splitlines()) == 1


def test_other_analyses_take_one_basis(folder: Path) -> None:
    where = r"component\.beam\.modes\.swap: "
    job = opened(folder)
    run_job(job, "morph")
    with pytest.raises(SceneError, match=where + "a linear analysis is of one basis; leave it out"):
        linearised(system_of(job))
    with pytest.raises((InputError, SceneError), match=where + "steps from Python are of one basis; leave it out"):
        simulation(job)
