"""Grids of poses: capacitances against whole solutions, blocks, interpolation, conservative forces, what is refused."""

import itertools
import re
import tracemalloc
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.field import PoseGridRecord
from gudgeon.pipeline.applications.electrostatics import blocks, stages
from gudgeon.pipeline.applications.electrostatics.job import FieldJob
from gudgeon.pipeline.applications.electrostatics.poses import PoseProblem, conjugate_gradients, memory
from gudgeon.pipeline.applications.electrostatics.refinement import CAUTION
from gudgeon.pipeline.applications.electrostatics.stages import compute_poses
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.solver.forces.fields.pose_field import PoseField, left_jacobian
from gudgeon.solver.vectors import rotation_of
from tests.scenes import scene_path

SCENE = scene_path("electrostatics") / "poses.toml"
COARSE: dict[str, Any] = {"conductor.left.mesh.size": 1.5e-3, "conductor.right.mesh.size": 1.5e-3}
FEW = {"poses.x.points": 4, "poses.y.points": 4}
VOLTS = np.array([-5.0, 5.0])


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("poses")


def job_of(db: Path, **changes: Any) -> FieldJob:
    settings = COARSE | {key.replace("__", "."): value for key, value in changes.items()}
    return open_job(SCENE, set=settings, db=db, out=db / "out")


@pytest.fixture(scope="module")
def record(db: Path) -> PoseGridRecord:
    return compute_poses(job_of(db))


@pytest.fixture(scope="module")
def field(record: PoseGridRecord) -> PoseField:
    return PoseField.of(record)


@pytest.mark.parametrize("half_space", [None, {"point": [0.0, 0.0, -1.5e-3], "permittivity": 4.0}])
def test_a_pose_is_the_scene_in_that_place(db: Path, half_space: Any) -> None:
    """Where it is in the grid, with a rotation, and with images."""
    turned = {"poses.rz": {"values": [-30.0, 0.0, 20.0, 60.0]}, "poses.y": "unset", "poses.pivot": [1e-3, 0.0, 0.0]}
    turned |= {"poses.x": {"values": [0.0, 1e-4, 2e-4, 4e-4], "ends": "unset", "points": "unset"}}
    plane = {} if half_space is None else {"half_space": half_space}
    found = compute_poses(job_of(db, **turned, **plane))
    values = found.capacitance.reshape(4, 4, 2, 2)
    Q = rotation_of(np.array([0.0, 0.0, np.radians(60.0)]))
    place = np.array([1e-3, 0.0, 0.0]) + Q @ [1e-4, 0.0, 0.0] + [4e-4, 0.0, 0.0]
    moved = {
        "conductor.right.position": place.tolist(),
        "conductor.right.orientation": {"axis": [0, 0, 1], "angle": 60.0},
    }
    job = job_of(db, **moved, **plane, poses="unset")
    run(SCENE, set=COARSE | moved | plane | {"poses": "unset"}, db=db, out=db / "out", until="solve")
    whole = job.store.get(job.field().key, "field")
    assert values[3, 3] == pytest.approx(whole.capacitance, rel=2e-6)
    errors = found.panel_error.reshape(4, 4, 2, 2)
    assert errors[3, 3] == pytest.approx(whole.panel_error, rel=1e-2)


def test_the_spline_is_exact_at_points_and_its_gradient_a_derivative(record: PoseGridRecord, field: PoseField) -> None:
    at = {"x": float(record.axes["x"][3]), "y": float(record.axes["y"][1])}
    assert field.capacitance(at)[0] == pytest.approx(record.capacitance.reshape(9, 5, 2, 2)[3, 1], rel=1e-12)
    pose, step = {"x": 3.3e-4, "y": -1.1e-4}, 1e-7
    for number, name in enumerate(("x", "y")):
        up, down = (field.capacitance(pose | {name: pose[name] + sign * step})[0] for sign in (1, -1))
        assert field.capacitance(pose)[1][number] == pytest.approx((up - down) / (2 * step), rel=1e-5, abs=1e-18)


