"""Notes on decks: constants of their materials that differ from the scene's, and the unit of length they tell."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gudgeon.pipeline.scenes.material import LIKELY, Material
from gudgeon.pipeline.stages.notes.facts import Parts

SYSTEMS: Mapping[str, tuple[float, float, float]] = {
    "m, kg, s": (1.0, 1.0, 1.0), "mm, t, s": (1e6, 1e12, 1e-3), "mm, kg, ms": (1e9, 1e9, 1e-3),
    "mm, kg, s": (1e3, 1e9, 1e-3), "cm, g, s": (0.1, 1e3, 0.01), "in, lbf, s": (6894.757293, 1.06868967e7, 0.0254),
}  # fmt: skip
"""Systems of units of decks: Pa and kg/m³ per unit of modulus and of density, and m per unit of length."""
EQUAL = 0.01
"""Relative difference of constants that is none: handbooks differ by as much."""
UNITS = {"E": "Pa", "nu": "", "rho": "kg/m^3"}


def deck_materials(facts: Parts) -> Iterator[str]:
    """Yield a line for each material of a deck that the scene has not, and where its constants are of another unit."""
    for name, component in facts.components.items():
        if not component.from_file or component.material is None:
            continue
        remarks = facts.store.get(facts.meshes[name], "mesh", only=["remarks"]).remarks
        unit = getattr(component.geometry, "unit", None)
        for material in remarks.get("materials", []):
            if (text := material_note(material, component.material, unit)) is not None:
                yield f"component.{name}: {text}"


def material_note(deck: Mapping[str, Any], scene: Material, unit: float | None) -> str | None:
    """Return a line if a deck's constants differ from the scene's, None otherwise.

    Args:
        deck: `place`, and E, nu, rho, anisotropic where the deck states them, in its units.
        scene: The component's material.
        unit: Metres per unit of length, as the scene has it.
    """
    prefix = f"geometry: {deck['place']}"
    if "anisotropic" in deck or not deck.keys() & {"E", "rho"}:
        return _isotropic_note(deck, scene, prefix)
    fitting = [system for system in SYSTEMS if _fits(deck, system)]
    consistent = [system for system in fitting if SYSTEMS[system][2] == unit]
    if not fitting or (unit == 1.0 and not consistent and {"E", "rho"} <= deck.keys()):
        return prefix + _unit_note(deck, fitting)
    materials = [scene, *scene.volumes.values()]
    if any(_equal(_constants(deck, system), material) for system in fitting for material in materials):
        return None
    return f"{prefix}the deck's material has {_difference(_constants(deck, (consistent or fitting)[0]), scene)}"


def _isotropic_note(deck: Mapping[str, Any], scene: Material, prefix: str) -> str | None:
    if "anisotropic" not in deck or any(m.orthotropic is not None for m in (scene, *scene.volumes.values())):
        return None
    return f"{prefix}the deck's material is not isotropic; E = {scene.E:g} Pa, nu = {scene.nu:g} of the scene hold"


def _unit_note(deck: Mapping[str, Any], fitting: Sequence[str]) -> str:
    if not fitting:
        return f"the deck's {_text(deck, {})} are those of no solid in {'; '.join(SYSTEMS)}; the scene's constants hold"
    length = SYSTEMS[fitting[0]][2]
    return f"the deck's constants are those of {fitting[0]}: geometry.unit = {length:g} is likely, 1 is used"


def _difference(constants: Mapping[str, float], scene: Material) -> str:
    scene_text = _text({key: getattr(scene, key) for key in constants}, UNITS)
    return f"{_text(constants, UNITS)}, the scene's {scene_text}, which hold"


def _fits(deck: Mapping[str, Any], system: str) -> bool:
    """Return whether constants are those of a solid in a system of units."""
    constants = _constants(deck, system)
    within = [LIKELY[key][0] <= constants[key] <= LIKELY[key][1] for key in ("E", "rho") if key in constants]
    if {"E", "rho"} <= constants.keys() and constants["rho"] > 0:
        low, high = LIKELY["speed"]
        within.append(low <= abs(constants["E"] / constants["rho"]) ** 0.5 <= high)
    return bool(within) and all(within)


def _constants(deck: Mapping[str, Any], system: str) -> dict[str, float]:
    """Return E [Pa], nu and rho [kg/m^3] where a deck states them."""
    modulus, density, _ = SYSTEMS[system]
    scales = {"E": modulus, "nu": 1.0, "rho": density}
    return {key: deck[key] * scale for key, scale in scales.items() if key in deck}


def _equal(constants: Mapping[str, float], material: Material) -> bool:
    return all(abs(value - getattr(material, key)) <= EQUAL * abs(value) for key, value in constants.items())


def _text(constants: Mapping[str, Any], units: Mapping[str, str]) -> str:
    words = [f"{key} = {constants[key]:g} {units.get(key, '')}".strip() for key in UNITS if key in constants]
    return ", ".join(words)
