"""Loads: beams, bars and solids under static, sudden, harmonic and moving forces, springs, driven bases."""

import math

import numpy as np
from scipy.optimize import brentq

from tests.calibration.case import MATERIALS, STIFF, Case, Draw, force, probe, rigid


def beam(draw: Draw, slender: float = 30.0, **keys: object) -> tuple[dict, dict]:
    """Return a clamped beam of a rectangle, and its data: L, E, I about y, A, rho, G, kappa."""
    material, length = draw.of(MATERIALS), draw.between(0.1, 2.0)
    height = length / draw.between(slender, 3 * slender)
    width = height * draw.between(0.5, 2.0)
    component = {
        "geometry": {"kind": "beam", "length": length,
                     "section": {"kind": "rectangle", "width": width, "height": height}} | keys,
        "material": material,
        "mesh": {"size": length / draw.count(8, 40)},
        "supports": ["left"],
        "interface": {"tip": {"surface": "right", "kind": "mean"}},
        "modes": {"normal_count": draw.count(5, 14)},
    }  # fmt: skip
    data = material | {"L": length, "A": width * height, "I": width * height**3 / 12, "h": height}
    data |= {"G": material["E"] / 2 / (1 + material["nu"]), "EI": material["E"] * data["I"]}
    return component, data


def clamped_roots(count: int) -> np.ndarray:
    """Return the roots of cos x cosh x = −1."""
    return np.array([brentq(lambda x: math.cos(x) + 1 / math.cosh(x), (k - 1) * math.pi + 1e-9, k * math.pi)
                     for k in range(1, count + 1)])  # fmt: skip


def static_beam(draw: Draw) -> Case:
    """A cantilever under a constant force at its tip, at rest: Euler-Bernoulli."""
    component, d = beam(draw, 5.0, theory="euler-bernoulli")
    exact = draw.between(1e-4, 1e-3) * d["L"]
    F = exact * 3 * d["EI"] / d["L"] ** 3
    scene = {
        "component": {"b": component},
        "body": {"b": {}},
        "force": {"f": force("b", "tip", [0, 0, 1], repr(float(F)))},
        "probe": {"t": probe("displacement", "b", [0, 0, 1], "tip"), "r": {"kind": "force", "of": "body.b"}},
        "run": {"duration": 1e-3},
    }
    return Case(scene, {"t.displacement_end": exact, "t.displacement_peak": exact, "r.force_end": F})


def sudden_beam(draw: Draw) -> Case:
    """A cantilever under a force that acts suddenly, from rest: the sum of its modes."""
    component, d = beam(draw, 20.0, theory="euler-bernoulli")
    x = clamped_roots(60)
    omega = x**2 / d["L"] ** 2 * math.sqrt(d["EI"] / (d["rho"] * d["A"]))
    share = 4.0 / (d["rho"] * d["A"] * d["L"]) / omega**2
    F = draw.between(1e-4, 1e-3) * d["L"] / share.sum()
    duration = draw.between(0.5, 1.5) * 2 * math.pi / omega[0]
    scene = {
        "component": {"b": component},
        "body": {"b": {}},
        "force": {"f": force("b", "tip", [0, 0, 1], repr(float(F)))},
        "probe": {"t": probe("displacement", "b", [0, 0, 1], "tip"), "v": probe("velocity", "b", [0, 0, 1], "tip")},
        "run": {"duration": duration, "start": "undeformed"},
    }
    return Case(scene, histories={
        "t": lambda t: F * (share * (1 - np.cos(np.outer(t, omega)))).sum(axis=1),
        "v": lambda t: F * (share * omega * np.sin(np.outer(t, omega))).sum(axis=1),
    })  # fmt: skip


