"""Frequencies of parts: beams and bars in closed form, solids and plane parts on fine meshes."""

import math

import numpy as np
from scipy.optimize import brentq

from tests.calibration.case import MATERIALS, STIFF, Case, Draw
from tests.calibration.kinds.loads import clamped_roots

COUNT = 6


def part(geometry: dict, material: dict, size: float, *, count: int = COUNT, supports: list | None = None) -> dict:
    """Return a scene of one part."""
    component = {"geometry": geometry, "material": material, "mesh": {"size": size}, "modes": {"normal_count": count}}
    component["interface"] = {"end": {"surface": "top" if geometry["kind"] != "beam" else "right", "kind": "mean"}}
    if geometry["kind"] == "bar":
        component["interface"] = {"end": {"surface": "right"}}
    if supports:
        component["supports"] = supports
    return {"component": {"b": component}, "body": {"b": {}}, "run": {"duration": 1e-6}}


def beam_modes(draw: Draw) -> Case:
    """A clamped or free plane beam of Euler and Bernoulli."""
    material, length, clamped = draw.of(MATERIALS), draw.between(0.1, 3), draw.chance(0.5)
    height = length / draw.between(20, 100)
    cells = draw.count(4, 12)
    geometry = {"kind": "beam", "theory": "euler-bernoulli", "length": length,
                "section": {"kind": "rectangle", "width": height, "height": height}}  # fmt: skip
    scene = part(geometry, material, length / cells, count=4, supports=["left"] if clamped else None)
    x = clamped_roots(6)
    if not clamped:
        x = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464, 17.278759657399481])
    omega = x**2 / length**2 * math.sqrt(material["E"] * height**2 / 12 / material["rho"])
    return Case(scene, command="frequencies", options={"exact": list(omega / 2 / math.pi)})


def bar_modes(draw: Draw) -> Case:
    """A free bar: n c / 2 L."""
    material, length = draw.of(MATERIALS), draw.between(0.1, 3)
    scene = part({"kind": "bar", "length": length, "area": 1e-4}, material, length / draw.count(8, 60))
    c = math.sqrt(material["E"] / material["rho"])
    return Case(scene, command="frequencies", options={"exact": [c * k / 2 / length for k in range(1, COUNT + 1)]})


def box_modes(draw: Draw) -> Case:
    """A box or a plate, free or clamped, against a fine mesh."""
    material, lx = draw.of(MATERIALS), draw.between(0.01, 0.1)
    ly, lz = lx * draw.between(0.3, 1.0), lx * draw.between(0.3, 4.0)
    scene = part({"kind": "box", "lx": lx, "ly": ly, "lz": lz}, material, ly * draw.between(0.5, 1.0),
                 supports=["bottom"] if draw.chance(0.5) else None)  # fmt: skip
    fine = 0.25 * ly * max(1.0, (lz / ly / 3) ** (1 / 3))
    return Case(scene, command="frequencies", finer={"mesh": {"component.b.mesh.size": fine}})


def plate_modes(draw: Draw) -> Case:
    """A thin plate, free, against a fine mesh."""
    material, lx = draw.of(STIFF), draw.between(0.05, 0.3)
    ly, lz = lx * draw.between(0.5, 1.0), lx * draw.between(0.06, 0.12)
    scene = part({"kind": "box", "lx": lx, "ly": ly, "lz": lz}, material, lz * draw.between(1.0, 2.0))
    return Case(scene, command="frequencies", finer={"mesh": {"component.b.mesh.size": 0.7 * lz}})


def cylinder_modes(draw: Draw) -> Case:
    """A round rod, free or clamped, against a fine mesh."""
    material, radius = draw.of(MATERIALS), draw.between(0.005, 0.05)
    length = radius * draw.between(2.0, 10.0)
    scene = part({"kind": "cylinder", "radius": radius, "length": length}, material, radius * draw.between(0.6, 1.5),
                 supports=["bottom"] if draw.chance(0.5) else None)  # fmt: skip
    fine = 0.33 * radius * max(1.0, length / radius / 6) ** 0.33
    return Case(scene, command="frequencies", finer={"mesh": {"component.b.mesh.size": fine}})


def assembled(draw: Draw) -> Case:
    """`gudgeon linear` of a cantilever with a spring at its tip: roots of its characteristic equation."""
    material, length = draw.of(MATERIALS), draw.between(0.1, 2)
    height = length / draw.between(20, 80)
    geometry = {"kind": "beam", "theory": "euler-bernoulli", "length": length,
                "section": {"kind": "rectangle", "width": height, "height": height}}  # fmt: skip
    scene = part(geometry, material, length / draw.count(5, 16), count=draw.count(4, 8), supports=["left"])
    EI = material["E"] * height**4 / 12
    share = draw.between(0.1, 100.0)
    scene["force"] = {"s": {"kind": "spring", "body": "b", "interface": "end", "direction": [0, 0, 1],
                            "stiffness": share * EI / length**3}}  # fmt: skip

    def characteristic(x: float) -> float:
        c, s, C, S = math.cos(x), math.sin(x), 1.0, math.tanh(x)
        return x**3 * (1 / math.cosh(x) + c * C) + share * (s * C - c * S)

    grid = np.linspace(0.1, 16.0, 4000)
    signs = np.sign([characteristic(x) for x in grid])
    at = np.flatnonzero(signs[1:] * signs[:-1] < 0)[:3]
    x = np.array([brentq(characteristic, grid[k], grid[k + 1], xtol=1e-13) for k in at])
    omega = x**2 / length**2 * math.sqrt(EI / (material["rho"] * height**2))
    return Case(scene, command="linear", options={"exact": list(omega / 2 / math.pi)})


KINDS = {
    "frequencies, beam": beam_modes, "frequencies, bar": bar_modes, "frequencies, box": box_modes,
    "frequencies, plate": plate_modes, "frequencies, cylinder": cylinder_modes,
    "linear": assembled,
}  # fmt: skip