def test_forces_are_those_of_the_image_series(field: PoseField) -> None:
    """Reference I4 at 3 mm between centres; the spheres attract."""
    force = field.interaction({"x": 0.8e-3}, VOLTS).force
    assert force[0] == pytest.approx(-8.84047542140969e-10, rel=3e-3)
    assert abs(force[1]) < 1e-3 * abs(force[0])
    sideways = field.interaction({"x": 0.8e-3, "y": 3e-4}, VOLTS).force
    assert sideways[1] == pytest.approx(sideways[0] * 3e-4 / 3e-3, rel=2e-2)


def work_around(force: Callable[[np.ndarray], np.ndarray], axes: list[np.ndarray]) -> tuple[float, float]:
    """Return the work around a circle in the grid and the sum of its amounts, by Gauss's rule of cell after cell."""
    turns = np.linspace(0, 2 * np.pi, 2001)
    x, w = np.polynomial.legendre.leggauss(4)
    middle = np.array([axis.mean() for axis in axes])
    size = np.array([0.4 * np.ptp(axis) for axis in axes])
    net = amount = 0.0
    for a, b in itertools.pairwise(turns):
        for point, weight in zip(x, w, strict=True):
            turn = 0.5 * (a + b) + 0.5 * (b - a) * point
            along = size * [-np.sin(turn), np.cos(turn)]
            power = float(force(middle + size * [np.cos(turn), np.sin(turn)]) @ along) * 0.5 * (b - a) * weight
            net, amount = net + power, amount + abs(power)
    return net, amount


def test_the_force_is_conservative_and_an_interpolated_force_is_not(record: PoseGridRecord, field: PoseField) -> None:
    from scipy.interpolate import RegularGridInterpolator

    axes = [record.axes["x"], record.axes["y"]]
    energy = field.interaction({"x": float(axes[0].mean())}, VOLTS).co_energy
    net, amount = work_around(lambda at: field.interaction({"x": at[0], "y": at[1]}, VOLTS).gradient, axes)
    assert abs(net) < 1e-9 * energy
    assert amount > 1e-3 * energy
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    forces = np.array([field.interaction({"x": x, "y": y}, VOLTS).gradient for x, y in nodes]).reshape(9, 5, 2)
    linear = RegularGridInterpolator(axes, forces)
    net, _ = work_around(lambda at: linear(at)[0], axes)
    assert abs(net) > 1e-6 * energy


def test_the_work_of_a_way_is_its_change_of_energy_with_rotation() -> None:
    """Force and torque on a way through all six axes, of a C that is known: what they do is the change of co-energy."""
    nodes = np.linspace(-0.5, 0.5, 6)
    names = ("x", "y", "z", "rx", "ry", "rz")
    mesh = np.stack(np.meshgrid(*[nodes] * 6, indexing="ij"), axis=-1)
    values = 3 + np.sin(mesh @ [0.3, -0.5, 0.7, 0.4, 0.6, -0.2]) * np.cos(mesh @ [0.1, 0.2, 0.3, 0.9, -0.7, 0.5])
    field = PoseField({name: nodes for name in names}, values[..., None, None])
    ends = np.array([[-0.3, 0.1, 0.4, -0.4, 0.3, 0.2], [0.4, -0.2, 0.1, 0.35, -0.1, 0.45]])
    rate, work = ends[1] - ends[0], 0.0
    x, w = np.polynomial.legendre.leggauss(4)
    for cell in range(80):
        for point, weight in zip(x, w, strict=True):
            at = ends[0] + rate * (cell + 0.5 + 0.5 * point) / 80
            found = field.interaction(dict(zip(names, at, strict=True)), np.ones(1))
            spin = left_jacobian(at[3:]) @ rate[3:]
            work += (found.force @ rate[:3] + found.torque @ spin) * weight / 160
    energies = [field.interaction(dict(zip(names, at, strict=True)), np.ones(1)).co_energy for at in ends]
    assert work == pytest.approx(energies[1] - energies[0], rel=1e-7)


