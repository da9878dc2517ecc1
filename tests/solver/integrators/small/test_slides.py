"""Sliding pairs in the loop over ports: as in the loop of their own, with laws, and what they conserve."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.modaldb.stores.folder import Store
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.small import constants
from gudgeon.solver.integrators.small.integrator import Small
from gudgeon.solver.linear.modes import assembled_modes
from gudgeon.solver.linear.state import linearised
from gudgeon.solver.ports.members import contact_ports, ports_of, with_surfaces
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.simulation import Steps
from gudgeon.solver.system.compile import compile_system
from tests.solver.features import DURATION, draft_of, records, store_of, system_of
from tests.solver.systems import (
    build_all,
    driven_pair_records,
    driven_pair_scene,
    keys_of,
    march,
    stored,
    with_tractions_across,
)

SWEEPS = 3
"""Place of the sweeps among the counts of a run."""


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return store_of(tmp_path_factory.mktemp("sliding"))


@pytest.fixture
def over_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Scene, "general", property(lambda self: True))


def impulse(found: Trajectory) -> float:
    return float(found.quantities["slide.impulse"]["value"])


@pytest.mark.parametrize(
    "others", [(), ("damping",), ("joint", "gas"), ("layer",), ("moving-force",), ("gravity", "residual")], ids="+".join
)
def test_it_is_the_loop_of_sliding_pairs(
    others: tuple[str, ...], store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    names, step = ("sliding", *others), 5e-7
    own = simulate(system_of(store, names, step=step))
    monkeypatch.setattr(Scene, "general", property(lambda self: True))
    ours = simulate(system_of(store, names, step=step))
    assert impulse(own) > 0
    assert impulse(ours) == pytest.approx(impulse(own), rel=2e-4)
    assert own.contacts["slide"].master is not None
    scale = np.abs(own.contacts["slide"].master).max()
    np.testing.assert_allclose(ours.contacts["slide"].master, own.contacts["slide"].master, rtol=0, atol=2e-3 * scale)


def slid(store: Store, step: float, **contact: object) -> Trajectory:
    """A rigid cube that slides at 40 m/s over an elastic rail, on which it lands at 0.2 m/s; held in no direction."""
    draft = draft_of(("sliding",))
    draft.scene["body"]["part"].update(velocity=[0.2, 0.0, 20.0], component="rigid")
    draft.scene["body"]["rail"].update(freedom=["x", "y", "z", "rx", "ry", "rz"], component="elastic")
    draft.scene["contact"] = {"slide": draft.scene["contact"]["slide"] | contact}
    draft.scene["contact"]["slide"] = {
        key: value for key, value in draft.scene["contact"]["slide"].items() if value is not None
    }
    draft.scene["run"].update(step=step, duration=0.6 * DURATION)
    return simulate(compile_system(store, Scene.model_validate(draft.scene), keys_of(("elastic", "rigid"))))


LAWS = {
    "layer": {},
    "linear": {"surface_stiffness": None, "law": {"kind": "linear", "stiffness": 1e8, "damping": 100.0}},
    "hertz": {"surface_stiffness": None, "law": {"kind": "hertz", "stiffness": 1e9}},
    "penalty": {"surface_stiffness": None, "method": "penalty", "law": {"kind": "hertz", "stiffness": 1e9}},
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.usefixtures("over_ports")
def test_energy_and_momentum_while_it_slides_fast(law: str, store: Store) -> None:
    """The error of the energy balance falls with the step: the drag acts a step late."""
    coarse, fine = (slid(store, step, **LAWS[law]) for step in (1e-6, 2.5e-7))
    for found in (coarse, fine):
        assert found.result == "FINISHED"
        assert found.momentum_residual < 1e-10
    assert impulse(fine) > 0.01
    assert impulse(coarse) == pytest.approx(impulse(fine), rel=1e-3)
    assert fine.energy_drift < max(1e-6, 0.5 * coarse.energy_drift)
    assert coarse.energy_drift < 1e-3


RUBBING = {
    "layer": {},
    "hertz": {"surface_stiffness": None, "law": {"kind": "hertz", "stiffness": 1e9}},
}


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """The same bodies, whose traction spaces take friction."""
    parts = {"elastic": records(elastic=True), "rigid": records(elastic=False)}
    made = {name: (with_tractions_across(modal, "top"), morph) for name, (modal, morph) in parts.items()}
    return stored(tmp_path_factory.mktemp("rubbing"), made)


@pytest.mark.parametrize("law", RUBBING)
def test_friction_over_a_surface_of_a_free_body(law: str, rubbing: Store) -> None:
    """Linear and angular momentum of both bodies to round-off, energy with the work of friction; μ of the impulse."""
    friction, speed = 0.2, 20.0
    coarse, fine = (slid(rubbing, step, friction={"static": friction}, **RUBBING[law]) for step in (1e-6, 2.5e-7))
    for found in (coarse, fine):
        assert found.result == "FINISHED"
        assert found.momentum_residual < 1e-10
        assert found.energies[-1, 3] > 0.9 * friction * impulse(found) * speed
    assert fine.energy_drift < max(1e-6, 0.5 * coarse.energy_drift)
    assert coarse.energy_drift < 1e-3
    # It slides on at 20 m/s and more: each force is at the border of its cone, against the motion.
    force = fine.contacts["slide"].force
    pressed = np.abs(force[:, 0]) > 0
    np.testing.assert_allclose(force[pressed, 2], -friction * np.abs(force[pressed, 0]), rtol=1e-3)


def test_an_older_record_has_no_tractions_across(store: Store) -> None:
    with pytest.raises(SceneError, match=r"contact\.slide\.friction: .* no tractions across the normal"):
        slid(store, 1e-6, friction={"static": 0.2})


def test_friction_along_a_line_is_refused(store: Store) -> None:
    with pytest.raises(ValidationError, match=r"friction\.direction and against\.shape 'surface' cannot be combined"):
        slid(store, 1e-6, friction={"static": 0.2, "direction": [0.0, 0.0, 1.0]})


def test_rigid_contact_does_not_slide_over_a_surface(store: Store) -> None:
    with pytest.raises(ValidationError, match=r"method 'impact' and against\.shape 'surface' cannot be combined"):
        slid(store, 1e-6, surface_stiffness=None, method="impact", restitution=0.5)


@pytest.mark.parametrize("over_ports", [True, False])
def test_points_that_leave_their_surface_under_load_end_the_run(
    over_ports: bool, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What they pressed in is lost: no number is given for it."""
    draft = draft_of(("sliding",))
    draft.scene["body"]["part"].update(velocity=[0.2, 0.0, 100.0], component="rigid")
    draft.scene["body"]["rail"].update(component="elastic")
    system = compile_system(store, Scene.model_validate(draft.scene), keys_of(("elastic", "rigid")))
    monkeypatch.setattr(Scene, "general", property(lambda self: over_ports))
    found = simulate(system)
    assert impulse(found) > 0.1
    assert found.result == "SURFACE_LEFT"
    where = r"the point of '[\w-]+' at \(.*\) m of part left '\w+' of rail at [\d.e-]+ s \(contact\.slide\): "
    assert re.match(where, str(found.counts["reason"]))


