"""`python -m docs.tools.features`: write docs/features.md, which integrators carry what a scene may have."""

import math
from itertools import combinations
from pathlib import Path

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.scene.scene import Scene
from tests.solver.features import CONTRADICTIONS, FEATURES, draft_of

PAGE = Path(__file__).resolve().parents[1] / "features.md"
SMALL_MOTION = ("event", "small")
"""Of bodies that turn by small angles; those of mechanisms are in docs/mechanisms.md."""
HEAD = """# What goes with what

Bodies that turn by small angles have {parts} features below. **Any two of them go together in one scene**, with
{count} exceptions:

{exceptions}

An integrator carries a scene if it carries each of its features; `run.integrator = "auto"` takes the cheaper of those
that do, and `gudgeon plan SCENE` prints which. `event` moves exactly between located events, `small` by steps.
What bodies have that turn by any angle is in [mechanisms](mechanisms.md).

{tables}
All {pairs} pairs run in `tests/contracts/test_pairs.py`; `python -m docs.tools.features` writes this page from them,
and ends with an error where a pair does not follow these rules. Where a scene needs what a feature does not have (such
as friction of an elastic body whose interface has no tangential rows), one line names the key.
"""
TABLES: dict[str, dict[str, tuple[str, str]]] = {
    "Contacts": {
        "residual": ("on the flexibility of the parts", 'method = "residual"'),
        "layer": ("surface layer alone", "surface_stiffness"),
        "linear-law": ("linear spring and dashpot", 'law.kind = "linear"'),
        "hertz": ("Hertz", 'law.kind = "hertz"'),
        "hunt-crossley": ("Hunt-Crossley and its relatives", 'law.kind = "hunt-crossley"'),
        "residual-law": ("law on the flexibility of the parts", 'method = "residual"` with `law'),
        "constraint": ("rigid, without restitution", 'method = "constraint"'),
        "impact": ("rigid, with restitution", 'method = "impact"'),
        "wave-guide": ("dashpot for waves that the modes do not carry", 'dashpot = "wave-guide"'),
        "several-points": ("several points of one face", "interface.NAME.surface"),
        "two-bodies": ("point on point of another body", 'against.shape = "body"'),
        "facets": ("points on facets of another mesh", 'against.shape = "body"'),
        "sliding": ("sliding far over another body", 'against.shape = "surface"'),
        "belt": ("obstacle that moves", "against.velocity"),
        "friction": ("friction of rigid bodies", "friction"),
        "elastic-friction": ("friction of elastic bodies", "friction"),
    },
    "Forces, joints and motions": {
        "gravity": ("gravity", "run.gravity"),
        "spring": ("spring on a rigid body", 'force.NAME.kind = "spring"'),
        "spring-dashpot": ("spring with dashpot on a rigid body", "damping"),
        "elastic-spring": ("spring on an elastic body", "interface"),
        "table-spring": ("spring by a table", "values"),
        "bushing": ("bushing", 'force.NAME.kind = "bushing"'),
        "force": ("force over time", 'force.NAME.kind = "force"'),
        "moving-force": ("force that travels", 'force.NAME.kind = "moving"'),
        "gas": ("gas pressure", 'force.NAME.kind = "gas"'),
        "joint": ("slider-crank", 'joint.NAME.kind = "slider-crank"'),
        "motion": ("driven motion", "motion.NAME"),
    },
    "Bodies, readings and runs": {
        "damping": ("modal damping", "body.NAME.damping"),
        "gauges": ("strain and stress gauges", "body.NAME.gauges"),
        "probes": ("displacement, velocity, acceleration of a point", "probe.NAME"),
        "start-rest": ("start at rest under the loads", 'run.start = "rest"'),
        "start-undeformed": ("start undeformed", 'run.start = "undeformed"'),
        "given-step": ("step that is given", "run.step"),
        "automatic-step": ("step that follows from the accuracy", "run.accuracy"),
    },
}
"""What each feature is, and the key by which a scene has it."""


def page() -> str:
    """Return the text of the page.

    Raises:
        ValueError: a feature is in no table, or a pair has other integrators than its features have in common.
    """
    named = {name: text for table in TABLES.values() for name, (text, _) in table.items()}
    if named.keys() != FEATURES.keys():
        raise ValueError(f"not in both lists: {sorted(named.keys() ^ FEATURES.keys())}")
    carried = {name: carriers(frozenset({name})) for name in FEATURES}
    pairs = [pair for pair in combinations(FEATURES, 2) if frozenset(pair) not in CONTRADICTIONS]
    for name, other in pairs:
        if carriers(frozenset({name, other})) != carried[name] & carried[other]:
            raise ValueError(f"{name} and {other}: {carriers(frozenset({name, other}))} carry both")
    exceptions = [
        f"- {' and '.join(sorted(named[name] for name in pair))}: {reason}" for pair, reason in CONTRADICTIONS.items()
    ]
    return HEAD.format(
        parts=len(FEATURES), count=len(CONTRADICTIONS), exceptions="\n".join(sorted(exceptions)), pairs=len(pairs),
        tables="\n".join(table_text(title, carried) for title in TABLES),
    )  # fmt: skip


def table_text(title: str, carried: dict[str, set[str]]) -> str:
    """Return a table of features with the integrators that carry each."""
    lines = [
        f"| {text} | `{key}` | {' | '.join('yes' if name in carried[feature] else '–' for name in SMALL_MOTION)} |\n"
        for feature, (text, key) in TABLES[title].items()
    ]
    heads = " | ".join(f"`{name}`" for name in SMALL_MOTION)
    return f"## {title}\n\n| feature | key | {heads} |\n|---|---|---|---|\n{''.join(lines)}"


def carriers(names: frozenset[str]) -> set[str]:
    """Return the integrators of small motion that carry a scene of some features."""
    scene = draft_of(names).scene
    scene["run"].update(integrator="auto")
    found = {name for name in Scene.model_validate(scene).carriers() if name in SMALL_MOTION}
    if "given-step" in names:
        return {name for name in found if math.isfinite(INTEGRATORS[name].order)}
    return found


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