def harmonic_beam(draw: Draw) -> Case:
    """A cantilever under a harmonic force from rest: the sum of its modes under F sin Ω t."""
    component, d = beam(draw, 20.0, theory="euler-bernoulli")
    x = clamped_roots(60)
    omega = x**2 / d["L"] ** 2 * math.sqrt(d["EI"] / (d["rho"] * d["A"]))
    share = 4.0 / (d["rho"] * d["A"] * d["L"]) / omega**2
    F, drive = draw.between(1e-4, 1e-3) * d["L"] / share.sum(), draw.between(0.3, 8.0) * omega[0]
    duration = draw.between(0.5, 1.5) * 2 * math.pi / omega[0]

    def moved(times: np.ndarray) -> np.ndarray:
        t = times[:, None]
        return F * (share * (np.sin(drive * t) - drive / omega * np.sin(omega * t)) / (1 - drive**2 / omega**2)).sum(1)

    scene = {
        "component": {"b": component},
        "body": {"b": {}},
        "force": {"f": force("b", "tip", [0, 0, 1], f"{float(F)!r} * sin({float(drive)!r} * t)")},
        "probe": {"t": probe("displacement", "b", [0, 0, 1], "tip")},
        "run": {"duration": duration, "start": "undeformed"},
    }
    return Case(scene, histories={"t": moved})


def static_bar(draw: Draw) -> Case:
    """A wire or a bar under an axial force, at rest."""
    component, d = beam(draw, 10.0, motion="space")
    F = draw.between(1e-5, 2e-4) * d["E"] * d["A"]
    scene = {
        "component": {"b": component},
        "body": {"b": {"geometric_stiffness": False}},
        "force": {"f": force("b", "tip", [1, 0, 0], repr(float(F)))},
        "probe": {"t": probe("displacement", "b", [1, 0, 0], "tip")},
        "run": {"duration": 1e-4},
    }
    return Case(scene, {"t.displacement_end": F * d["L"] / d["E"] / d["A"]})


def sudden_bar(draw: Draw) -> Case:
    """A wire that is pulled suddenly at its end: a triangular wave."""
    component, d = beam(draw, 10.0, motion="space")
    component["modes"]["normal_count"] = draw.count(8, 40)
    F = draw.between(1e-5, 2e-4) * d["E"] * d["A"]
    T = d["L"] / math.sqrt(d["E"] / d["rho"])
    duration = draw.between(1.0, 6.0) * T
    static = F * d["L"] / d["E"] / d["A"]
    scene = {
        "component": {"b": component},
        "body": {"b": {}},
        "force": {"f": force("b", "tip", [1, 0, 0], repr(float(F)))},
        "probe": {"t": probe("displacement", "b", [1, 0, 0], "tip"), "v": probe("velocity", "b", [1, 0, 0], "tip")},
        "run": {"duration": duration, "start": "undeformed"},
    }
    return Case(scene, histories={
        "t": lambda t: static * (2 - np.abs((t / T) % 4 - 2)),
        "v": lambda t: static / T * np.where((t / T) % 4 < 2, 1.0, -1.0),
    })  # fmt: skip


def solid_bar(draw: Draw) -> Case:
    """A solid bar without Poisson's contraction under an axial force: exact on any mesh."""
    material, side = draw.of(STIFF) | {"nu": 0.0}, draw.between(0.005, 0.05)
    length, strain = side * draw.between(2.0, 5.0), draw.between(1e-5, 1e-4)
    scene = box_scene(draw, material, side, side, length)
    scene["force"] = {"f": force("b", "end", [0, 0, 1], repr(strain * material["E"] * side * side))}
    scene["probe"] = {"t": probe("displacement", "b", [0, 0, 1], "end")}
    scene["body"]["b"]["geometric_stiffness"] = False
    return Case(scene, {"t.displacement_end": strain * length})


