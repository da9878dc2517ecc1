"""Pull-in of an elastic electrode: a clamped beam over a plane, against the boundary-value problem, and adhesion."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.fields.electrostatic import VACUUM
from gudgeon.solver.simulate import simulate
from tests.solver.systems import build_all, rigid_records

LENGTH, WIDTH, THICK, GAP = 100e-6, 10e-6, 1e-6, 1e-6
YOUNG, RHO = 160e9, 2330.0
BENDING, LINEAR = YOUNG * WIDTH * THICK**3 / 12, RHO * WIDTH * THICK
"""E I [N m²] and mass per length [kg/m]."""
POINTS, MODES = 40, 4


def beam() -> tuple[ModalRecord, MorphRecord]:
    """Symmetric modes of a clamped–clamped beam of Euler and Bernoulli, with points of equal area on its lower side."""
    x = (np.arange(POINTS) + 0.5) / POINTS
    roots = [brentq(lambda b: np.cos(b) * np.cosh(b) - 1, (n + 0.5) * np.pi - 0.3, (n + 0.5) * np.pi + 0.3)
             for n in range(1, 2 * MODES, 2)]  # fmt: skip
    shapes, omega = [], []
    for b in roots:
        s = (np.cosh(b) - np.cos(b)) / (np.sinh(b) - np.sin(b))
        fine = np.linspace(0, 1, 4001)

        def mode(u: np.ndarray, b: float = b, s: float = s) -> np.ndarray:
            return np.cosh(b * u) - np.cos(b * u) - s * (np.sinh(b * u) - np.sin(b * u))

        mass = LINEAR * LENGTH * np.trapezoid(mode(fine) ** 2, fine)
        shapes.append(mode(x) / np.sqrt(mass))
        omega.append(b**2 * np.sqrt(BENDING / (LINEAR * LENGTH**4)))
    places = np.column_stack([LENGTH * x, np.zeros(POINTS), np.zeros(POINTS)])
    down = np.tile([0.0, 0.0, -1.0], (POINTS, 1))
    areas = np.full(POINTS, WIDTH * LENGTH / POINTS)
    face = InterfaceModes(
        np.arange(POINTS), places, down, areas, np.zeros(POINTS, bool), -np.array(shapes).T,
    )  # fmt: skip
    total, none = LINEAR * LENGTH, np.zeros((0, 6))
    modal = ModalRecord(
        "mesh", "macneal", MODES, 0, np.array(omega), total, np.zeros(3), np.eye(3) * total * LENGTH**2, none,
        {"face": face}, {"face": [0, POINTS]}, np.zeros((POINTS, POINTS)), None, None, {},
    )  # fmt: skip
    design = MorphRecord("mesh", "modes", "none", {"face": places}, total, np.zeros(3), modal.inertia, none, None, {})
    return modal, design


def truth_of_pull_in() -> float:
    """Return the largest voltage with an equilibrium, E I w⁗ = ½ ε b V²/(g − w)² between clamps.

    Along the branch the deflection of the middle is given and the load V² found: its maximum is the pull-in.
    """
    largest = 0.0
    guess: Any = None
    for middle in np.linspace(0.2, 0.5, 16):

        def rates(u: np.ndarray, y: np.ndarray, p: np.ndarray) -> np.ndarray:
            return np.vstack([y[1], y[2], y[3], p[0] / (1 - y[0]) ** 2])

        def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray, middle: float = middle) -> np.ndarray:
            return np.array([a[0], a[1], b[1], b[3], b[0] - middle])

        mesh = np.linspace(0, 0.5, 41)
        start = (np.vstack([middle * 16 * mesh**2 * (1 - mesh) ** 2, 0 * mesh, 0 * mesh, 0 * mesh]), [50.0])
        y, p = start if guess is None else guess
        found = solve_bvp(rates, ends, mesh, y, p=p, tol=1e-8)
        assert found.success
        guess = found.sol(mesh), found.p
        largest = max(largest, float(found.p[0]))
    return float(np.sqrt(largest * 2 * BENDING * GAP**3 / (VACUUM * WIDTH * LENGTH**4)))


def pulled(folder: Path, volts: float, **more: Any) -> Trajectory:
    pull = {"kind": "electrostatic-pressure", "body": "beam", "interface": "face", "point": [0.0, 0.0, -GAP],
            "normal": [0.0, 0.0, 1.0], "potential": volts} | more.pop("pull", {})  # fmt: skip
    omega = 4.73004**2 * np.sqrt(BENDING / (LINEAR * LENGTH**4))
    body = {"damping": {"ratio": 0.9, "frequency": omega / (2 * np.pi)}} if more.pop("damped", True) else {}
    run = {"duration": 40 * 2 * np.pi / omega, "samples": 100, "frames": 20, "integrator": "small"} | more
    return simulate(build_all(folder, {"beam": beam()}, {"body": {"beam": body}, "force": {"pull": pull}, "run": run}))


def test_static_pull_in_of_a_clamped_beam(tmp_path: Path) -> None:
    limit = truth_of_pull_in()
    # P. Osterberg's fit for narrow plates without stress and fringes: V² = 11.9 h³ g³ E/(ε L⁴) within some percent.
    assert limit == pytest.approx(np.sqrt(11.9 * THICK**3 * GAP**3 * YOUNG / (VACUUM * LENGTH**4)), rel=0.05)
    for share, result in ((0.99, "FINISHED"), (1.01, "FIELD_LEFT")):
        found = pulled(tmp_path / str(share), share * limit)
        assert found.result == result, found.counts.get("reason")
    assert "the plates of force.pull touch" in found.counts["reason"]


def test_energy_of_an_undamped_electrode_is_kept(tmp_path: Path) -> None:
    found = pulled(tmp_path, 20.0, damped=False, start="undeformed")  # At rest nothing would move.
    assert found.result == "FINISHED"
    balance = found.energies @ [1, 1, 1, 1, -1]
    assert np.ptp(balance) < 1e-3 * np.ptp(found.energies[:, 0])


def test_a_surface_must_face_the_plane(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"force\.pull\.normal: .* within 8 degrees"):
        pulled(tmp_path / "a", 1.0, pull={"normal": [0.0, 0.3, 1.0]})
    with pytest.raises(SceneError, match=r"force\.pull\.point: .* above the plane"):
        pulled(tmp_path / "b", 1.0, pull={"point": [0.0, 0.0, 1e-6]})


@pytest.mark.parametrize("integrator", ["small", "turning"])
def test_adhesion_holds_up_to_its_pull_off(integrator: str, tmp_path: Path) -> None:
    """A sphere that a contact's law carries is lifted: below 2 π w R it stays, above it flies."""
    w, R, reach = 0.05, 1e-6, 1e-9
    limit = 2 * np.pi * w * R
    for share in (0.98, 1.02):
        adhere = {"kind": "adhesion", "body": "part", "work": w, "radius": R, "range": reach, "point": [0, 0, -R],
                  "normal": [0, 0, 1]}  # fmt: skip
        lift = {"kind": "force", "body": "part", "at": [0, 0, 0], "direction": [0, 0, 1], "expression":
                f"{share * limit}*min(1, t/4e-6)"}  # fmt: skip
        calm = {"kind": "bushing", "body": "part", "damping": [0.0, 0.0, 1e-6]}
        seat = {"body": "part", "interface": "foot", "against": {"shape": "plane", "point": [0, 0, -R], "normal":
                [0, 0, 1]}, "law": {"kind": "hunt-crossley", "stiffness": 1e5, "exponent": 1.5, "restitution": 0.05},
                "method": "penalty"}  # fmt: skip
        record = rigid_records(1e-14, {"foot": ([0, 0, -R], [0, 0, -1])}, (4e-27, 4e-27, 4e-27))
        scene = {"body": {"part": {"freedom": ["z"]} if integrator == "small" else {}},
                 "force": {"adhere": adhere, "lift": lift, "calm": calm}, "contact": {"seat": seat},
                 "run": {"duration": 2e-5, "integrator": integrator, "samples": 100, "frames": 20}
                 | ({"step": 1e-9} if integrator == "small" else {})}  # fmt: skip
        found = simulate(build_all(tmp_path / f"{share}", {"part": record}, scene))
        assert found.result == "FINISHED", found.counts.get("reason")
        assert bool(found.motion["part"][-1, 2] > 10 * reach) is (share > 1)
