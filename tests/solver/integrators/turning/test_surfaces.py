"""Points of one turning body on the surface of another: closed forms, other solutions, conservation, refusals."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import InterfaceModes, ModalRecord, MorphRecord, TractionModes
from gudgeon.modaldb.records.tangents import tangents
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.errors import SceneError
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.integrators.turning.flexible_scenes import cloud
from tests.solver.systems import build_all, rigid_records

EXTENT, CELLS = 0.5, 10
"""Half the extent of the bowl [m], and cells of its height."""
STIFFNESS = 1e6
DOWN = [0.0, 0.0, -9.81]


def bowl(curvature: float, *, extent: float = EXTENT) -> Json:
    """Return the chart of z = ½ curvature (x² + y²), which splines have exactly."""
    step = 2 * extent / CELLS
    knots = -extent + step * (np.arange(CELLS + 3) - 1)
    X, Y = np.meshgrid(knots, knots, indexing="ij")
    height = 0.5 * curvature * (X**2 + Y**2 - 2 * step**2 / 3)
    return {
        "kind": "patch", "origin": [0.0] * 3, "normal": [0.0, 0.0, 1.0], "across": [1.0, 0.0, 0.0],
        "along": [0.0, 1.0, 0.0], "low": [-extent] * 2, "step": [step] * 2, "counts": [CELLS + 3] * 2,
        "heights": height.ravel().tolist(), "cover": [1] * CELLS**2,
    }  # fmt: skip


def with_space(records: tuple[ModalRecord, MorphRecord], chart: Json) -> tuple[ModalRecord, MorphRecord]:
    """Give a rigid body a traction space `top`."""
    modal, morph = records
    size = CELLS + 3
    extent, f, m = -chart["low"][0], size * size, len(modal.angular_frequencies)
    space = TractionModes(
        chart, np.full(2, -extent), np.full(2, 2 * extent / CELLS), np.full(2, size), np.zeros((f, m)), np.zeros((f, 6))
    )
    return replace(modal, tractions={"top": space}), morph


def system_of(folder: Path, points: list[list[float]], chart: Json, bodies: dict[str, Any], **tables: Any) -> System:
    """Return a compiled scene of a part with points and a base with a surface."""
    mass = {name: bodies[name].pop("mass", 2.0) for name in ("part", "base")}
    foot = (points, [0.0, 0.0, -1.0])
    records = {
        "part": rigid_records(mass["part"], {"foot": foot}, (0.02, 0.03, 0.04)),
        "base": with_space(rigid_records(mass["base"], {}, (0.5, 0.6, 0.7)), chart),
    }
    law = {"method": "penalty", "law": {"kind": "linear", "stiffness": STIFFNESS}}
    contact = {"body": "part", "interface": "foot", "against": {"shape": "surface", "body": "base", "interface": "top"}}
    contact |= tables.pop("contact", law)
    run = {"integrator": "turning", "samples": 200, "frames": 2} | tables.pop("run", {})
    return build_all(folder, records, {"body": bodies, "contact": {"touch": contact}, "run": run} | tables)


def solved(*given: Any, **tables: Any) -> Trajectory:
    found = simulate(system_of(*given, **tables))
    assert found.result == "FINISHED", (found.result, found.energy_drift)
    return found


HELD = {"hold": {"kind": "fixed", "body": "base"}}


def test_a_bead_swings_in_a_bowl(tmp_path: Path) -> None:
    """It slides on the moving normal, without friction, as ω² = g κ says of small swings; the law is stiff."""
    curvature, place, duration = 0.5, 0.01, 0.5
    deep = 2.0 * 9.81 / STIFFNESS
    part = {"position": [place, 0.0, 0.5 * curvature * place**2 + 1e-9]}
    run = {"duration": duration, "gravity": DOWN, "samples": 20}
    law = {"kind": "linear", "stiffness": STIFFNESS, "damping": 2 * np.sqrt(2.0 * STIFFNESS)}
    found = solved(
        tmp_path, [[0.0, 0.0, 0.0]], bowl(curvature), {"part": part, "base": {}}, run=run, joint=HELD,
        contact={"method": "penalty", "law": law},
    )  # fmt: skip
    x, z = found.motion["part"][-1, [0, 2]]
    assert place + x == pytest.approx(place * np.cos(np.sqrt(9.81 * curvature) * duration), rel=2e-3)
    assert 0.5 * curvature * place**2 + z - 0.5 * curvature * (place + x) ** 2 == pytest.approx(-deep, rel=1e-2)


def test_tumbling_bodies_keep_energy_and_momenta(tmp_path: Path) -> None:
    part = {"position": [0.05, 0.02, 0.02], "velocity": [0.5, 0.1, -1.0], "angular_velocity": [1.0, 2.0, 0.5]}
    base = {"angular_velocity": [0.3, -0.4, 0.2], "mass": 3.0}
    points = [[0.0, 0.0, 0.0], [0.02, 0.0, -0.001]]
    run = {"duration": 0.03, "samples": 10}
    found = solved(tmp_path, points, bowl(0.5), {"part": part, "base": base}, run=run)
    assert found.quantities["touch.impulse"]["value"] == pytest.approx(2.568, rel=1e-3)
    assert found.energy_drift < 1e-8
    assert found.momentum_residual < 1e-11


@pytest.mark.parametrize("damping", [20.0, 200.0, 2000.0])
def test_what_a_dashpot_leaves_in_a_surface_is_lost(damping: float, tmp_path: Path) -> None:
    """A contact ends where spring and dashpot cancel, at a depth from which its surface recovers by itself."""
    part = {"position": [0.05, 0.02, 0.02], "velocity": [0.5, 0.1, -1.0], "angular_velocity": [1.0, 2.0, 0.5]}
    base = {"angular_velocity": [0.3, -0.4, 0.2], "mass": 3.0}
    law = {"method": "penalty", "law": {"kind": "linear", "stiffness": STIFFNESS, "damping": damping}}
    run = {"duration": 0.03, "samples": 10, "checks": False}
    found = solved(
        tmp_path, [[0.0, 0.0, 0.0]], bowl(0.5), {"part": part, "base": base}, run=run, contact=law
    )  # fmt: skip
    assert found.energy_drift < 1e-6
    assert found.momentum_residual < 1e-11


def test_friction_stops_what_slides(tmp_path: Path) -> None:
    """v² = v₀² − 2 μ g s on a flat surface, as Coulomb's, and the work of friction is the energy that is lost."""
    points = [[x, y, 0.0] for x in (-0.02, 0.02) for y in (-0.02, 0.02)]
    law = {"kind": "linear", "stiffness": STIFFNESS, "damping": 2e3}
    rubbed = {"method": "penalty", "law": law, "friction": {"static": 0.3, "speed": 1e-3}}
    part = {"position": [-0.2, 0.0, 1e-9], "velocity": [1.0, 0.0, 0.0]}
    run = {"duration": 0.1, "gravity": DOWN, "samples": 20}
    found = solved(tmp_path, points, bowl(0.0), {"part": part, "base": {}}, run=run, joint=HELD, contact=rubbed)
    assert found.motion["part"][-1, 6] == pytest.approx(1.0 - 0.3 * 9.81 * 0.1, rel=1e-2)
    lost = 0.5 * 2.0 * (1.0 - found.motion["part"][-1, 6] ** 2)
    assert found.quantities["touch.friction_work"]["value"] == pytest.approx(lost, rel=1e-2)


