"""Write the tables of this folder: `python data/piston/make_tables.py`.

Gas pressure (`gas-pressure.csv`), absolute, over one cycle of a four-stroke engine, 0 = firing top dead centre. The
analytic cylinder pressure of Eriksson & Andersson, SAE 2002-01-0371: compression and expansion are polytropes

    p_c = p_in (V_max / V)^n_c,    p_e = A V^-n_e,

and the burn blends them, p = (1 − f) p_c + f p_e, with Wiebe's function f = 1 − exp(−a y^(m+1)), y = (θ − θ_0) / Δθ.
A is such that the peak is PEAK. V(θ) is the slider-crank's, V = V_c + π r² s(θ). The compression starts at bottom
dead centre, where dV/dθ = 0, and the quintic 6t⁵ − 15t⁴ + 10t³ leads over at the exhaust valve's opening and at the
gas exchange's dead centre, so that pressure and slope are continuous everywhere.

Force on the crown at 3000 rev/min (`gas-force.csv`), from 20 degrees before firing dead centre.

Skirt profiles (`skirt-profile*.csv`): a barrel in height s = z − z_0, the cubic −s² (α + β s) through its two end
values, plus an ovality −(d/2) (1 − cos 2φ), zero at the thrust sides φ = 0° and 180°. The depths are of the size of a
passenger car's; they are of no particular engine.
"""

from pathlib import Path

import numpy as np

CRANK_RADIUS, ROD_LENGTH, BORE_RADIUS = 0.043, 0.140, 0.043
"""[m]"""
START, SPEED, CROWN_RADIUS, AMBIENT = -20.0, 18000.0, 0.04296, 1e5
"""Of `gas-force.csv`, the force of this pressure on the crown over time: crank angle at the start [deg], speed [deg/s],
[m], [Pa]."""
COMPRESSION_RATIO = 10.0
N_COMPRESSION, N_EXPANSION = 1.32, 1.28
P_INTAKE, P_EXHAUST, PEAK = 0.9e5, 1.1e5, 70e5
"""[Pa]"""
BURN_START, BURN_DURATION, WIEBE_A, WIEBE_M = -26.0, 50.0, 5.0, 2.0
"""[deg], [deg], and Wiebe's two numbers; the start puts the peak at 10° after dead centre."""
IMPACTDOWN, EXCHANGE = (130.0, 200.0), (345.0, 385.0)
"""Crank angles over which the pressure falls to exhaust, and from exhaust to intake [deg]."""

SKIRT_HEIGHT, BARREL_MIDDLE = 0.034, 0.014
"""[m]"""
PROFILES = {
    "skirt-profile.csv": (15e-6, 25e-6, 60e-6),
    "skirt-profile-barrel-plus.csv": (35e-6, 45e-6, 60e-6),
    "skirt-profile-barrel-minus.csv": (0.0, 5e-6, 60e-6),
    "skirt-profile-oval.csv": (15e-6, 25e-6, 100e-6),
}
"""Depths below the nominal radius at the bottom end, at the top end, and across the thrust direction [m]."""


def volume(angle: np.ndarray) -> np.ndarray:
    """Cylinder volume [m^3] at crank angles [deg]."""
    turn = np.radians(angle)
    reach = CRANK_RADIUS * np.cos(turn) + np.sqrt(ROD_LENGTH**2 - (CRANK_RADIUS * np.sin(turn)) ** 2)
    area = np.pi * BORE_RADIUS**2
    clearance = 2 * CRANK_RADIUS * area / (COMPRESSION_RATIO - 1)
    return clearance + area * (CRANK_RADIUS + ROD_LENGTH - reach)


def pressure(angle: np.ndarray) -> np.ndarray:
    """Absolute cylinder pressure [Pa] at crank angles [deg], 0 = firing top dead centre, period 720."""
    cycle = np.mod(np.asarray(angle, float) + 180.0, 720.0) - 180.0
    compression = P_INTAKE * (volume(np.array(180.0)) / volume(cycle)) ** N_COMPRESSION
    burnt = 1 - np.exp(-WIEBE_A * np.clip((cycle - BURN_START) / BURN_DURATION, 0, None) ** (WIEBE_M + 1))
    expansion = _expansion_scale() * volume(cycle) ** -N_EXPANSION
    fired = (1 - burnt) * compression + burnt * expansion
    emptied = _blend(cycle, *IMPACTDOWN, fired, P_EXHAUST)
    return _blend(cycle, *EXCHANGE, emptied, P_INTAKE)


def _expansion_scale() -> float:
    """Return A [Pa m^(3 n_e)]: the largest for which no angle is above PEAK, as p is linear in A."""
    angle = np.linspace(-10.0, 60.0, 70001)
    burnt = 1 - np.exp(-WIEBE_A * ((angle - BURN_START) / BURN_DURATION) ** (WIEBE_M + 1))
    compression = P_INTAKE * (volume(np.array(180.0)) / volume(angle)) ** N_COMPRESSION
    return float(((PEAK - (1 - burnt) * compression) / (burnt * volume(angle) ** -N_EXPANSION)).min())


def _blend(
    angle: np.ndarray, start: float, end: float, before: np.ndarray | float, after: np.ndarray | float
) -> np.ndarray:
    t = np.clip((angle - start) / (end - start), 0, 1)
    weight = t**3 * (10 + t * (6 * t - 15))
    return (1 - weight) * before + weight * after


def deviation(height: np.ndarray, angle: np.ndarray, bottom: float, top: float, oval: float) -> np.ndarray:
    """Radial deviation [m] of the skirt at heights [m] and angles [deg], for depths as in PROFILES."""
    ends = np.array([0.0, SKIRT_HEIGHT]) - BARREL_MIDDLE
    alpha, beta = np.linalg.solve(np.column_stack([ends**2, ends**3]), [bottom, top])
    s = height - BARREL_MIDDLE
    return -(s**2) * (alpha + beta * s) - oval / 2 * (1 - np.cos(2 * np.radians(angle)))


def write_tables(folder: Path) -> None:
    """Write all tables into a folder."""
    angles = np.arange(721)
    values = pressure(angles)
    rows = [f"{angle},{value:.1f}" for angle, value in zip(angles, values, strict=True)]
    _write(folder / "gas-pressure.csv", ["crank angle_deg,absolute pressure_Pa", *rows])
    amounts = [(value - AMBIENT) * np.pi * CROWN_RADIUS**2 for value in pressure(np.mod(angles + START, 720.0))]
    rows = [f"{angle / SPEED:.9f},{amount:.4f}" for angle, amount in zip(angles, amounts, strict=True)]
    _write(folder / "gas-force.csv", ["time_s,force_N", *rows])
    for name, depths in PROFILES.items():
        _write_profile(folder / name, *depths)


def _write_profile(path: Path, bottom: float, top: float, oval: float) -> None:
    heights, angles = np.linspace(0, SKIRT_HEIGHT, 18), np.arange(-180, 181, 15)
    depths = f"{1e6 * bottom:.0f} / {1e6 * top:.0f} um barrel; {1e6 * oval:.0f} um oval"
    label = f"height_m\\angle_deg: {depths}"
    rows = []
    for height in heights:
        row = deviation(height, angles, bottom, top, oval)
        rows.append(",".join([f"{height:.3f}", *(_text(value) for value in row)]))
    _write(path, [",".join([label, *map(str, angles)]), *rows])


def _text(value: float) -> str:
    """Write a deviation [m] to the tenth of a nanometre, without a minus before zero."""
    return f"{round(value, 10) + 0.0:.10f}"


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write_tables(Path(__file__).parent)
