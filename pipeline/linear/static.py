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
            [place, unit, *(repr(float(one)) for one in line)]
            for place, unit, line in zip(self.places, self.units, self.values, strict=True)
        ]
        return csv_text([["place", "unit", *self.heads()], *rows])

    def as_text(self) -> str:
        """Return the table for the terminal."""
        width = max(map(len, self.places), default=0)
        lines = [f"{'per unit':{width}} {'':4} " + " ".join(f"{one:>12}" for one in self.forces)]
        for place, unit, line in list(zip(self.places, self.units, self.values, strict=True))[:SHOWN]:
            lines.append(f"{place:{width}} {unit:4} " + " ".join(f"{one:12.4e}" for one in line))
        if len(self.places) > SHOWN:
            lines.append(f"… {len(self.places)} rows in all")
        return "\n".join(lines)

    def as_json(self) -> dict[str, Any]:
        """Return it for `--json`."""
        return {"forces": self.forces, "force_units": self.force_units, "places": self.places, "units": self.units,
                "values": self.values.tolist()}  # fmt: skip


def static_table(found: "Linearised", force: str | None, at: tuple[str, ...]) -> StaticTable:
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

    system = found.system
    given = [f"force.{name}" for name in system.scene.given()]
    if force is None and not given:
        raise SceneError(
            "--static: the scene has no force; add one of kind 'wrench' at a tie, or name a port by --force"
        )
    pushed = [one for name in ([force] if force else given) for one in places(found, name, "--force")]
    for one in pushed:
        if one.port < 0 or one.given:
            raise SceneError(f"--force '{one.label}': a unit force acts at a contact, joint or force")
    probes = [f"probe.{name}" for name, one in system.scene.probe.items()
              if isinstance(one, PointProbe) and one.kind in ("displacement", "rotation")]  # fmt: skip
    wanted = at or (*map(read_as, dict.fromkeys(system.gauges)), *probes, *given)
    read = [one for name in wanted for one in places(found, name, "--at")]
    values = static_response(found, pushed, read)
    names = [_named(found, one) for one in pushed]
    return StaticTable(
        [name for name, _ in names], [unit for _, unit in names], [one.label for one in read],
        [one.unit or _motion_unit(found, one) for one in read], np.where(np.abs(values) > 0, values, 0.0),
    )  # fmt: skip


def _motion_unit(found: "Linearised", place: "Place") -> str:
    """Return the unit of a displacement or rotation."""
    if place.port < 0:
        kind = getattr(found.system.scene.probe[place.label.removeprefix("probe.").partition("[")[0]], "kind", "")
        return "rad" if kind == "rotation" else "m"
    return "rad" if _named(found, place)[1] == "N m" else "m"


def _named(found: "Linearised", place: "Place") -> tuple[str, str]:
    """Return what a port is called and the unit of its force: `force.NAME Fx` of a wrench."""
    base, _, number = place.label.partition("[")
    kind = getattr(found.system.scene.force.get(base.removeprefix("force.")), "kind", "")
    if kind == "wrench":
        component = int(number.removesuffix("]")) - 1
        return f"{base} {WRENCH[component]}", "N" if component < 3 else "N m"
    return place.label, {"torque": "N m", "pressure": "Pa", "gas": "Pa"}.get(kind, "N")
