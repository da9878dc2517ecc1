"""`python -m docs.tools.features`: write docs/features.md, which integrators carry each pair of features."""

import math
from itertools import combinations
from pathlib import Path

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.scene.scene import Scene
from tests.solver.features import CONTRADICTIONS, FEATURES, draft_of

PAGE = Path(__file__).resolve().parents[1] / "features.md"
LETTERS = {"event": "E", "small": "S"}
"""Of bodies that turn by small angles; those of mechanisms are in docs/mechanisms.md."""
HEAD = """# Features of a scene, each with each other

Written by `python -m docs.tools.features` from the scenes of `tests/solver/features.py`, which
`tests/contracts/test_pairs.py` runs. A cell names the integrators that carry both features in one scene: {letters}. A
number refers to the reason below why there is no such scene. Friction and springs act on rigid bodies, unless the
name says otherwise: in a scene with an elastic body on a second, rigid one. Two methods of contact are
two contacts. Bodies turn by small angles here; for others see [mechanisms](mechanisms.md).

"""
NAMES = {
    "gauges": "gauges", "damping": "modal damping", "joint": "slider-crank", "gas": "gas pressure",
    "moving-force": "moving force", "spring": "spring", "spring-dashpot": "spring with dashpot", "gravity": "gravity",
    "elastic-spring": "spring on an elastic body", "table-spring": "spring by a table", "bushing": "bushing",
    "force": "force over time", "motion": "driven motion", "probes": "probes",
    "elastic-friction": "friction on an elastic body",
    "residual": "residual contact", "layer": "surface layer", "linear-law": "linear law", "hertz": "Hertz",
    "hunt-crossley": "Hunt-Crossley", "residual-law": "residual with law", "constraint": "rigid: constraint",
    "impact": "rigid: restitution", "friction": "friction", "belt": "moving obstacle", "two-bodies": "two bodies",
    "facets": "two bodies, meshes that do not match",
    "sliding": "sliding pair", "several-points": "several points", "wave-guide": "wave-guide dashpot",
    "start-rest": "start at rest", "start-undeformed": "start undeformed", "given-step": "given step",
    "automatic-step": "automatic step",
}  # fmt: skip


def page() -> str:
    """Return the text of the page."""
    reasons = list(dict.fromkeys(CONTRADICTIONS.values()))
    letters = ", ".join(f"{letter} `{name}`" for name, letter in LETTERS.items())
    numbers = {name: number for number, name in enumerate(FEATURES, start=1)}
    head = f"| | {' | '.join(map(str, numbers.values()))} |\n|---|{'---|' * len(numbers)}\n"
    cells = {pair: _cell(pair, reasons) for pair in map(frozenset, combinations(FEATURES, 2))}
    rows = [
        f"| {number} {NAMES[name]} | "
        + " | ".join("" if name == other else cells[frozenset((name, other))] for other in FEATURES) + " |\n"
        for name, number in numbers.items()
    ]  # fmt: skip
    notes = [f"\n({number}) {reason}.\n" for number, reason in enumerate(reasons, start=1)]
    return HEAD.format(letters=letters) + head + "".join(rows) + "".join(notes)


def _cell(pair: frozenset[str], reasons: list[str]) -> str:
    """Return the integrators that carry two features, or the number of the reason why there is no such scene."""
    if (reason := CONTRADICTIONS.get(pair)) is not None:
        return f"({reasons.index(reason) + 1})"
    scene = draft_of(pair).scene
    scene["run"].update(integrator="auto")
    carriers = Scene.model_validate(scene).carriers()
    if "given-step" in pair:
        carriers = [name for name in carriers if math.isfinite(INTEGRATORS[name].order)]
    return "".join(LETTERS[name] for name in INTEGRATORS if name in carriers and name in LETTERS)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
