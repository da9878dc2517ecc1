"""Strain gauges on solids and beams: uniform strains, bent beams in closed form, and places that are refused."""

import json
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry import Geometry
from gudgeon.pipeline.interfaces.gauges import gauge_rows
from gudgeon.pipeline.scenes.component import Component

STEEL = {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}
BOX = {"kind": "box", "lx": 0.04, "ly": 0.02, "lz": 0.01}
SECTION = {"kind": "rectangle", "width": 0.012, "height": 0.01}


def rows_of(geometry: dict[str, Any], gauges: dict[str, Any], size: float) -> tuple[Any, dict[str, np.ndarray]]:
    """Return the model of a component and the rows of its gauges."""
    component = Component.model_validate(
        {"geometry": geometry, "material": STEEL, "mesh": {"size": size}, "gauge": gauges}
    )
    mesh = component.geometry.build(size)
    model = build_model(mesh, component.material, geometry=component.geometry)
    return model, {name: rows.toarray() for name, rows in gauge_rows(model, component, "component.part").items()}


@pytest.mark.parametrize("length", [None, 4e-3])
def test_a_uniform_strain_along_any_direction(length: float | None) -> None:
    """nᵀ ε n, exact on straight quadratic elements."""
    line = np.array([2.0, 1.0, 0.0]) / np.sqrt(5)
    gauge = {"point": [0.005, 0.002, 0.01], "direction": [2, 1, 0], "quantity": "strain"}
    gauges = {"g": gauge | ({} if length is None else {"length": length})}
    model, rows = rows_of(BOX, gauges, 0.008)
    A = np.array([[1e-3, 4e-4, 0], [2e-4, -3e-4, 5e-4], [0, 1e-4, 2e-4]])
    moved = (model.nodes @ A.T).ravel()
    assert rows["g"].shape == (1, len(moved))
    assert rows["g"] @ moved == pytest.approx(line @ A @ line, rel=1e-9)


@pytest.mark.parametrize(
    ("gauge", "message"),
    [
        ({"point": [0.0, 0.0, 0.005]}, r"g\.point: \[0\.0, 0\.0, 0\.005\] given, it lies 0\.005 m off the surface"),
        ({"point": [0.0, 0.0, 0.02]}, r"g\.point: .*, it lies 0\.01 m off the surface of the part; its nearest point is"
                                      r" \[0\.0, 0\.0, 0\.01\]"),
        ({"direction": [0, 0, 1]}, r"g\.direction: .* leaves the surface there by 90 degrees, allowed: 5"),
        ({"length": 0.1}, r"g\.length: 0\.1 m given, the grid then leaves the part at"),
    ],
)  # fmt: skip
def test_gauges_off_the_surface_are_refused(gauge: dict[str, Any], message: str) -> None:
    given = {"point": [0.0, 0.0, 0.01], "direction": [1, 0, 0], "quantity": "strain"} | gauge
    with pytest.raises(InputError, match=message):
        rows_of(BOX, {"g": given}, 0.008)


TUBE = {"kind": "liner", "bore_radius": 0.01, "wall": 0.004, "length": 0.03, "flange_height": 0.004,
        "flange_width": 0.004}  # fmt: skip


@pytest.mark.parametrize("radius", [0.01, 0.014])
def test_places_of_a_curved_surface_are_those_of_its_elements(radius: float) -> None:
    """Hollow and round: chords of the elements are half a millimetre off the surface, to which gauges stick."""
    gauge = {"direction": [0, 0, 1], "quantity": "strain"}
    at = radius * np.array([np.cos(0.3), np.sin(0.3)])
    with pytest.raises(InputError, match="its nearest point is") as refused:
        rows_of(TUBE, {"g": gauge | {"point": [*(at * (1 + 100 * (radius - 0.012))), 0.013]}}, 0.006)
    nearest = json.loads(str(refused.value).split("its nearest point is ")[1])
    assert np.hypot(*nearest[:2]) == pytest.approx(radius, rel=2e-3)
    for place in (nearest, [*at, 0.013]):
        model, rows = rows_of(TUBE, {"g": gauge | {"point": place}}, 0.006)
        assert rows["g"] @ (model.nodes * [0.0, 0.0, 1e-3]).ravel() == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize("turned", [False, True])
