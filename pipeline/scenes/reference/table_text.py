"""What a table of a scene takes, in the words of a message, and where a key belongs that stands in the wrong table."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gudgeon.pipeline.scenes.reference.toml import as_toml

EXAMPLES = {
    "Friction": {"static": 0.2},
    "Damping": {"ratio": 0.01, "frequency": 1000.0},
    "MeshSettings": {"size": 0.005},
    "Material": {"E": 210e9, "nu": 0.3, "rho": 7850.0},
    "ModesSettings": {"normal_count": 30},
    "Box": {"kind": "box", "lx": 0.06, "ly": 0.04, "lz": 0.02},
    "Plane": {"shape": "plane", "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]},
    "Hertz": {"kind": "hertz", "stiffness": 1e9},
    "Interface": {"surface": "bottom"},
    "Contact": {"body": "part", "interface": "foot", "against": {"shape": "plane", "point": [0.0, 0.0, 0.0],
                                                                 "normal": [0.0, 0.0, 1.0]}},
    "Body": {"velocity": [0.0, 0.0, -1.0]},
    "Run": {"duration": 1e-3},
}  # fmt: skip
"""Short tables, by the title of their definition."""
ALIASES = {
    "mu": "friction", "density": "rho", "poisson": "nu", "young": "E", "youngs_modulus": "E", "modulus": "E",
    "dt": "step", "timestep": "step", "time": "duration", "t_end": "duration", "initial_velocity": "velocity",
    "stiffness": "surface_stiffness", "mesh_size": "size", "element_size": "size", "modes_count": "normal_count",
    "num_modes": "normal_count", "boundary_conditions": "supports", "fixed": "supports", "omega": "angular_velocity",
}  # fmt: skip
"""Names of other programs and of formulas for keys of a scene."""
LISTED = 6
"""Keys of a table that a message lists."""


def table(schema: Mapping[str, Any], node: Mapping[str, Any]) -> dict[str, Any]:
    """Return the definition of a value; of one with several forms, such as an optional table, that of its table."""
    definition: Any = node
    while "$ref" in definition or ("anyOf" in definition and "properties" not in definition):
        if "$ref" in definition:
            definition = schema["$defs"][definition["$ref"].rsplit("/", 1)[1]]
        else:
            forms = ("$ref", "discriminator", "properties", "additionalProperties", "prefixItems", "items")
            definition = next((n for n in definition["anyOf"] if any(form in n for form in forms)), {})
    return definition


def table_text(schema: Mapping[str, Any], node: Mapping[str, Any], key: str, number: Any = None) -> str:
    """Return the keys of a table with an example; a number that was given instead stands there where one key takes it.

    So `friction = 0.2` has `a table of static, kinetic, direction, such as friction = { static = 0.2 }`.
    """
    definition = table(schema, node)
    if isinstance(below := definition.get("additionalProperties"), dict):  # Members by names of the user.
        kinds = list(_forms(schema, table(schema, below)))
        text = f"a table {key}.NAME for each"
        example = next((EXAMPLES[k["title"]] for k in kinds if k.get("title") in EXAMPLES), None)
        return text if example is None else f"{text}, such as {key}.part = {as_toml(example)}"
    kinds = list(_forms(schema, definition))
    keys = list(definition.get("properties", {}))
    text = "a table of " + ", ".join(keys[:LISTED]) + (", …" if len(keys) > LISTED else "") if keys else "a table"
    example = next((EXAMPLES[k["title"]] for k in kinds if k.get("title") in EXAMPLES), None)
    if example is None:
        return text
    if len(example) == 1 and isinstance(number, int | float) and not isinstance(number, bool):
        example = {name: number if isinstance(value, float | int) else value for name, value in example.items()}
    return f"{text}, such as {key} = {as_toml(example)}"


def homes(schema: Mapping[str, Any], key: str) -> list[str]:
    """Return where in a scene a key stands, as paths such as `contact.NAME.friction`."""
    paths = []
    for name, node in schema.get("properties", {}).items():
        definition = table(schema, node)
        below, path = definition.get("additionalProperties"), name
        if isinstance(below, dict):
            definition, path = table(schema, below), f"{name}.NAME"
        for form in _forms(schema, definition):
            if key in form.get("properties", {}):
                paths.append(f"{path}.{key}")
            for inner_key, inner in form.get("properties", {}).items():
                if any(key in f.get("properties", {}) for f in _forms(schema, table(schema, inner))):
                    paths.append(f"{path}.{inner_key}.{key}")
    return list(dict.fromkeys(paths))


def home_text(schema: Mapping[str, Any], key: str, above: Sequence[str]) -> str:
    """Return where an unknown key belongs, if that is one place or two; empty for keys of many tables.

    Args:
        above: The keys of the table where it stands.
    """
    paths = [p for p in homes(schema, ALIASES.get(key, key)) if p.split(".")[:-1] != list(above)]
    return f"it belongs in {' or '.join(paths)}; " if 0 < len(paths) <= 2 else ""


def _forms(schema: Mapping[str, Any], node: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield a table's definition, or those of all its kinds."""
    kinds = node.get("discriminator", {}).get("mapping")
    if kinds is None:
        yield node
        return
    for reference in kinds.values():
        yield schema["$defs"][reference.rsplit("/", 1)[1]]
