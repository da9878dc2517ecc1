"""`python -m docs.tools.basis_error`: the estimated error of the modal basis beside the true one, for docs/basis.md.

A rigid mass or a steel bar strikes the end of a steel bar of 1 m, or a steel bar one of rubber of equal length; the
reference has the bars' exact modes, 1000 each, or 300 with Hertz's law. Prints the rows of bars of 1000 elements with
given numbers of modes, and of bars as they are by default.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.integrators.curves import windowed
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import assembled
from gudgeon.solver.system.system import System

STEEL, RUBBER = {"E": 210e9, "nu": 0.3, "rho": 7850.0}, {"E": 5e6, "nu": 0.3, "rho": 1100.0}
AREA = 3.14e-4
COUNTS = (30, 60, 150)
METHODS = {
    "rigid": {"method": "constraint"},
    "R": {"method": "residual"},
    "R, dashpot": {"method": "residual", "dashpot": "wave-guide"},
}
HERTZ = {"method": "residual", "law": {"kind": "hertz", "radius": 0.05, "modulus": 115e9}}
"""An end rounded with a radius of 50 mm against a flat one, both of steel."""
SMOOTH = 300
"""Exact modes of bars in contacts with a law: their force has no jumps."""
QUANTITIES = ("impulse", "force", "rebound")


class Impact(NamedTuple):
    """A body that moves at 1 m/s and strikes a bar at rest."""

    striker: dict[str, Any]
    position: float
    """Of the bar's struck end [m]."""
    duration: float
    """[s]"""
    bar: dict[str, Any]
    exact: int = 1000


def bar(length: float, material: dict[str, float]) -> dict[str, Any]:
    """Return a bar."""
    ends = {"front": {"surface": "right"}, "back": {"surface": "left"}}
    shape = {"kind": "bar", "length": length, "area": AREA}
    return {"geometry": shape, "material": material, "interface": ends}


def mass(kilograms: float) -> dict[str, Any]:
    """Return a rigid mass."""
    points = {"face": {"at": [0.0, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]}}
    shape = {"kind": "rigid", "mass": kilograms, "points": points}
    return {"geometry": shape, "interface": {"front": {"surface": "face"}}}


WHOLE = AREA * STEEL["rho"]
IMPACTS = {
    "mass, ratio 0.1": Impact(mass(0.1 * WHOLE), 0.0, 1e-3, bar(1.0, STEEL)),
    "mass, ratio 1": Impact(mass(WHOLE), 0.0, 1.5e-3, bar(1.0, STEEL)),
    "mass, ratio 10": Impact(mass(10 * WHOLE), 0.0, 4e-3, bar(1.0, STEEL)),
    "bar, ratio 0.1": Impact(bar(0.1, STEEL), 0.1, 4e-4, bar(1.0, STEEL)),
    "bar, ratio 1": Impact(bar(1.0, STEEL), 1.0, 8e-4, bar(1.0, STEEL)),
    "bar, ratio 10": Impact(bar(1.0, STEEL), 1.0, 2e-3, bar(0.1, STEEL)),
    "steel on rubber": Impact(bar(0.1, STEEL), 0.1, 1e-2, bar(0.1, RUBBER), 400),
}


def compiled(
    impact: Impact, count: int | None, contact: dict[str, Any], folder: Path, integrator: str = "auto"
) -> System:
    """Return the system of an impact, with 1000 elements and a number of modes of each bar, or with the defaults."""
    file = folder / "scene.toml"
    file.write_text(scene_text(impact, count, contact, integrator))
    job = open_job(file, db=folder / "db", out=folder / "out")
    run_job(job, "morph")
    return system_of(job)


def scene_text(impact: Impact, count: int | None, contact: dict[str, Any], integrator: str) -> str:
    """Return the scene file of an impact."""
    parts = {"one": impact.striker, "two": impact.bar}
    lines = []
    for name, part in parts.items():
        given = {}
        if part["geometry"]["kind"] == "bar" and count is not None:
            given = {"mesh": {"size": part["geometry"]["length"] / 1000}, "modes": {"normal_count": count}}
        lines += [f"component.{name} = {toml(part | given)}"]
    against = {"shape": "body", "body": "two", "interface": "back"}
    lines += [
        f"body.one = {toml({'velocity': [1.0, 0.0, 0.0]})}",
        f"body.two = {toml({'position': [impact.position, 0.0, 0.0]})}",
        f"contact.pair = {toml({'body': 'one', 'interface': 'front', 'against': against} | contact)}",
        f"run = {toml({'duration': impact.duration, 'integrator': integrator})}",
    ]
    return "\n".join(lines)