def test_fibres_of_beams_in_space(turned: bool) -> None:
    """u′ − y v″ − z w″ of a quadratic motion, exact by cubic elements; turned, of a member of a frame along y."""
    names = {"top": (0, 5e-3), "bottom": (0, -5e-3), "left": (6e-3, 0), "right": (-6e-3, 0)}
    gauges = {name: {"station": "mid", "fibre": name, "quantity": "strain"} for name in names}
    gauges |= {"moment": {"station": "mid", "quantity": "bending-moment"}}
    beam = {
        "kind": "beam",
        "theory": "euler-bernoulli",
        "length": 0.3,
        "section": SECTION,
        "motion": "space",
        "stations": {"mid": 0.1},
    }
    frame = {
        "kind": "frame", "theory": "euler-bernoulli", "section": SECTION, "nodes": {"a": [0, 0, 0], "b": [0, 0.3, 0]},
        "members": {"one": {"start": "a", "end": "b", "stations": {"mid": 0.1}}},
    }  # fmt: skip
    model, rows = rows_of(frame if turned else beam, gauges, 0.05)
    x = model.nodes[:, 1 if turned else 0]
    stretch, lateral, high = 1e-4, 0.02, -0.03  # u′, v″, w″
    own = np.stack([stretch * x, lateral * x**2 / 2, high * x**2 / 2, 0 * x, -high * x, lateral * x], axis=1)
    Q = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) if turned else np.eye(3)  # Axis, lateral axis and up as rows.
    moved = np.hstack([own[:, :3] @ Q, own[:, 3:] @ Q]).ravel()
    for name, (y, z) in names.items():
        assert rows[name] @ moved == pytest.approx(stretch - y * lateral - z * high, rel=1e-9)
    assert rows["moment"] @ moved == pytest.approx(2.1e11 * 0.012 * 0.01**3 / 12 * high, rel=1e-9)


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        ({"members": {"one": {"start": "a", "end": "c"}}}, r"one\.end = 'c' given, the frame has the nodes a, b"),
        ({"members": {"one": {"start": "a", "end": "a"}}}, r"one: its start and end are the same point"),
        ({"members": {"one": {"start": "a", "end": "b", "up": [0, 2, 0]}}}, r"one\.up: .* it is along the member"),
        ({"members": {"one": {"start": "a", "end": "b", "stations": {"s": 0.4}}}}, r"one\.stations\.s = 0\.4 given"),
        ({"members": {"one": {"start": "a", "end": "b", "stations": {"a": 0.1}}}}, "'a' names two of its nodes"),
        ({"groups": {"g": ["a", "z"]}}, r"g: \['a', 'z'\] given; name nodes of the frame"),
        ({"section": {"kind": "i-beam", "height": 0.1, "width": 0.05, "flange": 0.005, "web": 0.004}},
         "a frame needs lateral_moment and torsion_constant"),
    ],
)  # fmt: skip
def test_frames_that_are_none_are_refused(geometry: dict[str, Any], message: str) -> None:
    frame = {
        "kind": "frame", "theory": "euler-bernoulli", "section": SECTION, "nodes": {"a": [0, 0, 0], "b": [0, 0.3, 0]},
        "members": {"one": {"start": "a", "end": "b"}},
    }  # fmt: skip
    with pytest.raises(ValueError, match=message):
        TypeAdapter(Geometry).validate_python(frame | geometry)


def test_a_frame_in_pieces_is_refused() -> None:
    frame = {
        "kind": "frame", "theory": "euler-bernoulli", "section": SECTION,
        "nodes": {"a": [0, 0, 0], "b": [0, 0.3, 0], "c": [1, 0, 0], "d": [1, 1, 0]},
        "members": {"one": {"start": "a", "end": "b"}, "two": {"start": "c", "end": "d"}},
    }  # fmt: skip
    with pytest.raises(InputError, match=r"falls into 2 pieces .* or a frame whose pieces an interface of tie 'rbe2'"):
        rows_of(frame, {}, 0.1)