def test_the_left_jacobian_turns_as_the_rotation_does() -> None:
    rotation, rate, step = np.array([0.4, -0.7, 0.3]), np.array([0.2, 0.5, -0.9]), 1e-6
    slope = (rotation_of(rotation + step * rate) - rotation_of(rotation - step * rate)) / (2 * step)
    spin = slope @ rotation_of(rotation).T
    assert left_jacobian(rotation) @ rate == pytest.approx([spin[2, 1], spin[0, 2], spin[1, 0]], abs=1e-8)
    assert left_jacobian(1e-5 * rotation) @ rate == pytest.approx(rate, abs=1e-4)


def test_a_floating_conductor_is_attracted_by_its_image_charge(field: PoseField) -> None:
    """Without charge it takes a potential between; the force is still the derivative at the potentials found."""
    found = field.interaction({"x": 2e-4}, np.array([5.0, np.nan]))
    assert 0 < found.potentials[1] < 5
    assert found.force[0] < 0
    C, slopes = field.capacitance({"x": 2e-4})
    assert C[1] @ found.potentials == pytest.approx(0.0, abs=1e-12 * C[1, 1])
    assert found.gradient[0] == pytest.approx(0.5 * found.potentials @ slopes[0] @ found.potentials)


def test_estimates_of_cells_follow_the_error(db: Path, record: PoseGridRecord) -> None:
    """Between the points of a coarser grid, the error is known from the finer one."""
    coarse = compute_poses(job_of(db, poses__x__points=5))
    spline = PoseField.of(coarse)
    known = record.capacitance.reshape(9, 5, 2, 2)
    scale = np.abs(known).max()
    for cell, number in enumerate((1, 3, 5, 7)):
        found = spline.capacitance({"x": float(record.axes["x"][number])})[0]
        error = np.abs(found - known[number, 2]).max() / scale
        estimate = coarse.cell_errors.reshape(4, 4)[cell].max()
        assert error < 12 * estimate
        assert estimate < 300 * error + 1e-5
    assert record.cell_errors.max() < coarse.cell_errors.max()


