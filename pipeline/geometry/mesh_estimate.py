"""What a mesh will need, estimated before it is made: elements, memory and time of the stages up to its modes."""

import logging
import math
import os
from typing import NamedTuple

from gudgeon.pipeline.errors import InputError
from gudgeon.solver.machine.memory import total_memory

log = logging.getLogger(__name__)
GIB = 2**30
NODES = 60_000
"""Of a CAD part whose mesh.size is left out, at most: the same on every machine, so that keys are."""
LONG = 120.0
"""Estimated time up to the modes [s] from which a line says so before meshing begins."""
DIRECTIONS = {"solid": 3, "plane": 2, "line": 2}
"""Degrees of freedom of a node."""
DISTRIBUTED = "GUDGEON_SLEPC"
"""Variable that hands the extraction of modes to several machines, see docs/cluster.md."""


class Cost(NamedTuple):
    """Cost of meshes of one type of element, measured on blocks, skirts, liners and plates of 1e3 to 2e5 elements."""

    dofs: float
    """Degrees of freedom per element."""
    mesh_bytes: float
    """Memory per element of mesh and matrices."""
    factor_bytes: float
    """Of the factor, per (degrees of freedom)^growth."""
    growth: float
    """4/3 for solids, 1 for planes and lines, by nested dissection: A. George, SIAM J. Numer. Anal. 10 (1973) 345."""
    seconds: float
    """Per element."""
    factor_seconds: float
    """Per (degrees of freedom)^(3/2 growth)."""


COSTS = {
    "solid": Cost(4.5, 5e3, 150.0, 4 / 3, 2e-4, 2e-9),
    "plane": Cost(4.0, 5e3, 800.0, 1.0, 1e-4, 1e-7),
    "line": Cost(4.0, 5e3, 100.0, 1.0, 1e-5, 1e-8),
}


class Needs(NamedTuple):
    """What a mesh needs up to its modes."""

    elements: float
    nodes: float
    memory: float
    """[B]"""
    seconds: float
    """CPU time [s]."""


def needs_of(kind: str, elements: float) -> Needs:
    """Return what a mesh of about so many elements needs."""
    cost = COSTS[kind]
    dofs = cost.dofs * elements
    # Several machines may hold the factor.
    factor = 0.0 if os.environ.get(DISTRIBUTED) else cost.factor_bytes * dofs**cost.growth
    seconds = cost.seconds * elements + cost.factor_seconds * dofs ** (1.5 * cost.growth)
    return Needs(elements, dofs / DIRECTIONS[kind], cost.mesh_bytes * elements + factor, seconds)


def of_nodes(kind: str, nodes: float) -> Needs:
    """Return what a mesh of about so many nodes needs."""
    return needs_of(kind, nodes * DIRECTIONS[kind] / COSTS[kind].dofs)


def cost_text(kind: str, nodes: float) -> str:
    """Return what a mesh of about so many nodes needs, as text."""
    needs = of_nodes(kind, nodes)
    return f"about {two_digits(nodes)} nodes, {two_digits(needs.memory / GIB)} GiB, {two_digits(needs.seconds)} s"


def refuse_large(kind: str, elements: float, size: float) -> None:
    """Raise InputError where a mesh of about so many elements, of edge length `size` [m], exceeds the memory.

    A warning is logged where it takes long: lengths in mm are noticed at once.
    """
    needs = needs_of(kind, elements)
    many, memory, minutes = map(_figure, (elements, needs.memory / GIB, math.ceil(needs.seconds / 60)))
    estimate = f"mesh.size: {size:g} m gives about {many} elements, whose modes need about {memory} GiB of memory and"
    if needs.memory > total_memory():
        raise InputError(
            f"{estimate} {minutes} minutes; this machine has {total_memory() / GIB:.1f} GiB: give a larger size, or"
            " correct the part's lengths, which are in metres"
        )
    if needs.seconds > LONG:
        log.warning("%s %s minutes; lengths are in metres", estimate, minutes)


def two_digits(value: float) -> str:
    """Return a positive number with two digits and commas."""
    return f"{float(f'{value:.2g}'):,.{2 if value < 0.095 else 1 if value < 9.5 else 0}f}"


def _figure(value: float) -> str:
    return f"{value:,.0f}" if 10 <= value < 1e6 else f"{value:.2g}"
