"""The unit of length that a CAD file states for itself."""

import re
from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.numbers import CAD_KINDS

MODEL_UNIT = 1e-3
"""OpenCASCADE converts STEP and IGES files to millimetres [m]."""
PREFIXES = {
    "": 1.0, "KILO": 1e3, "HECTO": 1e2, "DECA": 1e1, "DECI": 1e-1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6,
    "NANO": 1e-9,
}  # fmt: skip
"""SI prefixes of ISO 10303-41."""
IGES_UNITS = {1: 0.0254, 2: 1e-3, 4: 0.3048, 5: 1609.344, 6: 1.0, 7: 1e3, 8: 2.54e-5, 9: 1e-6, 10: 1e-2, 11: 2.54e-8}
"""Unit flags of the global section, parameter 14 [m]; 3 refers to a name."""
BEGIN, END = "ISO-10303-21;", "END-ISO-10303-21"
"""Of a STEP file, ISO 10303-21."""
INSTANCE = re.compile(r"#(\d+)\s*=\s*([^;]*?LENGTH_UNIT\s*\(\s*\)[^;]*);", re.DOTALL)
SI = re.compile(r"SI_UNIT\s*\(\s*(?:\$|\.(\w*)\.)\s*,\s*\.METRE\.\s*\)")
CONVERSION = re.compile(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'\s*,\s*#(\d+)\s*\)")
MEASURE = re.compile(
    r"#(\d+)\s*=\s*\(?\s*LENGTH_MEASURE_WITH_UNIT\s*\(\s*LENGTH_MEASURE\s*\(\s*([-+.\deE]+)\s*\)\s*,\s*#(\d+)"
)
CONTEXT = re.compile(r"#(\d+)\s*=\s*\([^;]*?GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)")
SHAPE = re.compile(r"SHAPE_REPRESENTATION\s*\(\s*'[^']*'\s*,\s*\([^)]*\)\s*,\s*#(\d+)\s*\)")
AGREE = 1e-6
"""Relative difference of units that are the same: files write an inch as 25.4 or 0.0254."""


def kind_of_file(path: str) -> str:
    """Return STEP, IGES, BREP or gmsh script, by the end of a file's name.

    Raises:
        InputError: it ends in something else.
    """
    ending = Path(path).suffix.lower()
    if ending not in CAD_KINDS:
        allowed = ", ".join(CAD_KINDS)
        others = "meshes are of kind 'file', matrices of kind 'matrices'"
        raise InputError(f"{path}: ends in '{ending}', allowed: {allowed}; {others}")
    return CAD_KINDS[ending]


def stated_unit(path: str) -> float | None:
    """Return the metres per unit of length that a file states; None if it states none.

    Raises:
        InputError: the file is no whole STEP file, or states a unit that is no known length.
    """
    kind = kind_of_file(path)
    if kind == "STEP":
        return _of_step(path, Path(path).read_text(errors="replace"))
    return _of_iges(path) if kind == "IGES" else None


def model_scale(path: str, unit: float | None) -> float:
    """Return the metres per unit of the model that OpenCASCADE makes of a file.

    Args:
        unit: Metres per unit of length of the file that the user gives; it precedes what the file states.

    Raises:
        InputError: neither the file nor the user states the unit.
    """
    if kind_of_file(path) in ("BREP", "gmsh script"):
        if unit is None:
            raise InputError(f"{path}: has no unit of length; give `unit`, the metres per unit: 0.001 for mm")
        return unit
    stated = stated_unit(path)
    if unit is None:
        if stated is None:
            raise InputError(f"{path}: states no unit of length; give `unit`, the metres per unit: 0.001 for mm")
        return MODEL_UNIT
    return MODEL_UNIT * unit / (MODEL_UNIT if stated is None else stated)


def differs(path: str, unit: float | None) -> float | None:
    """Return the unit that a file states [m] if the user gives another one."""
    stated = stated_unit(path)
    return stated if unit is not None and stated is not None and abs(unit / stated - 1) > AGREE else None


def _of_step(path: str, text: str) -> float | None:
    if not text.lstrip("\ufeff \t\r\n").startswith(BEGIN):
        raise InputError(f"{path}: cannot be read as STEP: it does not begin with {BEGIN}")
    if END not in text:
        raise InputError(f"{path}: cannot be read as STEP: it is cut off, {END} is missing at its end")
    measures = {instance: (float(value), unit) for instance, value, unit in MEASURE.findall(text)}
    units = dict(INSTANCE.findall(text))
    based = {measures[match[2]][1] for body in units.values() if (match := CONVERSION.search(body)) and
             match[2] in measures}  # fmt: skip
    contexts = {instance: set(re.findall(r"\d+", members)) for instance, members in CONTEXT.findall(text)}
    of_shapes = set[str]().union(*(contexts.get(context, ()) for context in SHAPE.findall(text))) & units.keys()
    lengths = {_step_unit(path, units[instance], units, measures) for instance in of_shapes or units.keys() - based}
    if len(lengths) > 1:
        have = ", ".join(f"{length:g} m" for length in sorted(lengths))
        raise InputError(f"{path}: states several units of length ({have}); allowed: one")
    return next(iter(lengths), None)


def _step_unit(path: str, body: str, units: dict[str, str], measures: dict[str, tuple[float, str]]) -> float:
    if si := SI.search(body):
        if (prefix := si[1] or "") not in PREFIXES:
            raise InputError(f"{path}: its unit of length has the prefix '{prefix}', allowed: {', '.join(PREFIXES)}")
        return PREFIXES[prefix]
    if (based := CONVERSION.search(body)) and based[2] in measures:
        value, below = measures[based[2]]
        if below in units and value > 0:
            return value * _step_unit(path, units[below], units, measures)
    name = based[1] if based else " ".join(body.split())[:60]
    raise InputError(f"{path}: its unit of length '{name}' is unknown; allowed: metres and what is stated in metres")


def _of_iges(path: str) -> float | None:
    lines = Path(path).read_text(errors="replace").splitlines()
    values = _parameters("".join(line[:72] for line in lines if line[72:73] == "G"))
    flag, name = (values + [""] * 15)[13:15]
    if not flag and not name:
        return None
    if flag == "3" or not flag.isdigit() or int(flag) not in IGES_UNITS:
        raise InputError(f"{path}: its unit of length '{name or flag}' is unknown; allowed: the flags 1, 2 and 4 to 11")
    return IGES_UNITS[int(flag)]


def _parameters(text: str) -> list[str]:
    """Return the parameters of an IGES section; texts are written as 4Hname, the separator is the first parameter."""
    parameters, remaining, separator = [], text, ","
    while remaining and len(parameters) < 20:
        if head := re.match(r"\s*(\d+)H", remaining):
            end = head.end() + int(head[1])
            value, remaining = remaining[head.end() : end], remaining[end + 1 :]
            separator = value if not parameters and len(value) == 1 else separator
        else:
            value, _, remaining = remaining.partition(separator)
        parameters.append(value.strip())
    return parameters
