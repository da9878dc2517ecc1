"""An elastic bearing against a foundation: `python -m docs.tools.bearing_pressure [--picture FILE]`, a minute.

A pin in a bore of nearly its radius, both of one material, in plane strain: their compliance at 360 places is that of
records, modes and residual flexibility (bore of a plate of 12 radii, and pin that is held at a hub). Printed are the
half angle of contact over the load, beside Hertz and the conformal solution of A. Persson (On the stress distribution
of cylindrical elastic bodies in contact, Chalmers, 1964; M. Ciavarella, P. Decuzzi, The state of stress induced by the
plane frictionless cylindrical contact, Int. J. Solids Structures 38 (2001) 4507-4533); then pressure and worn depth of
a pin that turns under a constant load, by this compliance and by a foundation of springs as soft, with Archard's law.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import meshio
import numpy as np
from scipy import integrate, linalg, optimize

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.stages.run import run_job

RADIUS, GAP, LENGTH = 0.01, 20e-6, 0.02
"""Of the bore, radial clearance, length [m]."""
E, NU = 207e9, 0.3
PLANE_E = E / (1 - NU**2)
AROUND, OUTWARD = 180, 26
"""Elements."""
LOADS = (2e3, 5e3, 1e4, 2e4, 4e4, 8e4)
"""[N]"""
WORN = 1e-5 / 2e9
"""k/H [1/Pa]."""
LOAD, TURNS, UPDATES = 2e4, 1000.0, 100
SCENE = f"""
[component.plate]
geometry = {{{{ kind = "plane-file", path = "plate.msh", unit = 1.0, thickness = {LENGTH}, state = "plane-strain" }}}}
material = {{{{ E = {E}, nu = {NU}, rho = 7800.0 }}}}
interface.face = {{{{ surface = "face" }}}}
supports = ["held"]
modes = {{{{ normal_count = 20, static_count = 0 }}}}

[component.pin]
geometry = {{{{ kind = "plane-file", path = "pin.msh", unit = 1.0, thickness = {LENGTH}, state = "plane-strain" }}}}
material = {{{{ E = {E}, nu = {NU}, rho = 7800.0 }}}}
interface.face = {{{{ surface = "face" }}}}
supports = ["held"]
modes = {{{{ normal_count = 20, static_count = 0 }}}}

[body.plate]

[body.pin]