def test_what_runs_off_ends_with_when_and_where(tmp_path: Path) -> None:
    part = {"position": [0.45, 0.0, 1e-9], "velocity": [1.0, 0.0, 0.0]}
    run = {"duration": 0.2, "gravity": DOWN}
    law = {"method": "penalty", "law": {"kind": "linear", "stiffness": STIFFNESS, "damping": 2e3}}
    system = system_of(
        tmp_path, [[0.0, 0.0, 0.0]], bowl(0.0), {"part": part, "base": {}}, run=run, joint=HELD, contact=law
    )  # fmt: skip
    found = simulate(system)
    assert found.result == "SURFACE_LEFT"
    assert "contact.touch: a point left the surface 'top' of body 'base' at 0.05" in str(found.counts["reason"])


@pytest.mark.parametrize(
    ("chart", "contact", "words"),
    [
        ({"kind": "cylinder", "axis": [0.0, 1.0, 0.0], "origin": [0.0] * 3, "radius": 1.0, "middle": 0.0}, {},
         r"contact\.touch\.against\.interface: 'top' is a traction space on a cylinder, which points"),
        ({}, {"method": "residual", "law": {"kind": "hertz", "stiffness": 1e6}},
         r"contact\.touch\.law: 'hertz' given with method 'residual'"),
        ({}, {"method": "residual"}, r"contact\.touch\.surface_stiffness: is missing; contact of rigid bodies"),
    ],
)  # fmt: skip
def test_what_is_refused(chart: Json, contact: dict[str, Any], words: str, tmp_path: Path) -> None:
    bodies = {"part": {"position": [0.0, 0.0, 0.1]}, "base": {}}
    given = {"contact": contact} if contact else {}
    with pytest.raises(SceneError, match=words):
        simulate(system_of(tmp_path, [[0.0, 0.0, 0.0]], bowl(0.0) | chart, bodies, run={"duration": 0.1}, **given))