def box_scene(draw: Draw, material: dict, lx: float, ly: float, lz: float) -> dict:
    """Return a box that is clamped at its bottom."""
    component = {
        "geometry": {"kind": "box", "lx": lx, "ly": ly, "lz": lz},
        "material": material,
        "mesh": {"size": min(lx, ly) * draw.between(0.6, 1.0)},
        "supports": ["bottom"],
        "interface": {"end": {"surface": "top", "kind": "mean"}},
        "modes": {"normal_count": draw.count(5, 15)},
    }
    return {"component": {"b": component}, "body": {"b": {}}, "run": {"duration": 1e-4}}


def bent_solid(draw: Draw) -> Case:
    """A solid cantilever under a force across its end: against a fine mesh."""
    side = draw.between(0.01, 0.03)
    material, length = draw.of(STIFF), side * draw.between(2.0, 5.0)
    scene = box_scene(draw, material, side, side * draw.between(0.5, 1.0), length)
    scene["force"] = {"f": force("b", "end", [1, 0, 0], "100")}
    scene["probe"] = {"t": probe("displacement", "b", [1, 0, 0], "end")}
    fine = {"component.b.mesh.size": 0.3 * side * min(1.0, scene["component"]["b"]["geometry"]["ly"] / side)}
    return Case(scene, finer={"mesh": fine}, read=["t.displacement_end"])


def pressed_patch(draw: Draw) -> Case:
    """A block under a force on a patch of its top: against a fine mesh."""
    side, share = draw.between(0.02, 0.06), draw.between(0.2, 0.5)
    material = draw.of(STIFF)
    scene = box_scene(draw, material, side, side, side * draw.between(0.5, 1.0))
    component = scene["component"]["b"]
    component["geometry"]["patch"] = [share * side, share * side]
    component["mesh"]["size"] = side * draw.between(0.2, 0.4)
    component["interface"] = {"end": {"surface": "patch", "kind": "mean"}}
    scene["force"] = {"f": force("b", "end", [0, 0, -1], "1000")}
    scene["probe"] = {"t": probe("displacement", "b", [0, 0, 1], "end")}
    return Case(scene, finer={"mesh": {"component.b.mesh.size": side * 0.1}}, read=["t.displacement_end"])


def oscillator(draw: Draw) -> Case:
    """A rigid mass on a spring and a dashpot under a harmonic force or with a speed."""
    m, k, zeta = draw.between(0.01, 10), draw.between(1e2, 1e7), draw.of([0.0, 0.0, 0.02, 0.2])
    w0 = math.sqrt(k / m)
    T, speed = draw.between(0.5, 6.0) * 2 * math.pi / w0, draw.between(1e-3, 1.0)
    c = 2 * zeta * math.sqrt(k * m)
    drive, F = draw.between(0.3, 2.5) * w0, draw.of([0.0, 1.0]) * speed * w0 * m
    wd = w0 * math.sqrt(1 - zeta**2)
    denominator = complex(k - m * drive**2, c * drive)
    steady = F / denominator  # x = Im(steady exp(i Ω t))
    A, B = -steady.imag, 0.0
    B = (speed - (1j * drive * steady).imag + zeta * w0 * A) / wd

    def moved(t: np.ndarray) -> np.ndarray:
        own = A * np.cos(wd * t) + B * np.sin(wd * t)
        return np.exp(-zeta * w0 * t) * own + (steady * np.exp(1j * drive * t)).imag

    scene = {
        "component": {"p": rigid(m)},
        "body": {"p": {"freedom": ["z"], "velocity": [0, 0, speed]}},
        "force": {"s": {"kind": "spring", "body": "p", "direction": [0, 0, 1], "stiffness": k, "damping": c}},
        "probe": {"d": probe("displacement", "p", [0, 0, 1])},
        "run": {"duration": T},
    }
    if F:
        scene["force"]["f"] = force("p", None, [0, 0, 1], f"{float(F)!r} * sin({float(drive)!r} * t)")
    return Case(scene, histories={"d": moved})