def toml(value: Any) -> str:
    """Return tables, lists, numbers and texts as an inline TOML value."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + "}"
    return f"[{', '.join(map(toml, value))}]" if isinstance(value, list) else repr(value).replace("'", '"')


def exact(system: System, count: int) -> System:
    """Return a system with exact modes of its free bars, √(2/m) cos(kπx/L), and their R; its run has no checks."""
    bodies, first = {}, 0
    for name, body in system.bodies.items():
        modal = body.modal
        if len(modal.angular_frequencies):
            order = np.arange(1, count + 1)
            omega, amplitude = modal.angular_frequencies[0] * order, np.sqrt(2 / body.morph.mass)
            rows = {"front": amplitude * (-1.0) ** order, "back": -amplitude * np.ones(count)}
            # Static flexibility with inertia relief: L/(3EA) at an end, with L/(EA) = π²/(m ω₁²).
            end = np.pi**2 / (3 * body.morph.mass * omega[0] ** 2)
            R = np.zeros((2, 2))
            for one, (i, _) in modal.interface_rows.items():
                for other, (j, _) in modal.interface_rows.items():
                    R[i, j] = end * (1.0 if i == j else 0.5) - float((rows[one] * rows[other] / omega**2).sum())
            places = {key: replace(place, rows=rows[key][None]) for key, place in modal.interfaces.items()}
            modal = replace(modal, angular_frequencies=omega, interfaces=places, residual_flexibility=R)
        bodies[name] = replace(body, modal=modal, first=first)
        first = bodies[name].elastic.stop
    run = system.scene.run.model_copy(update={"checks": False})
    return assembled(system.scene.model_copy(update={"run": run}), bodies, system.terms)


def measured(found: Trajectory, window: float) -> np.ndarray:
    """Return impulse [N s], windowed force [N] and rebound velocities [m/s] of a run, (4,)."""
    edges, force = np.concatenate([[0.0], found.times]), found.contacts["pair"].force
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(force, axis=0)]) * found.times[0]
    speeds = [found.quantities[f"pair.{name}"]["value"] for name in ("rebound_velocity", "rebound_velocity_other")]
    return np.array([np.linalg.norm(sums[-1]), windowed(edges, sums, window)[0], *speeds])


def rows(impacts: Mapping[str, Impact], methods: Mapping[str, Any], counts: Sequence[int | None]) -> Iterator[str]:
    """Yield a row of the table for each impact, contact and number of modes, None for bars as they are by default."""
    for name, impact in impacts.items():
        with TemporaryDirectory() as place:
            folder, references = Path(place), dict[str, Trajectory]()
            for label, contact in methods.items():
                # Contacts without a law are the same impact: rigid ends.
                law = str(contact.get("law"))
                if law not in references:
                    given, integrator = (contact, "small") if "law" in contact else (METHODS["R"], "event")
                    many = SMOOTH if "law" in contact else impact.exact
                    references[law] = simulate(exact(compiled(impact, 30, given, folder, integrator), many))
                for count in counts:
                    system = compiled(impact, count, contact, folder)
                    found = simulate(system)
                    ours, true = (measured(one, system.separation) for one in (found, references[law]))
                    errors = [*np.abs(ours / true - 1)[:2], np.abs(ours - true)[2:].max()]
                    cells = [
                        f"{error:.2%} ({found.estimates[f'basis.{one}']:.2%})"
                        for one, error in zip(QUANTITIES, errors, strict=True)
                    ]
                    modes = "default" if count is None else count
                    yield f"| {name} | {label} | {modes} | {' | '.join(cells)} |"


def main() -> None:
    """Print the rows of the table."""
    columns = ("impact", "contact", "modes", "impulse", "windowed force", "rebound velocity")
    steel = {name: impact for name, impact in IMPACTS.items() if impact.bar["material"] is STEEL}
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    default = rows(IMPACTS, METHODS, (None,)), rows(steel, {"Hertz": HERTZ}, (None,))
    for row in chain(rows(IMPACTS, METHODS, COUNTS), *default):
        print(row, flush=True)


if __name__ == "__main__":
    sys.exit(main())
