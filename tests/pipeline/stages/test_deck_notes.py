"""Notes on materials of decks."""

from typing import Any

import pytest

from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.stages.notes.decks import material_note

STEEL = Material(E=2.05e11, nu=0.29, rho=7830.0)
MM = {"E": 2.05e5, "nu": 0.29, "rho": 7.83e-9}


@pytest.mark.parametrize(("deck", "unit", "words"), [
    (MM, 1e-3, None),
    ({"E": 2.05e11, "nu": 0.29, "rho": 7830.0}, 1e-3, None),
    ({"E": 205.0, "rho": 7.83e-6}, 1e-3, None),
    ({"E": 2.973e7, "rho": 7.327e-4}, 0.0254, None),
    ({"nu": 0.29}, 1.0, None),
    ({"E": 2.1e5, "nu": 0.29, "rho": 7.83e-9}, 1e-3, "line 7: the deck's material has E = 2.1e+11 Pa, nu = 0.29, rho ="
     " 7830 kg/m^3, the scene's E = 2.05e+11 Pa, nu = 0.29, rho = 7830 kg/m^3, which hold"),
    ({"E": 7e4, "nu": 0.33}, 1e-3, "line 7: the deck's material has E = 7e+10 Pa, nu = 0.33, the scene's"),
    (MM, 1.0, "the deck's constants are those of mm, t, s: geometry.unit = 0.001 is likely, 1 is used"),
    ({"E": 2.05e5, "rho": 7.83e3}, 1e-3, "are those of no solid in m, kg, s; mm, t, s"),
    ({"anisotropic": 1.0}, 1.0, "the deck's material is not isotropic; E = 2.05e+11 Pa"),
])  # fmt: skip
def test_materials_of_a_deck_that_are_not_the_scenes(deck: dict[str, Any], unit: float, words: str | None) -> None:
    note = material_note({"place": "line 7: ", **deck}, STEEL, unit)
    assert (note is None) if words is None else (words in str(note))


def test_each_of_several_materials_is_one_of_the_scene() -> None:
    scene = STEEL.model_copy(update={"volumes": {"RING": Material(E=7e10, nu=0.33, rho=2700.0)}})
    assert material_note({"place": "", "E": 7e4, "nu": 0.33, "rho": 2.7e-9}, scene, 1e-3) is None
    assert material_note({"place": "", "E": 1.1e5, "nu": 0.34, "rho": 4.4e-9}, scene, 1e-3) is not None
