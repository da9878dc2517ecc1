"""Static answers of a scene to unit forces: gauge values and displacements, one row each, one column a force."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gudgeon.pipeline.files import csv_text
from gudgeon.solver.errors import SceneError

if TYPE_CHECKING:
    from gudgeon.solver.linear.state import Linearised, Place

WRENCH = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
SHOWN = 24
"""Rows that the terminal shows."""


@dataclass(frozen=True)
class StaticTable:
    """What is read at n places per unit of k forces."""

    forces: list[str]
    """Port and direction of each force, (k,)."""
    force_units: list[str]
    places: list[str]
    """(n,)"""
    units: list[str]
    """Of what is read, (n,)."""
    values: np.ndarray
    """(n, k)"""

    def heads(self) -> list[str]:
        """Return the head of each column."""
        return [f"per {name} [1/({unit})]" for name, unit in zip(self.forces, self.force_units, strict=True)]

    def as_csv(self) -> str:
        """Return the table as CSV."""
        rows = [
            [name, unit, *(repr(float(x)) for x in line)]
            for name, unit, line in zip(self.places, self.units, self.values, strict=True)
        ]
        return csv_text([["place", "unit", *self.heads()], *rows])

    def as_text(self) -> str:
        """Return the table for the terminal."""
        width = max(map(len, self.places), default=0)
        lines = [f"{'per unit':{width}} {'':4} " + " ".join(f"{force:>12}" for force in self.forces)]
        for name, unit, line in list(zip(self.places, self.units, self.values, strict=True))[:SHOWN]:
            lines.append(f"{name:{width}} {unit:4} " + " ".join(f"{x:12.4e}" for x in line))
        if len(self.places) > SHOWN:
            lines.append(f"… {len(self.places)} rows in all")
        return "\n".join(lines)

    def as_json(self) -> dict[str, Any]:
        """Return it for `--json`."""
        return {"forces": self.forces, "force_units": self.force_units, "places": self.places, "units": self.units,
                "values": self.values.tolist()}  # fmt: skip


def static_table(linear: "Linearised", force: str | None, at: tuple[str, ...]) -> StaticTable:
    """Return the static answers of a scene at its start.

    Args:
        force: Port of the unit forces; default: every given force of the scene.
        at: Where it is read; default: all gauges and probes of displacement, and where the forces act.

    Raises:
        SceneError: no such port, none at all, or a force moves a body that nothing holds.
    """
    from gudgeon.solver.linear.state import places, read_as
    from gudgeon.solver.linear.static import static_response
    from gudgeon.solver.scene.probe import PointProbe

    system = linear.system
    force_ports = [f"force.{name}" for name in system.scene.given()]
    loads = _loads(linear, [force] if force else force_ports)
    probes = [f"probe.{name}" for name, probe in system.scene.probe.items()
              if isinstance(probe, PointProbe) and probe.kind in ("displacement", "rotation")]  # fmt: skip
    read_names = at or (*map(read_as, dict.fromkeys(system.gauges)), *probes, *force_ports)
    read = [p for name in read_names for p in places(linear, name, "--at")]
    values = static_response(linear, loads, read)
    names = [_named(linear, p) for p in loads]
    return StaticTable(
        [name for name, _ in names], [unit for _, unit in names], [p.label for p in read],
        [p.unit or _motion_unit(linear, p) for p in read], np.where(np.abs(values) > 0, values, 0.0),
    )  # fmt: skip


def _loads(linear: "Linearised", names: list[str]) -> list["Place"]:
    """Return the rows of the ports at which unit forces act."""
    from gudgeon.solver.linear.state import places

    if not names:
        raise SceneError(
            "--static: the scene has no force; add one of kind 'wrench' at a tie, or name a port by --force"
        )
    loads = [row for name in names for row in places(linear, name, "--force")]
    for row in loads:
        if row.port < 0 or row.given:
            raise SceneError(f"--force '{row.label}': a unit force acts at a contact, joint or force")
    return loads


def _motion_unit(linear: "Linearised", point: "Place") -> str:
    """Return the unit of a displacement or rotation."""
    if point.port < 0:
        kind = getattr(linear.system.scene.probe[point.label.removeprefix("probe.").partition("[")[0]], "kind", "")
        return "rad" if kind == "rotation" else "m"
    return "rad" if _named(linear, point)[1] == "N m" else "m"


def _named(linear: "Linearised", point: "Place") -> tuple[str, str]:
    """Return what a port is called and the unit of its force: `force.NAME Fx` of a wrench."""
    base, _, index = point.label.partition("[")
    kind = getattr(linear.system.scene.force.get(base.removeprefix("force.")), "kind", "")
    if kind == "wrench":
        component = int(index.removesuffix("]")) - 1
        return f"{base} {WRENCH[component]}", "N" if component < 3 else "N m"
    return point.label, {"torque": "N m", "pressure": "Pa", "gas": "Pa"}.get(kind, "N")