[run]
duration = 1e-5
"""


def ring(path: Path, face: float, held: float) -> None:
    """Write a ring of triangles of six nodes between the circles `face` and `held` [m], finer towards the face."""
    n, m = 2 * AROUND, 2 * OUTWARD
    shares = np.linspace(0, 1, m + 1)
    radii = face * (held / face) ** shares
    turn = 2 * np.pi / n * np.arange(n)
    points = np.array([[r * np.cos(t), r * np.sin(t), 0.0] for r in radii for t in turn])

    def at(j: int, i: int) -> int:
        return j * n + i % n

    cells = []
    for j in range(0, m, 2):
        for i in range(0, n, 2):
            a, b, c, d = at(j, i), at(j, i + 2), at(j + 2, i + 2), at(j + 2, i)
            middle = at(j + 1, i + 1)
            cells += [
                [a, b, c, at(j, i + 1), at(j + 1, i + 2), middle],
                [a, c, d, middle, at(j + 2, i + 1), at(j + 1, i)],
            ]
    edges = [[[at(j, i), at(j, i + 2), at(j, i + 1)] for i in range(0, n, 2)] for j in (0, m)]
    blocks = [("triangle6", np.array(cells)), ("line3", np.array(edges[0])), ("line3", np.array(edges[1]))]
    tags = [np.full(len(block), number) for number, (_, block) in enumerate(blocks, 1)]
    names = {"face": np.array([2, 1]), "held": np.array([3, 1]), "all": np.array([1, 2])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(path, meshio.Mesh(points, blocks, cell_data=data, field_data=names), "gmsh22", binary=False)


@dataclass(frozen=True)
class Bearing:
    """Places about the bore and what they yield to."""

    angles: np.ndarray
    """From the direction of the load [rad], (c,)."""
    areas: np.ndarray
    """[m²], (c,)"""
    compliance: np.ndarray
    """Of bore and pin along the radius [m/N], (c, c)."""
    gap: float = GAP
    """Radial clearance [m]."""

    def pressed(self, load: float, worn: np.ndarray) -> tuple[float, np.ndarray]:
        """Return approach [m] and pressures [Pa], (c,), under a load [N], of a bore with worn depths [m]."""
        factor = linalg.cholesky(self.compliance, lower=True)

        def forces(approach: float) -> np.ndarray:
            gap = self.gap + worn - approach * np.cos(self.angles)
            return optimize.nnls(factor.T, linalg.solve_triangular(factor, -gap, lower=True), maxiter=10**5)[0]

        def lacking(approach: float) -> float:
            return float(forces(approach) @ np.cos(self.angles)) - load

        least = float((self.gap + worn)[np.cos(self.angles) > 0.5].min())
        found = optimize.brentq(lacking, 0.5 * least, 3 * least + 2 * load * self.compliance.max(), xtol=1e-12)
        return float(found), forces(float(found)) / self.areas


def bearing(folder: Path) -> Bearing:
    """Return the compliance of bore and pin from their records."""
    ring(folder / "plate.msh", RADIUS, 12 * RADIUS)
    ring(folder / "pin.msh", RADIUS, 0.1 * RADIUS)
    (folder / "scene.toml").write_text(SCENE.format())
    job: Any = open_job(folder, db=folder / "db", out=folder / "out")
    run_job(job, "modes")
    total, found = np.zeros((2 * AROUND, 2 * AROUND)), {}
    for name in ("plate", "pin"):
        record = job.record(name)
        face = record.interfaces["face"]
        angles = np.arctan2(face.points[:, 1], face.points[:, 0])
        order = np.argsort(angles)
        first, last = record.interface_rows["face"]
        own = (
            face.rows / record.angular_frequencies**2 @ face.rows.T
            + record.residual_flexibility[first:last, first:last]
        )
        total = total + own[np.ix_(order, order)]
        found[name] = angles[order], face.areas[order]
    np.testing.assert_allclose(found["plate"][0], found["pin"][0], atol=1e-9)
    angles, areas = found["plate"]
    return Bearing(angles, areas, total)


def persson(angle: float) -> float:
    """Return the load [N] that presses pin and infinite plate of one material over a half angle of contact [rad]."""
    b = np.tan(angle / 2)

    def integrand(t: float) -> float:
        high, low = np.sqrt(1 + b * b), np.sqrt(b * b - t * t)
        return np.log((high + low) / (high - low)) / (1 + t * t)

    whole = integrate.quad(integrand, -b, b, limit=200)[0]
    number = 2 * (1 - b * b) / (np.pi * b * b) - whole / (np.pi**2 * b * b * (1 + b * b))
    return PLANE_E * GAP * LENGTH / number


def persson_pressure(angles: np.ndarray, half: float, load: float) -> np.ndarray:
    """Return his pressure at angles from the load's direction [Pa]."""
    b, y = np.tan(half / 2), np.tan(angles / 2)
    inside = np.abs(angles) < half
    low = np.sqrt(np.where(inside, b * b - y * y, 0.0))
    high = np.sqrt(1 + b * b)
    value = 2 / np.pi / high * low / (1 + y * y)
    value += np.log((high + low) / (high - low)) / (2 * np.pi * b * b * (1 + b * b))
    return np.where(inside, value * load / (RADIUS * LENGTH), 0.0)


def half_angle(angles: np.ndarray, pressure: np.ndarray) -> float:
    """Return where the square of the pressure, extrapolated from its last two points, is zero [rad]; of both sides."""
    ends = []
    for sign in (1, -1):
        side = np.argsort(sign * angles)
        a, p = sign * angles[side], pressure[side]
        last = int(np.flatnonzero((p > 0) & (a >= 0))[-1])
        one, two = p[last - 1] ** 2, p[last] ** 2
        ends.append(a[last] + two / max(one - two, 1e-300) * (a[last] - a[last - 1]) if one > two else a[last])
    return float(np.mean(ends))


