"""A system stepped by its caller: the same motion as a run, forces set between steps, checkpoints."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.errors import SolverError
from gudgeon.solver.simulate import simulate
from gudgeon.solver.simulation import Steps
from gudgeon.solver.system.system import System
from tests.solver.features import DURATION, STEP, store_of, system_of
from tests.solver.systems import (
    block_records,
    block_scene,
    build,
    build_all,
    piston_records,
    piston_scene,
    rigid_records,
    rod_records,
    rod_scene,
    with_tangential_rows,
)

BALL = {"pole": ([0.0, 0.0, -0.1], [0.0, 0.0, -1.0])}


def bounces(**more: Any) -> dict[str, Any]:
    """A ball above a floor with restitution, with a force that its caller sets."""
    floor = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    return {
        "body": {"part": {"position": [0, 0, 0.3]}},
        "contact": {"floor": {"body": "part", "interface": "pole", "against": floor, "method": "impact",
                              "restitution": 0.5}},
        "force": {"hand": {"kind": "external", "body": "part", "direction": [0, 0, 1]}},
        "run": {"duration": 1.0, "gravity": [0, 0, -9.81], "step": 1e-3, "integrator": "small", "checks": False},
    } | more  # fmt: skip


def same(one: Any, other: Any) -> bool:
    """Whether two arrays, or tuples of arrays, are equal."""
    if isinstance(one, tuple):
        return all(same(*pair) for pair in zip(one, other, strict=True))
    return np.array_equal(one, other)


def test_single_steps_are_those_of_a_run(tmp_path: Path) -> None:
    scene = rod_scene()
    scene["run"] = scene["run"] | {"step": 1e-7, "integrator": "small", "checks": False}
    scene["contact"]["wall"] |= {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e9}}
    system = build(tmp_path, rod_records(20), scene)
    assert system.scene.loop == "small"
    found = simulate(system)
    steps = Steps(system, found.counts["step"])
    for _ in range(found.counts["steps"]):
        steps.step()
    assert np.array_equal(steps.body("part").elastic, found.frames[-1][system.bodies["part"].elastic])
    assert steps.time == pytest.approx(6e-4, rel=1e-12)
    assert list(steps.energies.values()) == found.energies[-1].tolist()


def test_force_of_the_caller_holds_a_weight(tmp_path: Path) -> None:
    system = build(tmp_path, rigid_records(2.0, BALL), bounces())
    steps = Steps(system)
    steps.force("hand")[:] = 2.0 * 9.81
    steps.step(until=0.5)
    assert steps.steps == 500
    assert steps.body("part").displacement == pytest.approx(np.zeros(3), abs=1e-12)
    steps.apply("hand", 2.0 * 9.81 + 3.0)
    steps.step(100)
    assert steps.body("part").velocity[2] == pytest.approx(1.5 * 0.1, rel=1e-9)
    assert steps.contact("floor").displacement[0] == pytest.approx(0.2 + 0.5 * 1.5 * 0.01, rel=1e-9)
    assert steps.energies["work"] == pytest.approx(steps.energies["kinetic"], rel=1e-9)


def test_without_its_caller_an_external_force_is_zero(tmp_path: Path) -> None:
    found = simulate(build(tmp_path, rigid_records(2.0, BALL), bounces()))
    alone = {key: value for key, value in bounces().items() if key != "force"}
    free = simulate(build(tmp_path / "alone", rigid_records(2.0, BALL), alone))
    assert np.array_equal(found.frames, free.frames)


def test_checkpoint_continues_with_the_same_bits(tmp_path: Path) -> None:
    """Through impacts, with a force that is set, by another object of the same system."""
    system = build(tmp_path, rigid_records(2.0, BALL), bounces())
    one = Steps(system)
    one.apply("hand", 0.7)
    one.step(230)
    held = one.checkpoint()
    one.step(700)
    other = Steps(system)
    other.load(held)
    assert other.time == 230 * other.dt
    for _ in range(7):
        other.step(100)
    for name in one._state._fields:
        assert same(getattr(one._state, name), getattr(other._state, name)), name
    assert one.body("part").velocity[2] != 0
    with pytest.raises(SolverError, match="of another scene, release or step"):
        Steps(system, 5e-4).load(held)
    with pytest.raises(SolverError, match="checkpoint: it cannot be read"):
        other.load(held[:100])


def test_names_that_do_not_exist_are_refused(tmp_path: Path) -> None:
    steps = Steps(build(tmp_path, rigid_records(2.0, BALL), bounces()))
    with pytest.raises(SolverError, match=r"force 'hnd' is unknown, did you mean 'hand'\?"):
        steps.force("hnd")
    with pytest.raises(SolverError, match=r"port 'contact.flor' is unknown, did you mean 'contact.floor'\?"):
        steps.port("contact.flor")
    with pytest.raises(SolverError, match="body 'ball' is unknown, the scene has part"):
        steps.body("ball")
    steps.step(10)
    with pytest.raises(SolverError, match=r"until 0 s: the time is 0\.01 s already"):
        steps.step(until=0.0)


def test_external_force_acts_on_an_elastic_interface(tmp_path: Path) -> None:
    """The energy that it brings is all there is: it rises slowly, since R has no mass that a jump would move."""
    scene = {
        "body": {"part": {}}, "force": {"push": {"kind": "external", "body": "part", "interface": "pin"}},
        "run": {"duration": 1e-3, "step": 1e-6},
    }  # fmt: skip
    steps = Steps(build(tmp_path, piston_records(6), scene))
    for share in np.linspace(0.001, 1.0, 1000):
        steps.apply("push", np.array([0.0, 0.0, 400.0 * share]))
        steps.step()
    energies = steps.energies
    assert energies["work"] > 0
    assert energies["kinetic"] + energies["strain"] == pytest.approx(energies["work"], rel=1e-5)
    mass = 0.5
    assert steps.body("part").velocity[2] == pytest.approx(400.0 / mass * 0.5005e-3, rel=1e-9)


def rubbing(folder: Path) -> System:
    """An elastic block that rubs on a wall at 40 points."""
    scene = block_scene(friction={"static": 0.4, "kinetic": 0.3}, surface_stiffness=1e13)
    modal, morph = block_records(40)
    scene["body"]["part"]["velocity"] = [1.0, 0.3, 0.1]
    scene["run"] |= {"step": 5e-7, "integrator": "small", "checks": False}
    return build(folder, (with_tangential_rows(modal, "face"), morph), scene)


def cranked(folder: Path) -> System:
    """An elastic piston on a crank, with friction on one of its walls and springs at its pin."""
    scene = piston_scene(clearance=1e-5, step=2e-6, duration=2e-3, integrator="small", checks=False)
    scene["force"] |= {
        "line": {"kind": "spring", "body": "part", "interface": "pin", "direction": [1, 0, 0], "damping": 30.0,
                 "values": [[-1e-3, -10.0], [0.0, 0.0], [1e-3, 900.0]]},
        "bush": {"kind": "bushing", "body": "part", "interface": "pin", "stiffness": [1e5, 2e5, 1e3],
                 "damping": [5.0, 5.0, 5.0]},
    }  # fmt: skip
    scene["contact"]["right"] |= {"method": "penalty", "law": {"kind": "hertz", "stiffness": 1e10}}
    del scene["contact"]["right"]["surface_stiffness"]
    return build(folder, piston_records(6), scene)


def driven(folder: Path) -> System:
    """A ball on a shaker, with restitution and friction."""
    up = {"top": ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), "bottom": ([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])}
    pair = {"shape": "body", "body": "table", "interface": "top"}
    return build_all(folder, {"table": rigid_records(2.0, up), "ball": rigid_records(0.1, up)}, {
        "body": {"table": {"freedom": ["z", "x"]}, "ball": {"velocity": [0.05, 0, 0], "position": [0, 0, 1e-4]}},
        "contact": {"touch": {"body": "ball", "interface": "bottom", "against": pair, "method": "impact",
                              "restitution": 0.4, "friction": {"static": 0.2, "kinetic": 0.1}}},
        "motion": {"up": {"kind": "translation", "body": "table", "direction": [0, 0, 1],
                          "expression": "1e-3*sin(150*t)"},
                   "aside": {"kind": "translation", "body": "table", "direction": [1, 0, 0],
                             "values": [[0, 0], [0.1, 1e-4], [0.2, 0], [3.0, 0]]}},
        "run": {"duration": 1.0, "gravity": [0, 0, -9.81], "step": 1e-4, "integrator": "small", "checks": False},
    })  # fmt: skip


@pytest.mark.parametrize("made", [rubbing, cranked, driven])
def test_checkpoint_of_every_kind_of_port_continues_with_the_same_bits(
    made: Callable[[Path], System], tmp_path: Path
) -> None:
    """Friction on an elastic body, joints, tables and bushings with dashpots, laws, drives; in new objects."""
    system = made(tmp_path)
    one = Steps(system)
    one.step(60)
    held = one.checkpoint()
    for _ in range(5):
        one.step(50)
    other = Steps(made(tmp_path / "again"))
    other.load(held)
    other.step(250)
    for name in set(one._state._fields) - {"slips"}:  # A log that every call empties; its rows are not cleared.
        assert same(getattr(one._state, name), getattr(other._state, name)), name
    assert one._state.impulses.any()


@pytest.mark.parametrize("names", [("force", "gauges"), ("motion", "gauges"), ("joint", "gas", "gauges")], ids="+".join)
def test_what_a_scene_gives_over_time_is_evaluated_for_many_steps_at_once(
    names: tuple[str, ...], tmp_path: Path
) -> None:
    """With the same bits as in one call, from any step on; no time beyond the run is asked for."""
    store, asked = store_of(tmp_path), list[int]()
    system = system_of(store, names)
    whole = type(system.driving).loads

    def counting(driving: Any, start: np.ndarray, dt: float) -> np.ndarray:
        asked.append(len(start))
        assert start.max() < DURATION * (1 + 1e-9)
        return whole(driving, start, dt)

    one, other = Steps(system, STEP), Steps(system, STEP)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(system.driving), "loads", counting)
        for _ in range(600):
            one.step()
        assert asked == [256, 256] * 3
        while one.steps < 1000:
            one.step()
        assert sum(asked) == 2 * 1000
    other.step(37)
    other.step(700)
    other.step(263)
    assert same(one._state, other._state)