def two_masses(draw: Draw) -> Case:
    """Two rigid bodies on a spring between them, one of which moves."""
    m, M, k, v = draw.between(0.1, 5), draw.between(0.1, 5), draw.between(1e3, 1e7), draw.between(1e-3, 0.5)
    omega = math.sqrt(k * (1 / m + 1 / M))
    T = draw.between(0.5, 5.0) * 2 * math.pi / omega
    centre = m * v / (m + M)
    first = centre * T + M / (m + M) * v / omega * math.sin(omega * T)
    scene = {
        "component": {"a": rigid(m), "b": rigid(M)},
        "body": {"a": {"velocity": [v, 0, 0], "freedom": ["x"]}, "b": {"freedom": ["x"]}},
        "force": {"s": {"kind": "spring", "body": "a", "against": "b", "direction": [1, 0, 0], "stiffness": k}},
        "run": {"duration": T},
    }
    return Case(
        scene,
        {"a.displacement_x": first, "b.displacement_x": centre * T - m / (m + M) * v / omega * math.sin(omega * T)},
    )


def driven_beam(draw: Draw) -> Case:
    """A cantilever whose root moves as 1 − cos: the sum of its modes."""
    component, d = beam(draw, 20.0, theory="euler-bernoulli", motion="space")
    del component["supports"]
    component["interface"]["root"] = {"surface": "left", "kind": "tie", "tie": "rbe2"}
    x = clamped_roots(40)
    omega = x**2 / d["L"] ** 2 * math.sqrt(d["EI"] / (d["rho"] * d["A"]))
    part = tip_participation(x)
    a, drive = draw.between(1e-4, 1e-3) * d["L"], draw.between(0.2, 3.0) * omega[0]
    duration = draw.between(0.5, 1.5) * 2 * math.pi / omega[0]

    def moved(times: np.ndarray) -> np.ndarray:
        t = times[:, None]  # q̈ + ω² q = −part · a Ω² cos Ω t, from rest
        q = -part * a * drive**2 * (np.cos(drive * t) - np.cos(omega * t)) / (omega**2 - drive**2)
        return a * (1 - np.cos(drive * times)) + q.sum(axis=1)

    scene = {
        "component": {"b": component},
        "body": {"b": {}},
        "motion": {"m": {"kind": "translation", "body": "b", "interface": "root", "direction": [0, 0, 1], "held": True,
                         "expression": f"{float(a)!r} * (1 - cos({float(drive)!r} * t))"}},
        "probe": {"t": probe("displacement", "b", [0, 0, 1], "tip")},
        "run": {"duration": duration, "start": "undeformed"},
    }  # fmt: skip
    return Case(scene, histories={"t": moved})


def tip_participation(x: np.ndarray) -> np.ndarray:
    """Return φ(L) ∫φ dx/L of the clamped beam's modes, normal over the length: 4 σ/x, of alternating sign."""
    decay = np.exp(-x)
    sigma = (1 - decay**2 - 2 * decay * np.sin(x)) / (1 + decay**2 + 2 * decay * np.cos(x))
    return 4 * sigma / x * (-1.0) ** np.arange(len(x))


def weighted_beam(draw: Draw) -> Case:
    """A cantilever under its weight, with a strain gauge near its root: w L⁴/8 E I, w (L − x)² z/2 E I."""
    component, d = beam(draw, 15.0, theory="euler-bernoulli")
    place = draw.between(0.1, 0.5) * d["L"]
    component["geometry"]["stations"] = {"g": place}
    component["gauge"] = {"top": {"station": "g", "fibre": "top", "quantity": "strain"}}
    w, g = d["rho"] * d["A"], 1e-4 * 8 * d["EI"] / (d["rho"] * d["A"] * d["L"] ** 3)
    scene = {
        "component": {"b": component},
        "body": {"b": {"gauges": ["top"]}},
        "probe": {"t": probe("displacement", "b", [0, 0, 1], "tip"), "r": {"kind": "force", "of": "body.b"}},
        "run": {"duration": 1e-3, "gravity": [0, 0, -g]},
    }
    strain = w * g * (d["L"] - place) ** 2 / 2 * d["h"] / 2 / d["EI"]
    exact = {"t.displacement_end": -w * g * d["L"] ** 4 / 8 / d["EI"], "b.top.strain_peak": strain}
    return Case(scene, exact)


