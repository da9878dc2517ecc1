"""Notes on beams and frames that are too short for their theory: each of them can be followed."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.notes.beams import short
from tests.pipeline.facts import of_modes

STEEL = {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}
CIRCLE: dict[str, Any] = {"kind": "circle", "radius": 0.01}
GENERAL: dict[str, Any] = {"kind": "general", "area": 3e-4, "second_moment": 7.9e-9, "height": 0.02}


def hints(section: dict[str, Any], omega: list[float], **geometry: Any) -> list[str]:
    tables = {"kind": "beam", "length": 0.3} | geometry | {"section": section}
    component = Component.model_validate({"geometry": tables, "material": STEEL, "mesh": {"size": 0.01}})
    record: Any = SimpleNamespace(angular_frequencies=np.array(omega), normal_count=len(omega))
    return [*short(of_modes({"rod": record}, {"rod": component}))]


def test_modes_without_a_shear_coefficient_take_one_or_are_fewer() -> None:
    (note,) = hints(GENERAL, [1e3, 1e6])
    key = "component.rod.geometry.section"
    assert note.startswith(f"{key}: 1 of 2 modes have half-waves below 2 times the height of the section")
    assert note.endswith(f"; set {key}.shear_coefficient or component.rod.modes.normal_count = 1")
    assert hints(GENERAL, [1e6])[0].endswith(f"; set {key}.shear_coefficient")
    assert not hints(GENERAL | {"shear_coefficient": 0.8}, [1e3, 1e6])


def test_a_theory_that_is_named_is_meant_and_the_default_has_shear() -> None:
    assert not hints(CIRCLE, [1e3, 1e6], theory="euler-bernoulli")
    assert not hints(CIRCLE, [1e3, 1e6])
    assert not hints(CIRCLE, [1e3, 1e6], motion="space")


def test_short_beams_without_shear_are_named() -> None:
    """E I / (κ G A L²) of a circle: 3 · 2.6 · r² / (4 · 0.9 · L²), 0.0241 of L = 6 h; κ = 5/6 where none is stated."""
    (note,) = hints(CIRCLE, [1e3], length=0.12, theory="euler-bernoulli")
    assert note == (
        "component.rod.geometry: its length, 0.12 m, is 6 times the height of its section; without shear the deflection"
        " of a cantilever of that length is 1.5% too small: set component.rod.geometry.theory = 'timoshenko'"
    )
    assert hints(GENERAL, [1e3], length=0.12)[0].endswith("set component.rod.geometry.section.shear_coefficient")
    assert not hints(CIRCLE, [1e3], length=0.12)
    (note,) = hints(CIRCLE, [1e3], length=0.03)
    assert note.endswith("a beam is longer than twice that: make it a solid, with geometry.kind 'box' or 'cylinder'")


def test_the_shortest_member_of_a_frame_counts() -> None:
    frame: dict[str, Any] = {
        "kind": "frame", "section": CIRCLE, "theory": "euler-bernoulli",
        "nodes": {"a": [0, 0, 0], "b": [1.0, 0, 0], "c": [1.0, 0.1, 0]},
        "members": {"ab": {"start": "a", "end": "b"}, "bc": {"start": "b", "end": "c"}},
    }  # fmt: skip
    component = Component.model_validate({"geometry": frame, "material": STEEL, "mesh": {"size": 0.01}})
    record: Any = SimpleNamespace(angular_frequencies=np.array([1e3]), normal_count=1)
    (note,) = short(of_modes({"frame": record}, {"frame": component}))
    assert note.startswith("component.frame.geometry: its length, 0.1 m, is 5 times the height of its section")
