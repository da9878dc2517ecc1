"""The full FE of bodies that meet at fixed points: exact pulses, published impacts, energy, what is refused."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.nodal.points import banded as narrow
from gudgeon.pipeline.nodal.points import loop as meeting
from gudgeon.pipeline.nodal.points.contact import new_press, press
from gudgeon.pipeline.nodal.problem import NodalBody, PointContact, PointProblem
from gudgeon.pipeline.nodal.quantities import History, contact_quantities, located, resolved, windows_of
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.nodal.start import supported_body
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.summary import reference_values
from gudgeon.solver import core
from tests.pipeline.blocks import block, on_plane
from tests.scenes import scene_path

ENERGY = 1e-9
"""Newton stops at 1e-13 of the gap, solves at round-off; over thousands of steps less than this share is missing."""


def job_of(scene: str, tmp_path: Path, changes: dict[str, Any] | None = None) -> Job:
    """Return a shipped scene with its meshes and modes made."""
    coarse = {"component.rod.mesh.size": 0.02, "component.rod.modes.normal_count": 5} if "rod-" in scene else {}
    job = open_job(scene_path(scene), set=coarse | (changes or {}), db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    return job


def value(run: NodalRecord, name: str) -> float:
    """Return a quantity."""
    return float(run.quantities[name]["value"])


def total(run: NodalRecord) -> np.ndarray:
    """Return kinetic, strain and contact energy together [J], (s,)."""
    return run.energies.sum(axis=1)


BAR = {"component.rod.mesh.size": 0.01, "run.duration": 5e-4}


@pytest.mark.parametrize("method", ["residual", "constraint"])
def test_bar_on_a_wall_has_the_exact_pulse(method: str, tmp_path: Path) -> None:
    job = job_of("rod-wall", tmp_path, BAR | {"contact.wall.method": method})
    exact = reference_values(job.scene.report, job.folder)
    problem = nodal_problem(job)
    errors = []
    for step in (4e-6, 1e-6, 2.5e-7):
        run = simulate_nodal(problem, step)
        errors.append([abs(value(run, name) / exact[name] - 1) for name in ("wall.impulse", "wall.duration")])
        assert run.energy_drift < ENERGY
        assert np.diff(total(run)).max() < ENERGY * total(run)[0]  # A rigid contact gives nothing.
        assert value(run, "energy_lost") > 0
        assert value(run, "wall.impacts") == 1
    assert max(errors[-1]) < 5e-3
    assert np.all(np.array(errors)[-1] < 0.4 * np.array(errors)[0])
    plateau = run.forces["wall"][(run.times > 5e-5) & (run.times < 3e-4), 0].mean()
    force = json.loads(scene_path("rod-wall/A1_rod_rigid_wall.json").read_text())["expected"]["contact_force_plateau"]
    assert -plateau == pytest.approx(force["value"], rel=2e-3)


def test_bars_exchange_their_velocities(tmp_path: Path) -> None:
    job = job_of("bars-longitudinal", tmp_path, {"component.bar.mesh.size": 0.02, "component.bar.modes.fixed_count": 4})
    run = simulate_nodal(nodal_problem(job), 5e-7)
    mass = 7850 * 3.141592653589793e-4
    assert value(run, "two.velocity_x") == pytest.approx(1.0, abs=1e-2)
    assert mass * value(run, "two.velocity_x") == pytest.approx(value(run, "pair.impulse"), rel=1e-9)
    one = run.quantities.get("one.velocity_x", {"value": 0.0})["value"]
    assert one + value(run, "two.velocity_x") == pytest.approx(1.0, rel=1e-9)
    assert value(run, "pair.restitution") == pytest.approx(value(run, "two.velocity_x") - one, rel=1e-9)


def test_a_ball_on_a_beam_strikes_three_times(tmp_path: Path) -> None:
    job = job_of("beam-sphere", tmp_path, {"component.beam.mesh.size": 0.006, "component.beam.modes.normal_count": 4})
    exact = reference_values(job.scene.report, job.folder)
    problem = nodal_problem(job)
    coarse, fine = (simulate_nodal(problem, step) for step in (4e-6, 1e-6))
    worst = [max(abs(value(run, name) / exact[name] - 1) for name in exact) for run in (coarse, fine)]
    assert worst[1] < 5e-3  # Of the third impact's force; the mesh's own error is below.
    assert worst[1] < 0.3 * worst[0]
    assert max(coarse.energy_drift, fine.energy_drift) < ENERGY
    assert fine.coordinates == 2 * (52 + 1) - 2 + 3


def test_a_hinged_beam_swings_against_a_stop(tmp_path: Path) -> None:
    job = job_of("pendulum", tmp_path, {"component.beam.mesh.size": 0.025, "component.beam.modes.normal_count": 4})
    exact = reference_values(job.scene.report, job.folder)
    run = simulate_nodal(nodal_problem(job), 5e-6)
    assert max(abs(value(run, name) / exact[name] - 1) for name in exact) < 1e-4
    assert run.energy_drift < ENERGY


SHEET = """
[component.sheet]
geometry = { kind = "rectangle", lx = 0.2, ly = 0.02, thickness = 0.01, state = "plane-stress" }
material = { E = 210e9, nu = 0.0, rho = 7800.0 }
mesh = { size = 0.01 }
interface.end = { surface = "right", kind = "KIND" }
modes = { reduction = "macneal", normal_count = 4 }
[body.sheet]
velocity = [1.0, 0, 0]
[contact.wall]
body = "sheet"
interface = "end"
against = { shape = "plane", point = [0.1, 0, 0], normal = [-1, 0, 0] }
method = "residual"
[run]
duration = 1e-4
"""


@pytest.mark.parametrize("kind", ["patch", "points"])
def test_plane_part_on_a_wall_has_the_bar_pulse(kind: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SHEET.replace("KIND", kind))
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    run = simulate_nodal(nodal_problem(job), 2e-7)
    assert value(run, "wall.impulse") == pytest.approx(2 * 0.312, rel=1e-2)
    middle = (run.times > 1e-5) & (run.times < 6e-5)
    assert -run.force[middle, 0].mean() == pytest.approx(2e-4 * np.sqrt(210e9 * 7800.0), rel=5e-3)
    assert run.energy_drift < ENERGY


BALL = """
[component.ball]
geometry = { kind = "rigid", mass = 2.0, points = { foot = { at = [0, 0, -0.1], normal = [0, 0, -1] } } }
interface.foot = { surface = "foot" }
[component.anvil]
geometry = { kind = "rigid", mass = 6.0, points = { top = { at = [0, 0, 0.1], normal = [0, 0, 1] } } }
interface.top = { surface = "top" }
[body.ball]
position = [0, 0, 0.2001]
velocity = [0, 0, -0.5]
[body.anvil]
[contact.pair]
body = "ball"
interface = "foot"
against = { shape = "body", body = "anvil", interface = "top" }
"""


def balls(tmp_path: Path, contact: str, run: str = "", duration: float = 2e-3) -> Job:
    """Return two rigid bodies of 2 and 6 kg, a tenth of a millimetre apart."""
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / "scene.toml").write_text(f"{BALL}{contact}\n[run]\nduration = {duration}\n{run}")
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    run_job(job, "morph")
    return job


@pytest.mark.parametrize(
    ("law", "restitution", "accuracy"),
    [
        ('law = { kind = "hertz", stiffness = 1e10 }', 1.0, 1e-9),
        ('law = { kind = "exact", stiffness = 1e10, restitution = 0.7 }', 0.7, 1e-4),
        ('law = { kind = "linear", stiffness = 1e8 }', 1.0, 1e-9),
        ("surface_stiffness = 1e8", 1.0, 1e-9),
    ],
)
def test_laws_deliver_their_restitution(law: str, restitution: float, accuracy: float, tmp_path: Path) -> None:
    run = simulate_nodal(nodal_problem(balls(tmp_path, f'method = "penalty"\n{law}')), 1e-6)
    assert value(run, "pair.restitution") == pytest.approx(restitution, rel=accuracy)
    assert value(run, "energy_lost") == pytest.approx(0.1875 * (1 - restitution**2), abs=1e-4 * 0.1875)
    assert value(run, "pair.start") == pytest.approx(2e-4, rel=1e-3)
    assert run.energy_drift < ENERGY


def test_rigid_bodies_that_meet_rigidly_go_on_together(tmp_path: Path) -> None:
    run = simulate_nodal(nodal_problem(balls(tmp_path, 'method = "constraint"')), 1e-5)
    assert value(run, "ball.velocity_z") == pytest.approx(-0.125, rel=1e-12)
    assert value(run, "anvil.velocity_z") == pytest.approx(-0.125, rel=1e-12)
    assert value(run, "energy_lost") == pytest.approx(0.1875, rel=1e-9)
    assert run.energy_drift < ENERGY


def test_gravity_lets_a_ball_fall(tmp_path: Path) -> None:
    pulled = "gravity = [0, 0, -1000.0]"
    job = balls(tmp_path, 'method = "penalty"\nlaw = { kind = "hertz", stiffness = 1e10 }', pulled, 1e-3)
    run = simulate_nodal(nodal_problem(job), 1e-6)
    for name, start, mass in (("ball", -0.5, 2.0), ("anvil", 0.0, 6.0)):
        pushed = value(run, "pair.impulse") / mass * (1 if name == "ball" else -1)
        assert value(run, f"{name}.velocity_z") == pytest.approx(start - 1.0 + pushed, rel=1e-9)
    assert "pair.restitution" not in run.quantities
    assert run.energy_drift < ENERGY


def test_a_held_beam_starts_bent_by_its_weight_and_stays_so(tmp_path: Path) -> None:
    heavy = {"run.gravity": [0, 0, -9.81], "body.ball.position": [0.1535, 0, 0.125], "body.ball.velocity": [0, 0, 0]}
    coarse = {"component.beam.mesh.size": 0.03, "component.beam.modes.normal_count": 4}
    job = job_of("beam-sphere", tmp_path, coarse | heavy)
    problem = nodal_problem(job)
    assert isinstance(problem, PointProblem)
    sag, row = problem.bodies[1].displacement, problem.contacts["pair"].rows[1]
    assert sag is not None
    assert row is not None
    middle = 5 * 7960 * 1e-4 * 9.81 * 0.307**4 / 384 / (215746300000.0 * 1e-8 / 12)
    assert (row @ sag)[0] == pytest.approx(middle, rel=1e-6)
    run = simulate_nodal(problem, 1e-5)
    assert np.ptp(run.energies[:, 1]) < 1e-9 * run.energies[0, 1]


def test_a_beam_that_gravity_presses_on_a_ball_may_start_undeformed_only(tmp_path: Path) -> None:
    pressed = {"run.gravity": [0, 0, 9.81], "body.ball.velocity": [0, 0, 0]}
    message = r"report.full_fe: contact.pair: points start with a penetration of .*, deformed by gravity; .* run.start"
    with pytest.raises(InputError, match=message):
        nodal_problem(job_of("beam-sphere", tmp_path, pressed))
    problem = nodal_problem(job_of("beam-sphere", tmp_path, pressed | {"run.start": "undeformed"}))
    assert all(body.displacement is None for body in problem.bodies)


def test_the_two_loops_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changes = {"component.beam.mesh.size": 0.02, "component.beam.modes.normal_count": 4, "run.duration": 1e-3}
    damped = nodal_problem(job_of("beam-sphere", tmp_path, changes))
    assert isinstance(damped, PointProblem)
    damped = replace(damped, bodies=tuple(replace(body, damping=1e-7) for body in damped.bodies))
    compiled = simulate_nodal(damped, 2e-6)
    monkeypatch.setattr(meeting, "is_narrow", lambda body: False)
    factored = simulate_nodal(damped, 2e-6)
    scale = np.abs(compiled.force).max()
    assert scale > 5
    np.testing.assert_allclose(factored.force, compiled.force, atol=1e-7 * scale)
    np.testing.assert_allclose(factored.energies, compiled.energies, atol=1e-8 * compiled.energies[0, 0])
    for name in ("pair.impulse", "ball.velocity_z", "energy_lost"):
        assert value(factored, name) == pytest.approx(value(compiled, name), rel=1e-6)
    assert value(compiled, "energy_lost") > 1e-9
    assert max(compiled.energy_drift, factored.energy_drift) < ENERGY


def test_what_a_body_may_not_do_is_left_out(tmp_path: Path) -> None:
    """A symmetric impact turns neither beam, so that it is the same where the upper one may not turn."""
    coarse = {f"component.{n}.mesh.size": 0.05 for n in ("upper", "lower")}
    coarse |= {f"component.{n}.modes.substructures": 1 for n in ("upper", "lower")}
    coarse |= {f"component.{n}.modes.fixed_count": 4 for n in ("upper", "lower")} | {"run.duration": 5e-4}
    free = simulate_nodal(nodal_problem(job_of("bars-transverse", tmp_path, coarse)), 2e-6)
    guided = nodal_problem(job_of("bars-transverse", tmp_path, coarse | {"body.upper.freedom": ["z"]}))
    assert isinstance(guided, PointProblem)
    assert guided.bodies[0].suppressed is not None
    held = simulate_nodal(guided, 2e-6)
    assert free.force[:, 2].max() > 1000
    np.testing.assert_allclose(held.force, free.force, atol=1e-6 * free.force[:, 2].max())
    assert value(held, "upper.velocity_z") == pytest.approx(value(free, "upper.velocity_z"), rel=1e-6)
    assert max(held.energy_drift, free.energy_drift) < ENERGY


def test_motions_may_come_in_any_basis() -> None:
    model = block((0.02, 0.02, 0.01), (1, 1, 1))
    turned = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0] @ model.rigid_twists
    momentum = np.arange(1.0, 7.0) * 1e-3
    for twists in (model.rigid_twists, turned):
        body, _ = supported_body("block", model, twists, momentum, damping=0.0, field=np.zeros(3))
        assert body.velocity is not None
        after, _, before = body.centre_motion(np.array([np.zeros_like(body.velocity), body.velocity]))
        np.testing.assert_allclose(after[:3], momentum[:3] / model.properties.mass, rtol=1e-9)
        np.testing.assert_allclose(model.properties.inertia @ after[3:], momentum[3:], rtol=1e-6)
        np.testing.assert_allclose(before, after)


def faces(upper: FEModel, lower: FEModel, gap: float) -> PointProblem:
    """Return two blocks that meet face on face at the nodes of their mid-sides, at 0.1 m/s."""
    high, low = on_plane(upper, 2, 0.0), on_plane(lower, 2, 0.01)
    order = [
        int(np.linalg.norm(lower.nodes[low][:, :2] - place, axis=1).argmin()) for place in upper.nodes[high][:, :2]
    ]
    up = np.tile([0.0, 0.0, 1.0], (len(high), 1))
    speeds = np.array([0.0, 0.0, -0.1, 0.0, 0.0, 0.0]) * upper.properties.mass
    none, still = np.zeros(3), np.zeros(6)
    one, first = supported_body("one", upper, upper.rigid_twists, speeds, damping=0.0, field=none)
    two, second = supported_body("two", lower, lower.rigid_twists, still, damping=0.0, field=none)
    rows = upper.rows(high, up) @ first, -lower.rows(low[order], up) @ second
    contact = PointContact((sparse.csr_matrix(rows[0]), sparse.csr_matrix(rows[1])), np.full(len(high), gap), up, 0, 1)
    return PointProblem((one, two), {"face": contact}, 4e-5, True)


def test_solids_meet_rigidly_at_many_points() -> None:
    upper = block((0.02, 0.02, 0.01), (2, 2, 1))
    problem = faces(upper, upper, 1e-9)
    assert not any(narrow.is_narrow(body) for body in problem.bodies)
    run = simulate_nodal(problem, 1e-7)
    fine = block((0.02, 0.02, 0.01), (3, 3, 2))
    finer = simulate_nodal(faces(fine, fine, 1e-9), 1e-7)
    assert 0 < value(finer, "energy_lost") < 0.8 * value(run, "energy_lost") < 0.06 * total(run)[0]
    assert np.diff(total(run)).max() < ENERGY * total(run)[0]
    assert run.energy_drift < ENERGY
    assert run.force[:, 2].min() >= 0
    mass = upper.properties.mass
    assert mass * value(run, "two.velocity_z") == pytest.approx(-value(run, "face.impulse"), rel=1e-9)
    face = problem.contacts["face"]
    stiff = replace(face, law=np.tile([1e10, 1.0, 0.0, 0.0], (len(face.gap), 1)))
    pressed = simulate_nodal(replace(problem, contacts={"face": stiff}), 1e-7)
    assert value(run, "face.impulse") == pytest.approx(value(pressed, "face.impulse"), rel=0.05)


def test_rigid_contact_never_gives_energy() -> None:
    """Of single steps from any gaps and rates, also of points that part while they are still pressed."""
    rng, pressed, parting = np.random.default_rng(3), 0, 0
    nothing = PointContact((), np.zeros(4), np.zeros((4, 3)), 0)
    for _ in range(300):
        root = rng.standard_normal((4, 6))
        now = new_press([nothing], root @ root.T, np.zeros(4), 0.5)
        for _ in range(4):
            gap, rate, free = 0.3 * rng.standard_normal((3, 4))
            assert press(now, gap, rate, free)
            force = now.force
            end = free + now.W @ force
            speed = 2 * (end - gap) / 0.5 - rate
            assert force.min() >= 0
            assert (force * (end - gap)).max() < 1e-12
            assert np.abs((speed + np.maximum(rate, 0))[force > 0]).max(initial=0.0) < 1e-11
            pressed, parting = pressed + int((force > 0).sum()), parting + int(((force > 0) & (rate > 0)).sum())
    assert pressed > 500
    assert parting > 100


def test_a_force_that_is_not_found_stops_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = nodal_problem(balls(tmp_path, 'method = "constraint"'))
    monkeypatch.setattr(meeting, "march", lambda *given: 0)
    with pytest.raises(StageError, match="no contact force was found in step 1 of 1e-05 s"):
        simulate_nodal(problem, 1e-5)


@pytest.mark.parametrize(("scene", "body", "width"), [("rod-wall", 0, 2), ("beam-sphere", 1, 3), ("beam-sphere", 0, 0)])
def test_line_meshes_are_narrow(scene: str, body: int, width: int, tmp_path: Path) -> None:
    changes = {"component.beam.modes.normal_count": 4} if scene == "beam-sphere" else {}
    problem = nodal_problem(job_of(scene, tmp_path, changes))
    assert isinstance(problem, PointProblem)
    part: NodalBody = problem.bodies[body]
    assert narrow.bandwidth(part) == width
    size = part.K.shape[0]
    band = narrow.new_band(part, sparse.csr_matrix(np.eye(size)[:1]), 1e-6)
    S = (part.M + 2.5e-13 * part.K).toarray()
    load = np.random.default_rng(0).standard_normal(size)
    found = load.copy()
    core.points.solve_band(band, found)
    np.testing.assert_allclose(S @ found, load, atol=1e-9)


def test_wide_bands_are_solved_too() -> None:
    rng, n = np.random.default_rng(1), 40
    band = np.triu(np.tril(rng.standard_normal((n, n)), 7), -7)
    M = sparse.csr_matrix(band @ band.T + 20 * np.eye(n))
    body = NodalBody("wide", sparse.csr_matrix((n, n)), M)
    assert narrow.is_narrow(body)
    made = narrow.new_band(body, sparse.csr_matrix((1, n)), 1.0)
    load = rng.standard_normal(n)
    found = load.copy()
    core.points.solve_band(made, found)
    np.testing.assert_allclose(M.toarray() @ found, load, atol=1e-10)


UP = np.array([[0.0, 0.0, 1.0]])
"""Direction of the force on the only point."""


def test_impacts_are_located_between_steps() -> None:
    times, h = np.arange(9) * 0.1, 0.1
    gap = np.array([0.25, 0.15, 0.05, -0.05, -0.15, -0.05, 0.05, 0.15, 0.25])
    force = np.array([0.0, 0, 1, 3, 3, 1, 0, 0])
    history = History(times, force[:, None], gap[:, None], np.array([-1.0]))
    (impact,) = located(history, UP, (0.2, 0.2), rigid=False)
    np.testing.assert_allclose(impact, [0.25, 0.55, 0.8, 3.0, 0.35, 1.0, 1.0, 0.75 * 3 + 0.25, 0.4])
    closed = np.array([0.15, 0.05, 0.01, 0.01, 0.01, 0.01, 0.01, 0.04, 0.07])
    force = np.array([0.0, 1, 2, 2, 2, 1, 0, 0])
    history = History(times, force[:, None], closed[:, None], np.array([-1.0]))
    (impact,) = located(history, UP, (0.3, 0.3), rigid=True)
    np.testing.assert_allclose(impact, [0.1 + 0.05, 0.6, 8 * h, 2.0, 0.25, 1.0, 0.3, 0.75 * 2 + 2 / 9, 0.35])


def test_rigid_impacts_part_within_what_steps_resolve() -> None:
    """A thousand steps carry periods of 27.4 steps and more: (1000 / 12)^⅓ radians, 2π of them."""
    force, still = np.zeros(1000), np.zeros((3, 6))
    force[[*range(100, 140), *range(160, 200), *range(240, 280)]] = 2.0
    history = History(np.arange(1001.0), force[:, None], np.zeros((1001, 1)), np.zeros(1))
    contact = PointContact((None,), np.zeros(1), np.array([[0.0, 0.0, 1.0]]), 0)
    resultant = history.forces @ contact.directions
    separation, window = windows_of(None, history.times, contact, True, resultant)
    rigid = contact_quantities(history, contact, (still, None), (separation, window))
    assert separation == resolved(history.times) == pytest.approx(27.44, abs=0.01)
    assert window == pytest.approx(0.1 * (200 - 100))  # A tenth of the first of two impacts of equal force.
    assert [rigid[name][0] for name in ("impacts", "impact1.end", "impact2.start")] == [2, 200, 240]
    assert rigid["force_window"] == (window, "s")
    lawful = replace(contact, law=np.array([[1.0, 1.5, 0.0, 0.0]]))
    windows = windows_of(None, history.times, lawful, True, resultant)
    assert contact_quantities(history, lawful, (still, None), windows)["impacts"][0] == 3
    assert windows_of(None, history.times, contact, False, resultant) == (0, 0)
    assert windows_of(3.0, history.times, contact, True, resultant) == (3.0, 3.0)


@pytest.mark.parametrize(
    ("contact", "extra", "message"),
    [
        (
            'method = "impact"\nrestitution = 0.5',
            "",
            r"contact\.pair\.method: 'impact' given, allowed: residual, penalty, constraint",
        ),
        (
            'method = "constraint"\nfriction = { static = 0.2, direction = [1, 0, 0] }',
            "",
            r"contact\.pair\.friction: friction is not supported; remove it",
        ),
        (
            'method = "penalty"\nlaw = { kind = "hertz", stiffness = 1e8 }',
            '[force.leg]\nkind = "spring"\nbody = "anvil"\ndirection = [0, 0, 1]\nstiffness = 1e4',
            r"springs are not supported; remove force\.leg",
        ),
        (
            'method = "penalty"\nlaw = { kind = "linear", stiffness = 1e8 }\n[contact.floor]\nbody = "anvil"\n'
            'interface = "top"\nmethod = "constraint"\n'
            'against = { shape = "plane", point = [0, 0, 1], normal = [0, 0, -1] }',
            "",
            r"contacts with a law or a layer cannot be combined with rigid contacts",
        ),
        (
            'method = "penalty"\nlaw = { kind = "linear", stiffness = 1e8 }\n[contact.floor]\nbody = "anvil"\n'
            'interface = "top"\nmethod = "penalty"\nlaw = { kind = "linear", stiffness = 1e8 }\n'
            'against = { shape = "plane", point = [0, 0, 0], normal = [0, 0, -1] }',
            "",
            r"contact\.floor: points start with a penetration of 0\.1 m",
        ),
    ],
    ids=["impact", "friction", "spring", "mixed", "inside"],
)
def test_what_is_not_carried_is_refused(contact: str, extra: str, message: str, tmp_path: Path) -> None:
    job = balls(tmp_path, contact, extra)
    with pytest.raises(InputError, match=message):
        nodal_problem(job)


def test_a_scene_without_contact_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(BALL[: BALL.index("[contact.pair]")] + "[run]\nduration = 1e-3\n")
    job = open_job(tmp_path, db=tmp_path / "db", out=tmp_path / "out")
    with pytest.raises(InputError, match=r"report\.full_fe: the scene has no contact and no moving force; needed: one"):
        nodal_problem(job)


def test_what_slides_needs_layers(tmp_path: Path) -> None:
    unset = {"contact.thrust.surface_stiffness": "unset"}
    job = open_job(scene_path("piston/coarse.toml"), set=unset, db=tmp_path / "db", out=tmp_path / "out")
    with pytest.raises(
        InputError, match=r"contact\.thrust: with sliding points or a joint, a contact needs surface_stiffness"
    ):
        nodal_problem(job)
