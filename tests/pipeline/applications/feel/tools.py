"""Tools for tests, made without a scene."""

import numpy as np

from gudgeon.pipeline.applications.feel.coupling import Coupling, Felt, Scales
from gudgeon.pipeline.applications.feel.device import Scripted
from gudgeon.pipeline.applications.feel.loop import run_script
from gudgeon.pipeline.applications.feel.tool import Tool
from gudgeon.solver import core
from gudgeon.solver.forces.fields.co_energy import adhesion_field, grid_field, joined, plates_field

STRENGTH = 0.5 * 8.854e-12 * 1e-8 * 36
"""½ ε A V² of plates [N m²]."""
Z = np.linspace(-1.8e-6, 1.2e-6, 25)
UP = np.array([0.0, 0.0, 1.0])
FIELDS = {
    "plates": plates_field((2e-6, 2e-9), UP, STRENGTH, charged=False),
    "attracted": grid_field({"z": Z}, STRENGTH / (2e-6 + Z), (1e-9, 1e-3)),
    "repelled": grid_field({"z": Z}, -STRENGTH / (2e-6 + Z), (1e-9, 1e-3)),
    "adhesion": adhesion_field(1e-7, UP, 1e-7, 3e-8),
}
WAYS = {"plates": 1e4, "attracted": 1e4, "repelled": 1e4, "adhesion": 1e5}
"""Scales of length."""


def tool(kind: str) -> Tool:
    fields = joined([FIELDS[kind]])
    links = np.concatenate([np.zeros(6), np.eye(3).ravel()])[None]
    active = np.zeros((1, 6))
    active[0, 2 if kind in ("attracted", "repelled") else slice(3)] = 1.0
    return Tool("part", core.Tool(fields, links, np.zeros((6, 6)), active), 3e-6)


def coupling_of(kind: str, device: Scripted, scale: float) -> Coupling:
    return Coupling(tool(kind), device, Scales(scale, WAYS[kind]), 1e-3)


def felt(kind: str, device: Scripted, scale: float, seconds: float) -> tuple[Coupling, list[Felt]]:
    """Return the coupling and what the ticks of a script find."""
    coupling = coupling_of(kind, device, scale)
    return coupling, [one for _, one in run_script(coupling, seconds)]


def gain(kind: str, coupling: Coupling, device: Scripted) -> tuple[float, float]:
    """Return the largest and the last energy that the handle has gained since the start beyond what S has fallen, over
    the energy exchanged; where S has risen, any energy is gained.

    They follow from the handle's own motion and the wrenches that acted on it, not from what the loop knew.
    """
    own, y, net, span = tool(kind), np.zeros(6), list[float](), 0.0
    scale, first = coupling.scales.force * coupling.scales.length, None
    for _time, pose, _, work in device.history:
        energy, _wrench = own.settled(pose / coupling.way, y, coupling.energies)
        first = energy if first is None else first
        fell = scale * (first - energy)
        net.append(work - max(0.0, fell))
        span = max(span, abs(fell), abs(work))
    return max(net) / span, net[-1] / span
