"""Table of a component's modes: frequency, estimated error, residual; notes on coarse meshes and parted groups."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import VOLUME_ERROR, ModalRecord
from gudgeon.pipeline.geometry.cells import HEXAHEDRON, PYRAMID, TETRAHEDRON, WEDGE, block_meshes, cell_of
from gudgeon.pipeline.stages.notes.facts import Facts

COUNTS = {"normal_count": ("whole_count", "clamped_whole_count"), "fixed_count": ("whole_fixed_count",)}
"""Counts of modes, and where a record's quality has those that keep groups of equal frequencies whole."""
NAMES = {TETRAHEDRON: "tetrahedra", HEXAHEDRON: "hexahedra", WEDGE: "wedges", PYRAMID: "pyramids"}
COARSE = 0.01
"""Estimated relative error of a kept mode's frequency above which a note is given where nothing touches the body."""
COARSE_VOLUME = 0.002
"""Relative error of the volume of a mesh above which a note is given."""
COARSE_CONTACT = 0.02
"""Estimated relative error of an interface's static compliance above which a note is given."""


def frequency_rows(record: ModalRecord) -> list[dict[str, Any]]:
    """Return number, frequency [Hz], estimated error, bound and residual of each kept mode, None if unknown."""
    count = record.normal_count
    columns = [
        [None] * count if values is None else [float(v) if np.isfinite(v) else None for v in values[:count]]
        for values in (record.discretisation_errors, record.algebraic_errors, record.residuals)
    ]
    frequencies = record.angular_frequencies[:count] / (2 * np.pi)
    return [
        {"mode": i + 1, "frequency": float(f), "estimated_error": error, "algebraic_bound": bound, "residual": residual}
        for i, (f, error, bound, residual) in enumerate(zip(frequencies, *columns, strict=True))
    ]


def coarse(facts: Facts) -> Iterator[str]:
    """Yield a note for each component whose mesh is too coarse.

    Where bodies touch it, the flexibility of its interfaces is judged: a mode counts by what it contributes. Where
    nothing does, the frequencies are the result, and each kept mode is judged.
    """
    for name, record in facts.modes.items():
        errors = record.quality.get("compliance_errors", {})
        fault = _coarse_contact(errors) if errors else _coarse_modes(record)
        if fault is not None:
            key, remedy = "mesh.size", "refine the mesh by a smaller size"
            if facts.scene.component[name].from_file:
                key, remedy = "geometry.path", "refine the mesh in its file"
                if kinds := _locking(facts, name):
                    remedy += f"; its {kinds} lock in bending: mid-edge nodes or incompatible modes (C3D8I) do not"
            yield f"component.{name}.{key}: {fault} {remedy}"


def volumes(facts: Facts) -> Iterator[str]:
    """Yield a note for each component whose mesh has noticeably less or more volume than its true surfaces."""
    for name, record in facts.modes.items():
        error = float(record.quality.get(VOLUME_ERROR, 0.0))
        if abs(error) > COARSE_VOLUME:
            key, remedy = "mesh.size", "refine the mesh by a smaller size"
            if facts.scene.component[name].from_file:
                key, remedy = "geometry.path", "refine the mesh in its file"
            yield (
                f"component.{name}.{key}: the volume of the mesh, and its mass, is {abs(error):.2%}"
                f" {'above' if error > 0 else 'below'} that within its true surfaces; {remedy}"
            )


def _locking(facts: Facts, name: str) -> str:
    """Return the names of a component's linear cells in full integration, too stiff in bending, or nothing."""
    mesh = facts.store.get(facts.meshes[name], "mesh")
    if mesh.system is not None or not cell_of(mesh).solid:
        return ""
    blocks = [cell_of(block) for _, block in block_meshes(mesh) if "incompatible" not in block.formulations]
    return " and ".join(sorted(f"linear {NAMES[cell.shape]}" for cell in blocks if not cell.quadratic))


def parted(facts: Facts) -> Iterator[str]:
    """Yield a note for each count of modes that keeps a part of a group of equal frequencies."""
    for name, record in facts.modes.items():
        for key, entries in COUNTS.items():
            group_size = max(int(record.quality.get(entry, 0)) for entry in entries)
            if (count := getattr(facts.scene.component[name].modes, key)) < group_size:
                yield (
                    f"component.{name}.modes.{key}: {count} modes part a group of equal frequencies: which of its modes"
                    f" are kept is left to round-off, and results with it; {group_size} keep the group whole"
                )


def _coarse_contact(errors: Mapping[str, float]) -> str | None:
    name = max(errors, key=lambda n: errors[n])
    if not errors[name] > COARSE_CONTACT:
        return None
    return (
        f"the mesh error of the contact's flexibility is about {errors[name]:.1%} at interface '{name}', above"
        f" {COARSE_CONTACT:.0%} (estimated from recovered stress under smooth pressures);"
    )


def _coarse_modes(record: ModalRecord) -> str | None:
    errors = record.discretisation_errors
    if errors is None or not (coarse := np.flatnonzero(errors > COARSE)).size:
        return None
    worst = coarse[np.argmax(errors[coarse])]
    return (
        f"the estimated frequency error of {len(coarse)} of {record.normal_count} modes is above {COARSE:.0%}; the"
        f" largest is {errors[worst]:.1%}, at mode {worst + 1} ({record.angular_frequencies[worst] / (2 * np.pi):.4g}"
        " Hz); keep fewer modes, or"
    )