def sprung_beam(draw: Draw) -> Case:
    """A cantilever that a spring holds at its tip, under a force there, at rest."""
    component, d = beam(draw, 15.0, theory="euler-bernoulli")
    stiffness = 3 * d["EI"] / d["L"] ** 3
    k, moved = stiffness * draw.between(0.1, 10), draw.between(1e-4, 1e-3) * d["L"]
    scene = {
        "component": {"b": component},
        "body": {"b": {}},
        "force": {"f": force("b", "tip", [0, 0, 1], repr(float(moved * (stiffness + k)))),
                  "s": {"kind": "spring", "body": "b", "interface": "tip", "direction": [0, 0, 1], "stiffness": k}},
        "probe": {"t": probe("displacement", "b", [0, 0, 1], "tip"), "r": {"kind": "force", "of": "force.s"}},
        "run": {"duration": 1e-3},
    }  # fmt: skip
    return Case(scene, {"t.displacement_end": moved, "r.force_peak": k * moved})


def twisted(draw: Draw) -> Case:
    """A beam in space under a sudden torque about its axis; against more modes and finer elements."""
    component, d = beam(draw, 10.0, motion="space")
    component["interface"]["tip"] = {"surface": "right", "kind": "tie", "tie": "rbe2"}
    T = d["L"] / math.sqrt(d["G"] / d["rho"])
    scene = {
        "component": {"b": component},
        "body": {"b": {}},
        "force": {"f": {"kind": "wrench", "body": "b", "interface": "tip", "force": [0, 0, 0],
                        "moment": [1e-5 * d["G"] * d["h"] ** 3, 0, 0]}},
        "probe": {"t": probe("rotation", "b", [1, 0, 0], "tip")},
        "run": {"duration": draw.between(1.0, 5.0) * T, "start": "undeformed"},
    }  # fmt: skip
    size = component["mesh"]["size"]
    return Case(scene, finer={"mesh": {"component.b.mesh.size": size / 4}})


def edge_loaded(draw: Draw) -> Case:
    """A plane part under a force across its end; against a fine mesh."""
    side = draw.between(0.01, 0.05)
    length = side * draw.between(2.0, 6.0)
    component = {
        "geometry": {"kind": "rectangle", "lx": length, "ly": side, "thickness": side * draw.between(0.1, 1.0)},
        "material": draw.of(STIFF), "mesh": {"size": side * draw.between(0.3, 0.9)}, "supports": ["left"],
        "interface": {"end": {"surface": "right", "kind": "mean"}}, "modes": {"normal_count": draw.count(5, 15)},
    }  # fmt: skip
    scene = {
        "component": {"b": component}, "body": {"b": {}}, "force": {"f": force("b", "end", [0, 1, 0], "100")},
        "probe": {"t": probe("displacement", "b", [0, 1, 0], "end")}, "run": {"duration": 1e-4},
    }  # fmt: skip
    return Case(scene, finer={"mesh": {"component.b.mesh.size": 0.1 * side}})


KINDS = {
    "beam, static": static_beam,
    "beam, sudden": sudden_beam,
    "beam, harmonic": harmonic_beam,
    "bar, static": static_bar,
    "bar, sudden": sudden_bar,
    "solid bar": solid_bar,
    "solid, bent": bent_solid,
    "solid, patch": pressed_patch,
    "oscillator": oscillator,
    "two masses": two_masses,
    "beam, driven": driven_beam,
    "beam, weight": weighted_beam,
    "beam on spring": sprung_beam,
    "beam, twisted": twisted,
    "plane part": edge_loaded,
}
