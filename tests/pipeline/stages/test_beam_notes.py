"""Hints against short half-waves of Euler-Bernoulli beams: each of them can be followed."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.notes.beams import short
from tests.pipeline.facts import of_modes

STEEL = {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}
SECTIONS: dict[str, dict[str, Any]] = {
    "circle": {"kind": "circle", "radius": 0.01},
    "general": {"kind": "general", "area": 3e-4, "second_moment": 7.9e-9, "height": 0.02, "lateral_moment": 7.9e-9,
                "torsion_constant": 1.6e-8},
}  # fmt: skip


def hint(section: str, motion: str, omega: list[float]) -> str:
    geometry = {"kind": "beam", "length": 0.3, "motion": motion, "section": SECTIONS[section]}
    if motion == "plane":
        geometry["section"] = {
            k: v for k, v in SECTIONS[section].items() if k not in ("lateral_moment", "torsion_constant")
        }
    component = Component.model_validate({"geometry": geometry, "material": STEEL, "mesh": {"size": 0.01}})
    record: Any = SimpleNamespace(angular_frequencies=np.array(omega), normal_count=len(omega))
    (note,) = short(of_modes({"rod": record}, {"rod": component}))
    return note.partition(" times; ")[2]


@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize(
    ("omega", "kept"), [([1e3, 1e5, 1e6], "set component.rod.modes.normal_count = 2"), ([1e6, 2e6], "")]
)
def test_a_beam_in_space_is_not_told_to_take_a_theory_that_it_cannot(
    section: str, omega: list[float], kept: str
) -> None:
    solid = "make it a solid, with geometry.kind 'box' or 'cylinder'"
    assert hint(section, "space", omega) == ", or ".join(filter(None, (kept, solid)))


def test_a_beam_in_a_plane_takes_the_theory_with_what_it_needs() -> None:
    assert hint("circle", "plane", [1e6]) == "set 'timoshenko'"
    assert hint("general", "plane", [1e6]) == "set 'timoshenko' and geometry.section.shear_coefficient"
    kept = "set component.rod.modes.normal_count = 1"
    assert hint("circle", "plane", [1e3, 1e6]) == f"set 'timoshenko', or {kept}"


def test_a_theory_that_is_named_is_meant() -> None:
    geometry = {"kind": "beam", "length": 0.3, "section": SECTIONS["circle"], "theory": "euler-bernoulli"}
    component = Component.model_validate({"geometry": geometry, "material": STEEL, "mesh": {"size": 0.01}})
    record: Any = SimpleNamespace(angular_frequencies=np.array([1e3, 1e6]), normal_count=2)
    assert not [*short(of_modes({"rod": record}, {"rod": component}))]