@pytest.mark.parametrize("ratio", [0.05, 0.3])
def test_one_damped_body_without_a_layer(ratio: float, store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other one yields at once, so that the force does not jump."""
    draft = draft_of(("sliding",))
    draft.scene["body"]["part"].update(velocity=[0.2, 0.0, 5.0], component="elastic")
    draft.scene["body"]["rail"].update(component="elastic", damping={"ratio": ratio, "frequency": 2000.0})
    del draft.scene["contact"]["slide"]["surface_stiffness"]
    draft.scene["run"]["step"] = 2.5e-7
    system = compile_system(store, Scene.model_validate(draft.scene), keys_of(("elastic", "rigid")))
    own = simulate(system)
    monkeypatch.setattr(Scene, "general", property(lambda self: True))
    assert impulse(simulate(system)) == pytest.approx(impulse(own), rel=5e-4)


def test_rows_at_a_position_are_those_of_the_gaps(store: Store) -> None:
    system = system_of(store, ("sliding", "damping"))
    position = np.random.default_rng(0).normal(scale=1e-6, size=len(system.position))
    ports = ports_of(system)
    joined, normals = with_surfaces(system, ports, position), contact_ports(ports, system.contacts[0])
    np.testing.assert_allclose(joined.rows[normals] @ position, system.moved_gaps(position), rtol=1e-12)
    whole = joined.residual.dense()
    own = ports.residual.dense()
    assert (whole.diagonal()[normals] > own.diagonal()[normals]).all()
    np.testing.assert_allclose(whole, whole.T, rtol=0, atol=1e-14 * np.abs(whole).max())


def test_it_is_stepped_from_python_and_continues_with_the_same_bits(store: Store) -> None:
    system = system_of(store, ("sliding",), step=1e-6)
    steps = Steps(system)
    steps.step(until=4e-4)
    found, layer = steps.contact("slide"), float(system.layer[0])
    assert found.force.max() > 0
    np.testing.assert_allclose(found.displacement, -layer * found.force, rtol=0, atol=1e-13)
    assert "surface.slide" not in steps.ports
    held = steps.checkpoint()
    steps.step(until=DURATION)
    again = Steps(system)
    again.load(held)
    again.step(until=DURATION)
    assert again.body("part").velocity.tobytes() == steps.body("part").velocity.tobytes()
    inside = simulate(system).quantities["part.velocity_x"]["value"]
    assert steps.body("part").velocity[0] == pytest.approx(inside, rel=1e-4)  # The run has the own loop.


@pytest.mark.parametrize("damping", [{}, {"damping": {"ratio": 0.02, "frequency": 2000.0}}], ids=["free", "damped"])
def test_closed_points_and_joints_are_found_as_by_sweeps(
    damping: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An elastic piston on a rod: rows of closed points of an earlier place, and exact ones of each step."""
    scene = driven_pair_scene(checks=False, clearance=1e-5, duration=1e-3, step=2e-6)
    scene["body"]["part"] |= damping
    system = build_all(tmp_path, driven_pair_records(6), scene)
    closed = march(system, 2e-6, 500, Small)
    monkeypatch.setattr(constants, "_paired", lambda *_: False)
    swept = march(system, 2e-6, 500, Small)
    assert closed.run.arrays.constants.paired
    assert closed.run.arrays.state.counts[SWEEPS] == 0
    assert swept.run.arrays.state.counts[SWEEPS] > 0
    assert np.count_nonzero(np.abs(swept.forces).max(axis=(1, 2))) > 50
    for one, other, bound in ((closed.forces, swept.forces, 1e-3), (closed.snapshots, swept.snapshots, 1e-5)):
        np.testing.assert_allclose(one, other, rtol=0, atol=bound * np.abs(other).max())


def test_closed_points_of_a_sliding_pair_in_linear_analysis(store: Store) -> None:
    """Both bodies' flexibilities and the layer are in series with the rows of the gap."""
    system = system_of(store, ("sliding", "residual"))
    contact = next(one for one in system.contacts if one.master is not None)
    over, row = contact.master, contact.rows.start
    assert over is not None
    normal = np.array([system.moved_gaps(1e-9 * one)[row] for one in np.eye(len(system.position))]) / 1e-9
    touched = np.array([over.at_points(0.0, one)[0] for one in np.eye(len(over.order))])
    compliance = system.layer[row] + system.residual[row][row] + touched @ over.residual @ touched
    squared = np.linalg.eigvalsh(np.diag(system.stiffness) + np.outer(normal, normal) / compliance)
    found = linearised(system, closed=["contact.slide"])
    assert found.closed["slide"] == 1
    wanted = np.sqrt(squared[squared > 1e-9 * squared.max()]) / (2 * np.pi)
    frequencies = assembled_modes(found).frequencies
    np.testing.assert_allclose(np.sort(frequencies[frequencies > 1e-3]), wanted, rtol=1e-9)