def test_a_stopped_grid_goes_on_where_it_was(db: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = job_of(db, permittivity=2.0)
    monkeypatch.setattr("gudgeon.pipeline.applications.electrostatics.grid.BLOCK", 8)
    compute, made = blocks.compute_block, []

    def stopping(*arguments: Any) -> None:
        if len(made) == 3:
            raise KeyboardInterrupt
        compute(*arguments)
        made.append(arguments[1].key)

    monkeypatch.setattr(blocks, "compute_block", stopping)
    with pytest.raises(KeyboardInterrupt):
        compute_poses(job)
    assert sum(job.store.has(one.key) for one, _ in job.grid().blocks(job.name)) == 3
    monkeypatch.setattr(blocks, "compute_block", lambda *a: (made.append(a[1].key), compute(*a)))
    found = compute_poses(job)
    assert len(made) == len(set(made)) == 6 == len(job.grid().blocks(job.name))
    assert found.counts["poses"] == 45


def test_any_executor_gives_the_same(db: Path, tmp_path: Path) -> None:
    one = compute_poses(job_of(db, **FEW))
    with ThreadPoolExecutor(2) as pool:
        other = compute_poses(job_of(tmp_path, **FEW), pool)
    assert np.array_equal(one.capacitance, other.capacitance)


def test_the_run_has_the_estimates_and_is_fresh_then(db: Path) -> None:
    settings = COARSE | FEW
    report = run(SCENE, set=settings, db=db, out=db / "run", until="poses")
    assert {"interpolation.largest", "interpolation.median", "panels", "shape"} == report.estimates.keys()
    again = run(SCENE, set=settings, db=db, out=db / "run", until="poses")
    assert again.stages["poses"].state == "fresh"


def test_conjugate_gradients_solve_and_tell_when_they_cannot(monkeypatch: pytest.MonkeyPatch) -> None:
    matrix = np.diag(np.linspace(1, 9, 9))
    right = np.stack([np.ones(9), np.zeros(9)], axis=1)
    found, iterations = conjugate_gradients(lambda x: matrix @ x, lambda x: x, right)
    assert found == pytest.approx(np.linalg.solve(matrix, right))
    assert iterations <= 9
    with pytest.raises(StageError, match="not positive definite"):
        conjugate_gradients(lambda x: -x, lambda x: x, right)
    monkeypatch.setattr("gudgeon.pipeline.applications.electrostatics.poses.MOST_ITERATIONS", 3)
    with pytest.raises(StageError, match="conjugate gradients did not converge in 3 iterations"):
        conjugate_gradients(lambda x: matrix @ x, lambda x: x, right)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"poses.moved": ["wheel"]}, "poses.moved: no conductor 'wheel'; the scene has left, right"),
        ({"poses.moved": ["left", "right"]}, "poses.moved: all conductors given; at least one must stay"),
        ({"poses.x": "unset", "poses.y": "unset"}, "poses: no axis given"),
        ({"poses.x.points": 3}, "poses.x.points: 3 given; input should be greater than or equal to 4"),
        ({"poses.x": {"values": [0.0, 1e-4, 1e-4, 2e-4], "ends": "unset", "points": "unset"}},
         "poses.x: .* allowed: numbers that ascend"),
        ({"poses.x.ends": [0.0, float("nan")]}, "poses.x.ends.1: nan given"),
        ({"poses.x.ends": [-5e-4, 1e-3]}, "poses.moved: conductors touch or overlap at the pose x = -0.0005"),
        ({"poses.moved": ["left"], "conductor.left.geometry.radius": 2e-4, "conductor.left.position": [-2e-3, 0.0, 0.0],
          "conductor.left.mesh.size": 3e-4, "poses.y": "unset",
          "poses.x": {"values": [0.0, 1e-4, 2e-4, 3.1e-3], "ends": "unset", "points": "unset"}},
         "poses.moved: conductors touch or overlap at the pose x = 0.0031; narrow the grid"),
        ({f"poses.{axis}": {"ends": [0.0, 1e-5], "points": 1000} for axis in "xyz"}
         | {f"poses.r{axis}": {"ends": [0.0, 1.0], "points": 100} for axis in "xy"},
         r"poses: 10000000000000 poses \(x: 1000, y: 1000, .*; allowed: 1000000. Give fewer points or axes"),
        ({"poses.hours": 1e-9}, r"poses.hours: 1e-09 h allowed; 45 poses \(x: 9, y: 5\) of \d+ panels would"),
    ],
)  # fmt: skip
def test_bad_grids_have_one_line(db: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        run(SCENE, set=COARSE | changes | {"permittivity": 3.0}, db=db, out=db / "bad", until="poses")
    assert "poses.toml: " in str(caught.value)


@pytest.mark.parametrize(
    ("pose", "message"),
    [({"x": 2e-3}, "pose: x = 0.002 m is outside of the grid, 0 to 0.0012"), ({"y": float("nan")}, "pose: y = nan m"),
     ({"rz": 0.1}, "pose: rz = 0.1 given; the grid has the axes x, y only")],
)  # fmt: skip
def test_nothing_is_extrapolated(field: PoseField, pose: dict[str, float], message: str) -> None:
    from gudgeon.solver.errors import SolverError

    with pytest.raises(SolverError, match=message):
        field.interaction(pose, VOLTS)


def test_a_grid_is_refined_until_its_estimate_is_within_the_tolerance(
    db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The estimate bounds the true error between the points, each pose is computed once, and a stopped run goes on."""
    tolerance = 2e-4
    changes = {"poses.y": "unset", "poses.x.points": 4, "poses.tolerance": tolerance, "permittivity": 1.25}
    job = job_of(db, **changes)
    computed, whole = list[np.ndarray](), blocks.compute_block

    def counted(root: str, one: Any, grid: Any, poses: np.ndarray) -> None:
        if len(computed) == 1:
            computed.append(np.empty((0, 6)))
            raise StageError("stopped")
        computed.append(poses)
        whole(root, one, grid, poses)

    monkeypatch.setattr(blocks, "compute_block", counted)
    with pytest.raises(StageError, match="stopped"):
        compute_poses(job)
    record = compute_poses(job)
    nodes = record.axes["x"]
    assert len(nodes) > 4
    assert np.diff(nodes)[0] < np.diff(nodes)[-1]  # Where the spheres are near.
    poses = np.concatenate(computed)
    assert len(poses) == len(np.unique(poses, axis=0)) == len(nodes)
    assert record.cell_errors.max() <= CAUTION * tolerance
    between = 0.5 * (nodes[1:] + nodes[:-1])
    fine = compute_poses(job_of(db, **changes | {"poses.tolerance": "unset", "poses.x": {
        "values": between.tolist(), "ends": "unset", "points": "unset"}}))  # fmt: skip
    field, scale = PoseField.of(record), np.abs(record.capacitance).max()
    for x, C in zip(between, fine.capacitance, strict=True):
        assert np.abs(field.capacitance({"x": float(x)})[0] - C).max() / scale <= tolerance


def test_a_refined_grid_is_refused_where_it_would_take_too_long(db: Path) -> None:
    changes = {"poses.y": "unset", "poses.x.points": 4, "poses.tolerance": 1e-6, "poses.hours": 1e-4}
    with pytest.raises(InputError, match=r"poses.hours: .* a larger tolerance"):
        compute_poses(job_of(db, **changes))


@pytest.mark.parametrize("half_space", [None, {"point": [0.0, 0.0, -1.5e-3], "permittivity": 4.0}])
def test_memory_of_a_grid_is_foreseen(db: Path, half_space: Any) -> None:
    """The largest arrays of numpy at once, within 20 %, of which the rest are vectors and quadrature of panels."""
    finer = {"conductor.left.mesh.size": 4e-4, "conductor.right.mesh.size": 5e-4}
    job = job_of(db, **finer, **FEW, **({} if half_space is None else {"half_space": half_space}))
    run(job.path, set=job.overrides, db=db, out=db / "memory", until="solve")
    record, grid = job.store.get(job.field().key, "field"), job.grid()
    assert grid is not None
    counts = np.bincount(record.conductor)
    pose = grid.poses()[-1]
    tracemalloc.start()
    try:
        PoseProblem(record, grid.moved).at(pose)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert min(counts) > 300
    assert memory(counts[0], counts[1], images=half_space is not None) == pytest.approx(peak, rel=0.2)


def test_a_grid_beyond_the_memory_is_refused(db: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With what to coarsen; 20 000 panels in two equal parts would need 4.6 GB."""
    assert memory(10_000, 10_000, images=False) == pytest.approx(4.6e9, rel=0.05)
    monkeypatch.setattr(stages, "MOST_MEMORY", 1e5)
    with pytest.raises(InputError) as error:
        compute_poses(job_of(db, **FEW, **{"poses.x.ends": [0.0, 1.1e-4]}))
    text = str(error.value)
    assert "\n" not in text
    assert re.search(r"poses: \d+ panels stay and \d+ move, for which a process would need about [0-9.]+ GB", text)
    assert "fewer by a larger mesh.size, or panels.strips or panels.corner_divisions below" in text


def test_a_sphere_moves_over_a_grounded_half_space_alone(tmp_path: Path) -> None:
    """Reference I4 has its capacitance and force, with its centre 1.5 radii above the plane."""
    (tmp_path / "scene.toml").write_text("""
[conductor.ball]
geometry = { kind = "sphere", radius = 1e-3 }
mesh.size = 8e-4
position = [0.0, 0.0, 1.5e-3]
potential = 10.0

[half_space]
permittivity = "conductor"

[poses]
moved = ["ball"]
z = { ends = [-3e-4, 3e-4], points = 9 }
""")
    record = compute_poses(open_job(tmp_path / "scene.toml", db=tmp_path / "db"))
    field = PoseField.of(record)
    force = field.interaction({"z": 0.0}, record.potentials, record.charges).force
    assert force == pytest.approx([0, 0, -3.536190168563876e-09], rel=2e-3, abs=1e-15)
    assert field.capacitance({"z": 0.0})[0][0, 0] == pytest.approx(1.7083300817896818e-13, rel=5e-4)
