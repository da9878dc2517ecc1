"""Electrostatic fields as forces on bodies: pull-in, energy, momentum, rotated axes, grids of poses and their ends."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.field import FieldRecord, PoseGridRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.modaldb.stores.folder import FolderStore
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.electrostatic import VACUUM
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from tests.solver.systems import keys_of, rigid_records, stored

MASS, K, GAP, AREA = 1e-9, 1.0, 2e-6, 1e-8
"""Of a plate of micrometres [kg, N/m, m, m²]; an attraction of nanonewtons."""
INERTIA = (1e-18, 1.5e-18, 2e-18)
PERIOD = 2 * np.pi * np.sqrt(MASS / K)
STATIC = np.sqrt(8 * K * GAP**3 / (27 * VACUUM * AREA))
DYNAMIC = np.sqrt(K * GAP**3 / (4 * VACUUM * AREA))
BOTH = pytest.mark.parametrize("integrator", ["small", "turning"])
Table = dict[str, Any]


def solved(
    folder: Path, force: Table, run: Table, *, bodies: Table | None = None, store: FolderStore | None = None,
    **more: Any,
) -> Trajectory:  # fmt: skip
    """Return the run of rigid bodies, `part` alone by default, with forces."""
    placed: Table = {"part": {}} if bodies is None else bodies
    records = {name: rigid_records(MASS, more.pop("points", {}), INERTIA) for name in placed}
    home = stored(folder, records) if store is None else store
    for name in records if store is not None else ():
        stored(folder, {name: records[name]})
    scene = {"body": placed, "force": force, "run": {"samples": 200, "frames": 20} | run} | more
    return simulate(compile_system(home, Scene.model_validate(scene), keys_of(records)))


def spring(damping: float = 0.0) -> Table:
    return {"kind": "bushing", "body": "part", "stiffness": [K] * 3, "rotational_stiffness": [1e-12] * 3,
            "damping": [damping] * 3}  # fmt: skip


def plates(**more: Any) -> Table:
    return {"kind": "parallel-plates", "body": "part", "area": AREA, "gap": GAP} | more


@BOTH
def test_dynamic_pull_in(integrator: str, tmp_path: Path) -> None:
    """A step of the voltage moves the plate to ½ (1 − √(1 − 4 a)) of the gap, a = ε A V²/(k d³), up to d/2; above
    V = √(k d³/(4 ε A)) it touches. The energy of the field is in the balance."""
    for share in (0.3, 0.99):
        force = {"hold": spring(), "pull": plates(potential=share * DYNAMIC)}
        found = solved(tmp_path / str(share), force, {"duration": 4 * PERIOD, "integrator": integrator})
        assert found.result == "FINISHED"
        reached = -found.motion["part"][:, 2].min() / GAP
        assert reached == pytest.approx(0.5 * (1 - np.sqrt(1 - share**2)), rel=2e-3)
        assert found.energy_drift < 1e-3
        assert np.abs(found.energies[:, 4]).max() == 0.0
    above = {"hold": spring(), "pull": plates(potential=1.005 * DYNAMIC)}
    found = solved(tmp_path / "above", above, {"duration": 4 * PERIOD, "integrator": integrator})
    assert found.result == "FIELD_LEFT"
    assert "force.pull" in found.counts["reason"]
    # Its quantities are those of the last frame, in which the plate is still within the gap.
    shift = found.quantities["part.displacement_z"]["value"]
    assert shift == pytest.approx(found.motion["part"][-1, 2], rel=1e-12)
    assert -GAP < shift < -0.5 * GAP
    assert found.energy_drift < 1e-2  # The field grows without end at contact.


@BOTH
def test_static_pull_in(integrator: str, tmp_path: Path) -> None:
    """With strong damping the plate stays below V = √(8 k d³/(27 ε A)), where it has travelled d/3, and not above."""
    damping, run = 2 * np.sqrt(K * MASS), {"duration": 60 * PERIOD, "integrator": integrator}
    for share, result in ((0.995, "FINISHED"), (1.005, "FIELD_LEFT")):
        force = {"hold": spring(damping), "pull": plates(potential=share * STATIC)}
        found = solved(tmp_path / str(share), force, run)
        assert found.result == result, found.counts.get("reason")
    force = {"hold": spring(damping), "pull": plates(potential=0.995 * STATIC)}
    travel = -solved(tmp_path, force, run).motion["part"][-1, 2] / GAP
    roots = np.roots([1.0, -2.0, 1.0, -0.5 * VACUUM * AREA * (0.995 * STATIC) ** 2 / (K * GAP**3)])
    assert travel == pytest.approx(float(np.sort(roots.real)[0]), rel=1e-3)


@BOTH
def test_no_voltage_is_no_force(integrator: str, tmp_path: Path) -> None:
    run = {"duration": PERIOD, "integrator": integrator}
    body = {"part": {"velocity": [0.0, 0.0, 1e-4]}}
    force = {"hold": spring(), "pull": plates(potential=0.0)}
    found = solved(tmp_path / "a", force, run, bodies=body, probe={"pull": {"kind": "force", "of": "force.pull"}})
    assert np.abs(found.probes["pull"].values).max() == 0.0
    free = solved(tmp_path / "b", {"hold": spring()}, run, bodies=body)
    if integrator == "turning":
        np.testing.assert_array_equal(found.motion["part"], free.motion["part"])


@BOTH
def test_a_charge_pulls_with_the_same_force_at_any_gap(integrator: str, tmp_path: Path) -> None:
    """Q²/(2 ε A), so that the plate swings to twice its static travel."""
    Q = 2e-13
    pull = plates(charge=Q, direction=[0.0, -3.0, 0.0])
    probe = {"pull": {"kind": "force", "of": "force.pull"}}
    run = {"duration": PERIOD, "integrator": integrator}
    found = solved(tmp_path, {"hold": spring(), "pull": pull}, run, probe=probe)
    force = Q**2 / (2 * VACUUM * AREA)
    np.testing.assert_allclose(found.probes["pull"].values[:, 1], force, rtol=1e-9)
    assert found.motion["part"][:, 1].max() == pytest.approx(2 * force / K, rel=1e-3)


def co_energy_record(store: FolderStore, axes: dict[str, np.ndarray], capacitance: Any) -> str:
    """Store a grid of two conductors whose C is a function of the axes; return its key."""
    places = np.meshgrid(*axes.values(), indexing="ij")
    C = capacitance(**dict(zip(axes, places, strict=True))).ravel()
    matrices = C[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]]) + np.diag([2e-16, 1e-16])
    nothing, field_key = np.zeros_like(matrices), content_key({"field": "two"})
    names = {"names": ["lower", "upper"], "mesh_keys": {}}
    field = FieldRecord(
        conductors=names, medium={"permittivity": VACUUM}, facets=np.zeros((1, 3, 3)), panel=np.zeros(1, int),
        conductor=np.zeros(1, int), coarse=np.zeros(1, int), density=np.zeros((1, 2)), capacitance=matrices[0],
        panel_error=nothing[0], shape_error=nothing[0], potentials=np.zeros(2), charges=np.zeros(2), quantities={},
        counts={},
    )  # fmt: skip
    cells = int(np.prod([len(one) - 1 for one in axes.values()]))
    grid = PoseGridRecord(
        field_key=field_key, moved={"names": ["upper"], "pivot": [0.0, 0.0, 0.0]}, axes=axes, capacitance=matrices,
        panel_error=nothing, cell_errors=np.zeros(cells), potentials=np.array([0.0, 5.0]), charges=np.zeros(2),
        counts={},
    )  # fmt: skip
    key = content_key({"grid": list(axes)})
    store.put(field_key, "field", field, {"field": "two"})
    store.put(key, "posegrid", grid, {"grid": list(axes)})
    return key


def tilted(x: Any = 0.0, y: Any = 0.0, z: Any = 0.0, rx: Any = 0.0, ry: Any = 0.0, rz: Any = 0.0) -> Any:
    """A smooth capacitance of all six motions [F]."""
    shape = 1 + 0.3 * np.cos(4e5 * x) * np.cos(3e5 * y) + 0.2 * np.sin(rx) * np.cos(ry) + 0.1 * np.sin(rz + ry)
    return 1e-13 * shape * (2e-6 / (6e-6 + z))


SIX = {
    "x": (-3e-6, 3e-6),
    "y": (-3e-6, 3e-6),
    "z": (-3e-6, 3e-6),
    "rx": (-1.0, 1.0),
    "ry": (-1.0, 1.0),
    "rz": (-1.0, 1.0),
}


def test_two_bodies_in_a_field_of_six_motions_keep_energy_and_momentum(tmp_path: Path) -> None:
    """They tumble together: the pose is what the other body sees."""
    store = stored(tmp_path, {})
    key = co_energy_record(store, {name: np.linspace(*ends, 6) for name, ends in SIX.items()}, tilted)
    bodies = {
        "part": {"angular_velocity": [2e3, -1e3, 2e3], "velocity": [1e-3, 2e-3, 0.0]},
        "mate": {"angular_velocity": [2e3, -1.5e3, 1e3], "velocity": [1e-3, 1e-3, -1e-3]},
    }
    pull = {"kind": "electrostatic", "body": "part", "against": "mate", "record": key, "at": [1e-6, 0.0, 2e-6],
            "turn": [20.0, 30.0, -40.0]}  # fmt: skip
    run = {"duration": 1.4e-4, "integrator": "turning", "accuracy": 1e-9}
    found = solved(tmp_path, {"pull": pull}, run, bodies=bodies, store=store)
    assert found.result == "FINISHED", found.counts.get("reason")
    assert found.momentum_residual < 1e-11
    balance = found.energies @ [1, 1, 1, 1, -1]
    assert np.ptp(balance) < 1e-7 * np.ptp(found.energies[:, 0])
    assert np.ptp(found.energies[:, 1]) > 1e-3 * np.ptp(found.energies[:, 0])


@BOTH
def test_the_end_of_the_grid_ends_the_run(integrator: str, tmp_path: Path) -> None:
    store = stored(tmp_path, {})
    key = co_energy_record(store, {"z": np.linspace(-2e-6, 1e-6, 9)}, tilted)
    pull = {"kind": "electrostatic", "body": "part", "record": key, "potentials": {"upper": 0.01}}
    bodies = {"part": {"velocity": [0.0, 0.0, -1e-3]}}
    run = {"duration": 4e-3, "integrator": integrator}
    found = solved(tmp_path, {"pull": pull}, run, bodies=bodies, store=store)
    assert found.result == "FIELD_LEFT"
    assert "along z at t = 0.00" in found.counts["reason"]
    assert found.times[-1] == pytest.approx(2e-3, rel=0.12)
    aside = {"part": {"velocity": [1e-3, 0.0, 0.0]}}
    found = solved(tmp_path, {"pull": pull}, run, bodies=aside, store=store)
    assert "along x" in found.counts["reason"]
    with pytest.raises(SceneError, match=r"force\.pull\.start: the body is at z = 2e-06 m"):
        solved(tmp_path, {"pull": pull | {"start": [0.0, 0.0, 2e-6]}}, run, store=store)
    with pytest.raises(SceneError, match="no conductor 'uper'; the field has lower, upper"):
        solved(tmp_path, {"pull": pull | {"potentials": {"uper": 1.0}}}, run, store=store)


@BOTH
def test_the_error_by_the_grid_is_estimated(integrator: str, tmp_path: Path) -> None:
    """Of plates whose gap is 0.5 to 6.5 µm on 5, 9 and 17 poses, against the exact force at the start."""

    def gap(z: Any) -> Any:
        return 1e-13 * 2e-6 / (3.5e-6 + z)

    run = {"duration": 1e-3, "integrator": integrator}
    probe = {"pull": {"kind": "force", "of": "force.pull"}}
    exact, errors, estimates = 0.5 * 1e-13 * 2e-6 / 3.5e-6**2, list[float](), list[float]()
    for count in (5, 9, 17):
        store = stored(tmp_path / str(count), {})
        key = co_energy_record(store, {"z": np.linspace(-3e-6, 3e-6, count)}, gap)
        pull = {"kind": "electrostatic", "body": "part", "record": key, "potentials": {"lower": 0.0, "upper": 1.0}}
        force = {"pull": pull, "hold": spring()}
        found = solved(tmp_path / str(count), force, run, store=store, probe=probe)
        assert found.result == "FINISHED"
        errors.append(abs(np.linalg.norm(found.probes["pull"].values[0, :3]) / exact - 1))
        for name in ("grid.pull.force", "grid.part.displacement"):
            assert found.estimates[name] > 0.5 * errors[-1]
        estimates.append(found.estimates["grid.pull.force"])
    assert errors[0] > 0.05 > errors[2]
    assert estimates[0] < 5 * errors[0]
    assert estimates[2] < 0.2 * estimates[1] < 0.2 * estimates[0]


@BOTH
def test_a_floating_conductor_keeps_its_charge(integrator: str, tmp_path: Path) -> None:
    """Without a given potential the co-energy is −Q²/(2 C₂₂) plus what the other one adds; energy is conserved."""
    store = stored(tmp_path, {})
    key = co_energy_record(store, {"z": np.linspace(-2e-6, 4e-6, 25)}, tilted)
    grid = store.get(key, "posegrid")
    floating = PoseGridRecord(**vars(grid) | {"potentials": np.array([3.0, np.nan]), "charges": np.array([0.0, 4e-13])})
    other = content_key({"floating": 1})
    store.put(other, "posegrid", floating, {"floating": 1})
    pull = {"kind": "electrostatic", "body": "part", "record": other}
    probe = {"pull": {"kind": "force", "of": "force.pull"}}
    run = {"duration": 2e-5, "integrator": integrator, "step": 1e-8}
    found = solved(tmp_path, {"pull": pull, "hold": spring()}, run, store=store, probe=probe)
    z = found.motion["part"][-1, 2]

    def energy(at: float) -> float:
        c = float(tilted(z=at))
        return 0.5 * (c + 2e-16) * 9.0 - 0.5 * (4e-13 + 3.0 * c) ** 2 / (c + 1e-16)

    slope = (energy(z + 1e-10) - energy(z - 1e-10)) / 2e-10
    assert found.probes["pull"].values[-1, 2] == pytest.approx(slope, rel=2e-2)
    assert found.energy_drift < 1e-3


def test_gaps_of_nanometres_and_metres_are_alike(tmp_path: Path) -> None:
    """All lengths a thousandth and a million times: the same motion over the gap."""
    reached = []
    for scale in (5e-4, 1.0, 1e6):
        gap, area = GAP * scale, AREA * scale**2
        volts = 0.9 * np.sqrt(K * gap**3 / (4 * VACUUM * area))
        pull = plates(gap=gap, area=area, potential=volts)
        found = solved(tmp_path / f"{scale}", {"hold": spring(), "pull": pull},
                       {"duration": 2 * PERIOD, "integrator": "small"})  # fmt: skip
        reached.append(found.motion["part"][:, 2] / gap)
    np.testing.assert_allclose(reached[0], reached[1], atol=1e-6)
    np.testing.assert_allclose(reached[2], reached[1], atol=1e-6)


def test_a_field_alone_makes_no_mechanism_of_a_scene() -> None:
    """`auto` takes small rotations, unless a joint of two markers or a spin asks for more."""
    scene: Table = {"body": {"part": {}}, "force": {"pull": plates(potential=1.0)}, "run": {"duration": 1e-6}}
    assert Scene.model_validate(scene).integrator == "small"
    turning = scene | {"body": {"part": {"angular_velocity": [0.0, 0.0, 1e6]}}}
    assert Scene.model_validate(turning).integrator == "turning"