def worn_by(one: Bearing) -> list[np.ndarray]:
    """Return the depths of a bore under a pin that turns, after a tenth, a third and all of the turns [m].

    Each update wears by the pressure at its end, as a softer compliance does: with that at its begin, depths of places
    beside each other would alternate.
    """
    depth, kept = np.zeros(len(one.angles)), []
    per_pressure = WORN * 2 * np.pi * RADIUS * TURNS / UPDATES
    wearing = Bearing(one.angles, one.areas, one.compliance + np.diag(per_pressure / one.areas))
    for update in range(1, UPDATES + 1):
        _, pressure = wearing.pressed(LOAD, depth)
        depth = depth + per_pressure * pressure
        if update in (UPDATES // 10, UPDATES // 3, UPDATES):
            kept.append(depth)
    return kept


def main() -> None:
    """Print the tables and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        elastic = bearing(Path(folder))
    print("| load [kN] | records [deg] | Persson [deg] | Hertz [deg] | largest pressure, records [MPa] | Persson |")
    print("|---|---|---|---|---|---|")
    for load in LOADS:
        _, pressure = elastic.pressed(load, np.zeros(len(elastic.angles)))
        theory = float(optimize.brentq(lambda t, load=load: persson(t) - load, 1e-3, 1.4))
        hertz = np.sqrt(8 * load / LENGTH * RADIUS**2 / (np.pi * PLANE_E * GAP)) / RADIUS
        most = persson_pressure(np.zeros(1), theory, load)[0]
        angles = np.degrees([half_angle(elastic.angles, pressure), theory, hertz])
        texts = [f"{load / 1e3:g}", *(f"{angle:.2f}" for angle in angles)]
        print(f"| {' | '.join([*texts, f'{pressure.max() / 1e6:.1f}', f'{most / 1e6:.1f}'])} |")
    approach, pressure = elastic.pressed(LOAD, np.zeros(len(elastic.angles)))
    depths = np.maximum(approach * np.cos(elastic.angles) - GAP, 0.0)
    soft = float(depths @ (elastic.areas * np.cos(elastic.angles))) / LOAD
    springs = Bearing(elastic.angles, elastic.areas, np.diag(soft / elastic.areas))
    _, plain = springs.pressed(LOAD, np.zeros(len(elastic.angles)))
    worn = {"records": worn_by(elastic), "foundation": worn_by(springs)}
    print(f"\n{LOAD / 1e3:g} kN, {TURNS:g} turns; foundation {1 / soft:.4g} N/m³, of the same approach when new\n")
    print(
        "| | largest pressure when new [MPa] | half angle [deg] | worn volume [mm³] | depth [µm] | half angle of wear |"
    )
    print("|---|---|---|---|---|---|")
    halves = half_angle(elastic.angles, pressure), float(np.arccos(GAP / approach))
    for name, new, half in zip(worn, (pressure, plain), halves, strict=True):
        depth = worn[name][-1]
        wide = np.degrees(np.abs(elastic.angles[depth > 0]).max())
        print(f"| {name} | {new.max() / 1e6:.1f} | {np.degrees(half):.2f}"
              f" | {float(depth @ elastic.areas) * 1e9:.4f} | {depth.max() * 1e6:.3f} | {wide:.0f}° |")  # fmt: skip
    if options.picture:
        draw(options.picture, elastic, (pressure, plain), worn)


def draw(path: Path, one: Bearing, new: tuple[np.ndarray, np.ndarray], worn: dict[str, list[np.ndarray]]) -> None:
    """Draw pressures when new and worn depths."""
    with style.styled():
        title = f"{LOAD / 1e3:g} kN on a pin in a bore of {RADIUS * 1e3:g} mm, {GAP * 1e6:g} µm of clearance"
        figure = style.new_figure("Pressure and wear: elastic bearing and foundation", title, width=1700, height=900)
        axes = figure.subplots(1, 2, gridspec_kw={"left": 0.08, "right": 0.97, "bottom": 0.12, "top": 0.78})
        degrees = np.degrees(one.angles)
        half = float(optimize.brentq(lambda t: persson(t) - LOAD, 1e-3, 1.4))
        fine = np.radians(np.linspace(-60, 60, 2401))
        axes[0].plot(
            np.degrees(fine), persson_pressure(fine, half, LOAD) / 1e6, color=style.GREY, lw=3, label="Persson"
        )
        for pressure, depths, colour, name in zip(new, worn.values(), (style.BLUE, style.ORANGE), worn, strict=True):
            axes[0].plot(degrees, pressure / 1e6, color=colour, lw=1.3, label=name)
            for number, depth in enumerate(depths):
                label = name if number == len(depths) - 1 else None
                axes[1].plot(degrees, depth * 1e6, color=colour, lw=0.7 + 0.4 * number, label=label)
        axes[0].set_ylabel("pressure when new [MPa]")
        axes[1].set_ylabel(f"depth after {TURNS / 10:g}, {TURNS * (UPDATES // 3) / UPDATES:g} and {TURNS:g} turns [µm]")
        for axis in axes:
            axis.set_xlim(-70, 70)
            axis.set_ylim(0, None)
            axis.set_xlabel("angle from the load [deg]")
            style.legend(axis)
        style.save(figure, path)


if __name__ == "__main__":
    main()