def test_a_patch_needs_bodies_that_turn(tmp_path: Path) -> None:
    bodies, layer = {"part": {"position": [0.0, 0.0, 0.1]}, "base": {}}, {"surface_stiffness": 1e9}
    run = {"integrator": "small", "duration": 0.1}
    with pytest.raises(SceneError, match=r"contact\.touch\.against\.interface: it is a patch, which the normals"):
        system_of(tmp_path, [[0.0, 0.0, 0.0]], bowl(0.0), bodies, contact=layer, run=run)


def test_what_starts_inside_is_refused(tmp_path: Path) -> None:
    bodies = {"part": {"position": [0.0, 0.0, -0.01]}, "base": {}}
    with pytest.raises(SceneError, match=r"1 of 1 points start inside the obstacle, the worst by 0\.01 m"):
        simulate(system_of(tmp_path, [[0.0, 0.0, 0.0]], bowl(0.0), bodies, run={"duration": 0.1}))


def elastic(frequencies: list[float], points: list[list[float]], chart: Json, seed: int) -> Any:
    """Return records of point masses with any rows and any R of contact points `foot` and of a surface `top`."""
    modal, morph = cloud(np.array(frequencies), seed=seed)
    rng, m, c = np.random.default_rng(seed), len(frequencies), len(points)
    space = with_space((modal, morph), chart)[0].tractions["top"]
    knots = (np.arange(CELLS + 3) - 1) / CELLS * 2 * EXTENT - EXTENT
    centres = np.stack(np.meshgrid(knots, knots, indexing="ij"), axis=-1).reshape(-1, 2)
    apart = np.linalg.norm(centres[:, None] - centres, axis=2)
    waves = np.cos(centres @ rng.uniform(2, 9, (2, m)) + rng.uniform(0, 6, m))
    force = np.column_stack([np.tile([0.0, 0.0, 1.0], (space.size, 1)), np.zeros((space.size, 3))])
    space = replace(space, rows=0.3 * waves, resultant=force)
    normals = np.tile([0.0, 0.0, -1.0], (c, 1))
    rows, root = 0.3 * rng.standard_normal((c, m)), rng.standard_normal((c, c))
    foot = InterfaceModes(
        np.arange(c), np.array(points), normals, np.full(c, 1e-4), np.zeros(c, bool), rows, tangents(normals),
        0.3 * rng.standard_normal((c, 2, m)),
    )  # fmt: skip
    R = np.zeros((6 + 3 * c + space.size,) * 2)
    R[6 : 6 + c, 6 : 6 + c] = 1e-7 * (root @ root.T / c + 0.2 * np.eye(c))
    at = 6 + c
    R[at : at + space.size, at : at + space.size] = 1e-6 * np.exp(-((apart / 0.1) ** 2))
    spans = {"pin": [0, 6], "foot": [6, 6 + c], "top": [at, at + space.size]}
    modal = replace(
        modal, interfaces={"foot": foot}, tractions={"top": space}, interface_rows=spans, residual_flexibility=R,
        tangential_spans={"foot": [at + space.size, at + space.size + 2 * c]},
    )  # fmt: skip
    return modal, replace(morph, points={"foot": np.array(points)})


DAMPED = {"method": "penalty", "law": {"kind": "hunt-crossley", "stiffness": 1e7, "restitution": 0.7}}


