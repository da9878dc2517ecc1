"""Data that the stages of a wheel read of each record, the terms that they omit, and the reason for each."""

from typing import Any

from gudgeon.pipeline.applications.wheel.job import WheelJob
from gudgeon.pipeline.stages.plan import term_row, total


def plan_wheel(job: WheelJob) -> dict[str, Any]:
    """Return the terms that are read or omitted, with reason, fields and bytes, and the bytes read in all."""
    name, keys = job.scene.only[0], {"mesh": job.mesh().key, "cyclic": job.modes().key}
    rows = [term_row(job.store, keys, name, term)[0] for term in _terms(job)]
    return {"scene": job.name, "terms": rows, "bytes": total(row["bytes"] for row in rows if row["present"])}


def _terms(job: WheelJob) -> list[tuple[str, bool, str, tuple[str, ...]]]:
    """List name, presence, reason and the fields `record:path` of each term."""
    wheel, interface, mesh = job.wheel, job.wheel.interface, ("mesh:nodes", "mesh:cells", "mesh:surfaces")
    all_kept, mode_limit, some = interface.kept == "all", interface.interface_count, sum(c != 0 for c in job.changes)
    surfaces, response = [s.surface for s in job.component.supports], wheel.response
    others = "all" if mode_limit is None else f"{mode_limit} of each sector"
    frequencies = tuple(f"cyclic:{path}" for path in job.tuned_frequencies())
    return [
        ("tuned modes", True, f"{wheel.mode_count} of each harmonic 0…{wheel.sectors // 2}", mesh),
        ("supports", bool(surfaces), f"held surfaces: {', '.join(surfaces) or 'none'}", ()),
        ("reduced wheel", True, f"{wheel.count} lowest modes, tuned and mistuned", mesh),
        ("mistuning", some > 0, f"the stiffness of {some} blades is changed", ()),
        ("kept dofs", bool(interface.kept), f"interface.kept is {_listed(interface.kept)}", ()),
        ("interface modes", not all_kept and mode_limit != 0, "all dofs are kept" if all_kept else others, ()),
        ("fixed-interface modes", wheel.fixed_count > 0, f"fixed_count is {wheel.fixed_count}", ()),
        ("response", True, f"engine order {response.engine_order}, loss factor {response.loss_factor:g}", ()),
        ("reduction error", True, "from the frequencies of the harmonics", frequencies),
        ("rotation", False, "the wheel does not rotate: no gyroscopic and centrifugal terms", ()),
        ("shapes of the sector", False, "needed for pictures only",
         tuple(f"cyclic:harmonics/{n}/{component}" for n in wheel.harmonics() for component in ("real", "imaginary"))),
    ]  # fmt: skip


def _listed(names: str | tuple[str, ...]) -> str:
    return f"'{names}'" if isinstance(names, str) else ", ".join(names) or "empty"
