"""A force that travels over a traction space: exact where it stands still, second order where it moves."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from gudgeon.modaldb.records.modes import ModalRecord, TractionModes
from gudgeon.modaldb.records.traction import spline_weights
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces import MovingForce
from gudgeon.solver.linear.load_stiffness import with_load_stiffness
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build, march, plate_records

FORCE, START, SPEED, DURATION = 40.0, -0.1, 50.0, 2e-3


def scene(*, speed: float = SPEED, duration: float = DURATION, **change: Any) -> dict[str, Any]:
    load = {"kind": "moving", "body": "part", "interface": "top", "force": FORCE, "at": [0.01, START], "speed": speed}
    return {
        "body": {"part": {}},
        "force": {"load": load | change},
        "run": {"duration": duration, "samples": 100, "frames": 100},
    }


def push(record: ModalRecord, x: np.ndarray) -> np.ndarray:
    """Return the modal forces of the load at places x along, (x, m)."""
    return -FORCE * weights(record.tractions["top"], x) @ record.tractions["top"].rows


def weights(space: TractionModes, x: np.ndarray) -> np.ndarray:
    """Return N as a matrix, (x, F)."""
    numbers, values = spline_weights(space, np.column_stack([np.full(len(x), 0.01), x]))
    found = np.zeros((len(x), len(space.rows)))
    np.put_along_axis(found, numbers, values, axis=1)
    return found


def test_sudden_force_that_stands_still_is_exact(tmp_path: Path) -> None:
    """q = F φ (1 − cos ωt)/ω², and what the modes lack yields at once."""
    records = plate_records()
    done = simulate(build(tmp_path, records, scene(speed=0.0)))
    modal = records[0]
    f, omega = push(modal, np.array([START]))[0], modal.angular_frequencies
    exact = f * (1 - np.cos(np.outer(done.frame_times, omega))) / omega**2
    np.testing.assert_allclose(done.frames, exact, atol=1e-10 * np.abs(exact).max())
    N, R = weights(modal.tractions["top"], np.array([START]))[0], modal.residual_flexibility
    assert R is not None
    under = exact @ f / FORCE + FORCE * N @ R @ N
    found = {key: entry["value"] for key, entry in done.quantities.items()}
    assert found["load.deflection_end"] == pytest.approx(under[-1], rel=1e-9)
    assert found["load.deflection_peak"] == pytest.approx(under.max(), rel=1e-9)
    assert found["load.peak_time"] == pytest.approx(done.frame_times[under.argmax()], rel=1e-12)
    assert done.energy_drift < 1e-10
    assert done.energies[-1, 4] > 0


def test_travelling_force_is_second_order(tmp_path: Path) -> None:
    records = plate_records()
    modal, system = records[0], build(tmp_path, records, scene())
    omega = modal.angular_frequencies

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        q, v = np.split(state, 2)
        return np.concatenate([v, push(modal, np.array([START + SPEED * t]))[0] - omega**2 * q])

    span = (0.0, DURATION)
    exact = solve_ivp(rate, span, np.zeros(2 * len(omega)), method="DOP853", rtol=1e-12, atol=1e-20).y[: len(omega), -1]
    steps = np.array([160, 320, 640, 1280])
    errors = [np.abs(march(system, DURATION / n, int(n)).run.modes.q - exact).max() for n in steps]
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.2)


def test_force_that_comes_up_smoothly(tmp_path: Path) -> None:
    """Half a cosine: its impulse over the rise is half of that of the whole force, and what it bends follows slowly."""
    rise = 0.25 * DURATION
    records = plate_records(free=True)
    done = simulate(build(tmp_path / "smooth", records, scene(rise=rise)))
    assert done.motion["part"][-1, 6] == pytest.approx(FORCE * (DURATION - rise / 2) / 3, rel=1e-6)
    sudden = simulate(build(tmp_path / "sudden", records, scene()))
    assert abs(done.frames[0]).max() < 0.01 * abs(sudden.frames[0]).max()
    assert done.energy_drift < 1e-9


def test_momentum_of_a_free_body(tmp_path: Path) -> None:
    done = simulate(build(tmp_path, plate_records(free=True), scene()))
    assert done.momentum_residual < 1e-12
    # A centre of 3 kg after 40 N for 2 ms, inwards along +x.
    assert done.motion["part"][-1, 6] == pytest.approx(FORCE * DURATION / 3, rel=1e-9)
    assert done.energy_drift < 1e-9


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"interface": "side"}, r"^force\.load\.interface: body 'part' has no traction space 'side', it has none$"),
        ({"at": [0.2, 0.0]}, r"^force\.load: it moves from \[0\.2, 0\.0\] to \[0\.2, 0\.1\] m across and along by run"),
        (
            {"speed": 500.0},
            r"^force\.load: it moves from .*reaches from \[-0\.06, -0\.15\] to \[0\.06, 0\.15\]; change",
        ),
    ],
)
def test_force_beside_its_surface_is_refused(tmp_path: Path, change: dict[str, Any], text: str) -> None:
    with pytest.raises(SceneError, match=text):
        build(tmp_path, plate_records(), scene(**change))


def test_path_may_end_at_the_edge(tmp_path: Path) -> None:
    """Round-off of speed × duration is no way out."""
    build(tmp_path, plate_records(), scene(at=[0.0, -0.15], speed=0.3 / 0.7, duration=0.7))


def test_scene_names_what_is_wrong() -> None:
    with pytest.raises(ValidationError, match="finite number"):
        MovingForce(kind="moving", body="part", interface="top", force=float("nan"), at=(0.0, 0.0))
    wrong = scene()
    wrong["force"]["load"]["body"] = "beam"
    with pytest.raises(ValidationError, match=r"force\.load\.body: no body 'beam'"):
        Scene.model_validate(wrong)
    with pytest.raises(ValidationError, match=r"'event' does not support force\.load"):
        Scene.model_validate(scene() | {"run": {"duration": 1e-3, "integrator": "event"}})


@pytest.mark.parametrize(("force", "said"), [(FORCE, False), (1e9, True), (1e9, None)])
def test_a_force_that_may_soften_its_body_is_said(force: float, said: bool | None, tmp_path: Path) -> None:
    """The stiffness of loads is left out beside moving forces: a line names the key, unless it is false."""
    system, notes = build(tmp_path, plate_records(), scene(force=force)), list[str]()
    if said is None:
        body = system.scene.body["part"].model_copy(update={"geometric_stiffness": False})
        system = replace(system, scene=system.scene.model_copy(update={"body": {"part": body}}))
    assert with_load_stiffness(system, notes) is system
    named = [
        note for note in notes if note.startswith("body.part.geometric_stiffness: the stress of weight, loads and")
    ]
    assert len(named) == int(said is True)
