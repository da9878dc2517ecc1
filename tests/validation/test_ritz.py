"""A force that travels over a cantilever, against beam theory.

Bernoulli-Euler: w = Σ φᵢ(x) qᵢ, q̈ᵢ + ωᵢ² qᵢ = F(t) φᵢ(vt), φᵢ the clamped-free eigenfunctions of unit mass (Frýba,
Vibration of Solids and Structures under Moving Loads, for the method). The scene's beam made slender, 0.02 m of 0.4 m
high, so that shear is 0.2 % of the deflection at the tip. The footprint is cut where the surface ends, which moves the
force's middle by 0.5 mm (0.4 %) from the tip, and the clamp holds the contraction across, which stiffens a wide beam
near it.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gudgeon.pipeline.kinds import run
from tests.scenes import scene_path

LENGTH, WIDTH, HEIGHT, E, RHO = 0.4, 0.04, 0.02, 210e9, 7850.0
FORCE, SPEED, RISE, DURATION = 1e3, 100.0, 3e-4, 0.00375
AREA, INERTIA = WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12
MODES = 8
THEORY = 0.008
"""What shear, footprint and clamp make of the deflection, see above."""


def eigenfunctions() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return β L, σ and ω [rad/s] of the clamped-free beam, (MODES,) each."""
    roots = np.array([brentq(lambda b: np.cos(b) + 1 / np.cosh(b), np.pi * i, np.pi * (i + 1)) for i in range(MODES)])
    sigma = (np.cosh(roots) + np.cos(roots)) / (np.sinh(roots) + np.sin(roots))
    return roots, sigma, (roots / LENGTH) ** 2 * np.sqrt(E * INERTIA / (RHO * AREA))


def shapes(x: np.ndarray) -> np.ndarray:
    """Return the mass-normalised eigenfunctions at places x from the clamp [m], (x, MODES)."""
    roots, sigma, _ = eigenfunctions()
    s = np.multiply.outer(np.asarray(x), roots / LENGTH)
    return (np.cosh(s) - np.cos(s) - sigma * (np.sinh(s) - np.sin(s))) / np.sqrt(RHO * AREA * LENGTH)


def travelling(times: np.ndarray) -> np.ndarray:
    """Return the deflection under the force [m], (t,)."""
    omega = eigenfunctions()[2]

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        q, v = np.split(state, 2)
        force = FORCE * 0.5 * (1 - np.cos(np.pi * min(t / RISE, 1.0)))
        return np.concatenate([v, force * shapes(np.array(SPEED * t)) - omega**2 * q])

    found = solve_ivp(rate, (0.0, times[-1]), np.zeros(2 * MODES), t_eval=times, rtol=1e-9, atol=1e-14, max_step=2e-5)
    return np.einsum("tm,mt->t", shapes(SPEED * times), found.y[:MODES])


def test_eigenfunctions() -> None:
    """The first root, and FL³/3EI at the tip to what eight modes give of it."""
    roots, _, omega = eigenfunctions()
    assert roots[0] == pytest.approx(1.8751040687, rel=1e-9)
    tip = shapes(np.array(LENGTH))
    np.testing.assert_allclose(tip**2 * RHO * AREA * LENGTH, 4.0, rtol=1e-4)
    assert (tip**2 / omega**2).sum() == pytest.approx(LENGTH**3 / (3 * E * INERTIA), rel=1e-4)


def test_travelling_force(tmp_path: Path) -> None:
    changes = {
        "component.beam.geometry.lz": HEIGHT, "component.beam.mesh.size": 0.02, "force.load.force": FORCE,
        "component.beam.interface.top.spacing": [0.02, 0.0125], "run.duration": DURATION, "run.frames": 300,
        "force.load.speed": SPEED, "force.load.rise": RISE,
    }  # fmt: skip
    report = run(scene_path("ritz"), set=changes, db=tmp_path / "db", out=tmp_path / "out", until="solve")
    times = np.linspace(DURATION / 300, DURATION, 300)
    exact = travelling(times)
    found = report.quantities
    assert report.result == "FINISHED"
    assert found["load.deflection_peak"]["value"] == pytest.approx(exact.max(), rel=THEORY)
    assert found["load.deflection_end"]["value"] == pytest.approx(exact[-1], rel=THEORY)
    assert found["load.peak_time"]["value"] == pytest.approx(times[exact.argmax()], abs=2 * times[0])
    # Dynamics is what is tested: nowhere near what stands still deflects.
    still = FORCE * (SPEED * times) ** 3 / (3 * E * INERTIA)
    assert np.abs(exact - still).max() > 5 * THEORY * exact.max()