@pytest.mark.parametrize(
    "method", [{"method": "residual"}, {"method": "residual", "surface_stiffness": 1e10}, DAMPED],
    ids=["R", "layer", "damped"],
)  # fmt: skip
def test_flexibility_of_both_bodies_keeps_momenta_and_energy(method: dict[str, Any], tmp_path: Path) -> None:
    """Any rows and R, bodies that tumble and vibrate: what slides over splines does the work that they give back."""
    points, chart = [[0.0, 0.0, -0.1], [0.03, 0.01, -0.11], [-0.02, 0.03, -0.1]], bowl(0.5)
    records = {
        "part": elastic([300.0, 700.0], points, chart, 1), "base": elastic([250.0, 900.0, 1100.0], points, chart, 2)
    }  # fmt: skip
    bodies = {
        "part": {"position": [0.05, 0.02, 0.112], "velocity": [3.0, 0.5, -1.0], "angular_velocity": [1.0, 2.0, 0.5]},
        "base": {"angular_velocity": [0.3, -0.4, 0.2]},
    }
    contact = {"body": "part", "interface": "foot", "against": {"shape": "surface", "body": "base", "interface": "top"}}
    run = {"integrator": "turning", "samples": 20, "frames": 2, "duration": 0.02}
    found = simulate(build_all(tmp_path, records, {"body": bodies, "contact": {"touch": contact | method}, "run": run}))
    assert found.result == "FINISHED", found.energy_drift
    assert found.quantities["touch.impulse"]["value"] > 0.1
    assert found.energy_drift < 1e-8
    assert found.momentum_residual < 1e-10


def coupled(records: tuple[ModalRecord, MorphRecord], seed: int) -> tuple[ModalRecord, MorphRecord]:
    """Couple the points and the surface of a body in R, which stays positive semidefinite."""
    modal, morph = records
    spans = modal.interface_rows
    foot, top = slice(*spans["foot"]), slice(*spans["top"])
    assert modal.residual_flexibility is not None
    R = modal.residual_flexibility.copy()
    values, vectors = np.linalg.eigh(R[top, top])
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    turn = np.linalg.qr(np.random.default_rng(seed).standard_normal((len(root), foot.stop - foot.start)))[0]
    R[top, foot] = 0.6 * root @ turn @ np.linalg.cholesky(R[foot, foot]).T
    R[foot, top] = R[top, foot].T
    assert np.abs(R[foot, top]).max() > 0.05 * np.abs(R[foot, foot]).max()
    return replace(modal, residual_flexibility=R), morph


def test_a_body_that_meets_itself_keeps_momenta_and_energy(tmp_path: Path) -> None:
    """Struck by another on the surface that its own points meet, all coupled by R, while both tumble."""
    chart, below = bowl(0.5), [[0.0, 0.0, -0.1], [0.03, 0.01, -0.11], [-0.02, 0.03, -0.1]]
    above = [[x, y, 0.25 * (x * x + y * y) + 2e-5] for x, y in ((0.06, 0.0), (0.09, 0.03), (0.05, -0.04))]
    records = {
        "part": elastic([300.0, 700.0], below, chart, 1),
        "fork": coupled(elastic([250.0, 900.0, 1100.0], above, chart, 2), 3),
    }
    bodies = {
        "part": {"position": [0.05, 0.02, 0.112], "velocity": [3.0, 0.5, -1.0], "angular_velocity": [1.0, 2.0, 0.5]},
        "fork": {"angular_velocity": [0.3, -0.4, 0.2]},
    }
    surface = {"shape": "surface", "body": "fork", "interface": "top"}
    contacts = {name: {"body": body, "interface": "foot", "against": surface, "method": "residual"}
                for name, body in (("strike", "part"), ("own", "fork"))}  # fmt: skip
    run = {"integrator": "turning", "samples": 20, "frames": 2, "duration": 0.02}
    found = simulate(build_all(tmp_path, records, {"body": bodies, "contact": contacts, "run": run}))
    assert found.result == "FINISHED", found.energy_drift
    assert found.quantities["strike.impulse"]["value"] > 0.1
    assert found.quantities["own.impulse"]["value"] > 0.1
    assert found.energy_drift < 1e-8
    assert found.momentum_residual < 1e-10
