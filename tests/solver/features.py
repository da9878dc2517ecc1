"""Scenes of every pair of features: small bodies, thrown at walls along x, with what each feature adds to them.

A scene has a body `part`, elastic where a feature needs it, and a rigid body `mate` where one needs that and `part` is
elastic, or where two bodies touch.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import GaugeModes, InterfaceModes, LoadModes, ModalRecord, MorphRecord, TractionModes
from gudgeon.modaldb.stores.base import Store
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System
from tests.solver.systems import keys_of, stored, with_tangential_rows

MASS, HALF, MODES = 2.0, 0.05, 3
"""Of each body [kg], half its edge [m], kept modes of an elastic one."""
GAP, SPEED, DURATION, STEP = 2e-5, 0.2, 1e-3, 1e-6
"""Before contact [m], towards it [m/s]; of a run and of its given step [s]."""
PIN = (1e-3, 0.0, 0.01)
"""Point of a body that a joint holds [m]."""
SPACING, COUNT = 0.02, 7
"""Of the knots of the traction space [m], and functions along each of its sides."""
PLACES = {
    "a": (0.02, 0.01), "b": (-0.02, 0.01), "c": (0.0, -0.02), "d": (0.01, 0.03),
}  # fmt: skip
"""y and z of single points on either side [m]."""
CORNERS = tuple((y, z) for y in (-0.04, 0.04) for z in (-0.04, 0.04))
Table = dict[str, Any]


def records(*, elastic: bool) -> tuple[ModalRecord, MorphRecord]:
    """A cube with points on its sides along x, a pin, a crown, a traction space on its left side and gauges."""
    rng, modes = np.random.default_rng(3), MODES if elastic else 0
    places: dict[str, np.ndarray] = {}
    for side, sign in (("right", 1.0), ("left", -1.0)):
        for name, (y, z) in PLACES.items():
            places[f"{side}-{name}"] = np.array([[sign * HALF, y, z]])
        places[f"{side}-corners"] = np.array([[sign * HALF, y, z] for y, z in CORNERS])
    counts = {name: len(at) for name, at in places.items()} | {"pin": 3, "crown": 1, "top": COUNT**2}
    ends = np.cumsum([0, *counts.values()]).tolist()
    rows = {name: [first, last] for name, first, last in zip(counts, ends, ends[1:], strict=False)}
    units = np.ones(ends[-1])
    units[rows["crown"][0]] = 1e-3
    shapes = units[:, None] * rng.standard_normal((ends[-1], modes)) * 0.5
    root = units[:, None] * rng.standard_normal((ends[-1], 2 * ends[-1]))
    R = 1e-9 * root @ root.T / (2 * ends[-1]) if elastic else None
    interfaces = {
        name: InterfaceModes(
            np.arange(len(at)), at, np.tile([np.sign(at[0, 0]), 0.0, 0.0], (len(at), 1)), np.full(len(at), 1e-4),
            np.zeros(len(at), bool), shapes[slice(*rows[name])],
            facets=np.array([[0, 2, 1] if at[0, 0] > 0 else [0, 1, 2]]) if len(at) > 1 else None,
        )
        for name, at in places.items()
    }  # fmt: skip
    pin = np.array(PIN)
    loads = {
        "pin": LoadModes(shapes[slice(*rows["pin"])], np.column_stack([np.eye(3), np.cross(pin, np.eye(3))]), pin, "N"),
        "crown": LoadModes(shapes[slice(*rows["crown"])], np.array([[-1e-3, 0, 0, 0, 0, 0]]), np.zeros(3), "Pa"),
    }
    chart = {
        "kind": "plane",
        "origin": [-HALF, 0, 0],
        "normal": [-1.0, 0, 0],
        "across": [0, 1.0, 0],
        "along": [0, 0, 1.0],
    }
    start = np.full(2, -2 * SPACING)
    knots = (np.arange(COUNT) - 1) * SPACING + start[0]
    at = np.array([[-HALF, y, z] for y in knots for z in knots])
    down = np.tile([-1.0, 0, 0], (COUNT**2, 1))
    space = TractionModes(
        chart, start, np.full(2, SPACING), np.array([COUNT, COUNT]), shapes[slice(*rows["top"])],
        np.column_stack([down, np.cross(at, down)]),
    )  # fmt: skip
    gauges = {}
    if elastic:
        values, quasi = rng.standard_normal((6, modes)), 1e-3 * rng.standard_normal((6, ends[-1]))
        gauges = {"strain": GaugeModes(values, quasi, "Pa")}
    centre, inertia = np.zeros(3), np.diag([4e-3, 3e-3, 4e-3])
    twists = np.diag(np.concatenate([np.full(3, MASS), inertia.diagonal()]) ** -0.5)
    omega = np.array([9e3, 1.4e4, 2.3e4])[:modes]
    modal = ModalRecord(
        "mesh", "macneal" if elastic else "rigid", modes, 0, omega, MASS, centre, inertia, twists, interfaces,
        rows, R, None, None, {}, {"top": space}, loads, gauges,
    )  # fmt: skip
    for seed, name in enumerate(places if elastic else ()):
        modal = with_tangential_rows(modal, name, seed)
    if elastic:  # A gauge has a quasi-static value for each row.
        gauges["strain"] = replace(gauges["strain"], residual=1e-3 * rng.standard_normal((6, modal.row_count)))
        modal = replace(modal, gauges=gauges)
    return modal, MorphRecord("mesh", "modes", "none", places, MASS, centre, inertia, twists, None, {})


@dataclass
class Draft:
    """A scene in the making."""

    names: frozenset[str]
    elastic: bool
    scene: Table = field(default_factory=dict)
    used: int = 0

    @property
    def firm(self) -> str:
        """The rigid body."""
        return "mate" if self.elastic else "part"

    @property
    def rubs(self) -> Table:
        """Friction, and the obstacle's velocity, of contacts that can have them."""
        return {"friction": {"static": 0.3, "kinetic": 0.2}} if "friction" in self.names else {}

    @property
    def own_rubs(self) -> Table:
        """Friction of the contacts of an elastic body."""
        return {"friction": {"static": 0.3, "kinetic": 0.2}} if "elastic-friction" in self.names else {}

    def wall(self, body: str, *, corners: bool = False, **settings: Any) -> None:
        """Add a contact of a body with the wall to its right."""
        name = "corners" if corners else list(PLACES)[self.used]
        self.used += not corners
        plane: Table = {"shape": "plane", "point": [self.face(body), 0, 0], "normal": [-1, 0, 0]}
        if "belt" in self.names:
            plane["velocity"] = [0, 0.1, 0.05]
        given: Table = {"body": body, "interface": f"right-{name}", "against": plane, "method": "residual"}
        self.scene["contact"][f"wall-{name}-{len(self.scene['contact'])}"] = given | settings

    def face(self, body: str) -> float:
        """Return where a body's wall stands [m]."""
        return self.scene["body"][body].get("position", [0.0])[0] + HALF + GAP


ELASTIC = frozenset(
    {"gauges", "damping", "residual", "residual-law", "wave-guide", "elastic-friction", "elastic-spring"}
)
"""Features that need an elastic body."""
RIGID = frozenset({"spring", "spring-dashpot", "friction"})
"""Features that need a rigid one."""
HERTZ = {"kind": "hertz", "stiffness": 1e9}
CONTACTS: dict[str, Table] = {
    "residual": {"method": "residual"},
    "layer": {"method": "penalty", "surface_stiffness": 1e12},
    "linear-law": {"method": "penalty", "law": {"kind": "linear", "stiffness": 1e8, "damping": 100.0}},
    "hertz": {"method": "penalty", "law": HERTZ},
    "hunt-crossley": {
        "method": "penalty",
        "law": {"kind": "hunt-crossley", "stiffness": 1e9, "restitution": 0.8},
    },
    "residual-law": {"method": "residual", "law": HERTZ},
    "constraint": {"method": "constraint"},
    "impact": {"method": "impact", "restitution": 0.6},
}
"""Ways of contact."""


def _run(**settings: Any) -> Callable[[Draft], None]:
    return lambda draft: draft.scene["run"].update(settings)


def _gauges(draft: Draft) -> None:
    draft.scene["body"]["part"]["gauges"] = ["strain"]


def _damping(draft: Draft) -> None:
    draft.scene["body"]["part"]["damping"] = {"ratio": 0.05, "frequency": 2000.0}


def _joint(draft: Draft) -> None:
    crank = SliderCrank(
        kind="slider-crank", body="part", interface="pin", crank_radius=0.002, rod_length=0.02, speed=3000.0, start=60.0
    )
    height = crank.piston_pin(np.zeros(1), PIN[0])[0, 0]
    draft.scene["body"]["part"].update(freedom=["x", "z", "ry"], velocity=[SPEED, 0, 0])
    draft.scene["joint"]["crank"] = crank.model_dump() | {"centre": [0.0, 0.0, PIN[2] - height]}


def _gas(draft: Draft) -> None:
    draft.scene["force"]["gas"] = {
        "kind": "gas", "body": "part", "interface": "crown", "joint": "crank",
        "values": [[0, 2e5], [90, 4e5], [360, 2e5]],
    }  # fmt: skip


def _moving(draft: Draft) -> None:
    draft.scene["force"]["roller"] = {
        "kind": "moving", "body": "part", "interface": "top", "force": 30.0, "at": [0.0, -0.01], "speed": 5.0,
        "rise": 2e-4,
    }  # fmt: skip


def _spring(damping: float) -> Callable[[Draft], None]:
    def add(draft: Draft) -> None:
        draft.scene["force"][f"spring-{damping:g}"] = {
            "kind": "spring", "body": draft.firm, "direction": [1.0, 0, 0], "at": [0.0, 0.01, 0.0], "stiffness": 1e6,
            "damping": damping, "stretch": 1e-5,
        }  # fmt: skip

    return add


def _on_pin(name: str, **settings: Any) -> Callable[[Draft], None]:
    def add(draft: Draft) -> None:
        draft.scene["force"][name] = {"body": "part", "interface": "pin"} | settings

    return add


def _motion(draft: Draft) -> None:
    draft.scene["motion"]["shake"] = {
        "kind": "translation", "body": "part", "interface": "pin", "direction": [0.0, 1.0, 0.0],
        "expression": "0.05*t + 1e-6*(1-cos(2*pi*2000*t))",
    }  # fmt: skip


def _probes(draft: Draft) -> None:
    for kind in ("displacement", "velocity", "acceleration"):
        draft.scene["probe"][kind] = {"kind": kind, "body": "part", "interface": "pin"}


def _contact(name: str) -> Callable[[Draft], None]:
    def add(draft: Draft) -> None:
        rigid = draft.elastic and name not in ELASTIC and draft.rubs
        draft.wall(
            draft.firm if rigid else "part",
            **CONTACTS[name],
            **(draft.rubs if not draft.elastic or rigid else draft.own_rubs),
        )

    return add


def _friction(draft: Draft) -> None:
    if not draft.names & (set(CONTACTS) - ELASTIC):
        draft.wall(draft.firm, **CONTACTS["layer"], **draft.rubs)


def _corners(draft: Draft) -> None:
    chosen = [name for name in CONTACTS if name in draft.names]
    plain = CONTACTS["residual" if draft.elastic else "layer"]
    body = draft.firm if draft.rubs and not (chosen and chosen[0] in ELASTIC) else "part"
    way = CONTACTS[chosen[0]] if chosen else (plain if body == "part" else CONTACTS["layer"])
    draft.wall(body, corners=True, **way, **(draft.rubs if body == draft.firm else draft.own_rubs))


def _guided(draft: Draft) -> None:
    draft.wall("part", method="residual", dashpot="wave-guide", **draft.own_rubs)


def _two_bodies(draft: Draft) -> None:
    draft.scene["contact"]["two"] = {
        "body": "part", "interface": "left-a", "against": {"shape": "body", "body": "mate", "interface": "right-a"},
        "method": "residual",
    } | (draft.own_rubs if draft.elastic else CONTACTS["layer"] | draft.rubs)  # fmt: skip


def _facets(draft: Draft) -> None:
    # Beside the points of the part, so that its facet is met; single points that face each other must stay near.
    aside = -5e-4 if "two-bodies" in draft.names else -4e-3
    draft.scene["body"]["mate"]["position"] = [-2 * HALF - GAP, aside, 0]
    draft.scene["contact"]["facets"] = {
        "body": "part", "interface": "left-corners", "against": {"shape": "body", "body": "mate",
        "interface": "right-corners"}, "method": "residual",
    } | ({"surface_stiffness": 1e12} | draft.own_rubs if draft.elastic else CONTACTS["layer"] | draft.rubs)  # fmt: skip


def _sliding(draft: Draft) -> None:
    draft.scene["body"]["rail"] = {"position": [2 * HALF + GAP, 0, 0], "freedom": []}
    name = list(PLACES)[draft.used]
    draft.used += 1
    draft.scene["contact"]["slide"] = {
        "body": "part", "interface": f"right-{name}", "surface_stiffness": 1e12,
        "against": {"shape": "surface", "body": "rail", "interface": "top"},
    }  # fmt: skip


def _nothing(_: Draft) -> None:
    pass


FEATURES: dict[str, Callable[[Draft], None]] = {
    "gauges": _gauges,
    "damping": _damping,
    "joint": _joint,
    "gas": _gas,
    "moving-force": _moving,
    "spring": _spring(0.0),
    "spring-dashpot": _spring(50.0),
    "elastic-spring": _on_pin(
        "mount", kind="spring", direction=[1.0, 0.5, 0.0], stiffness=2e6, damping=80.0, preload=20.0
    ),
    "table-spring": _on_pin(
        "stop", kind="spring", direction=[1.0, 0, 0], values=[[-1e-3, -800.0], [0, 0], [5e-5, 40.0], [1e-3, 900.0]]
    ),
    "bushing": _on_pin("bush", kind="bushing", stiffness=[1e6, 5e5, 5e5], damping=[30.0, 20.0, 20.0]),
    "force": _on_pin("push", kind="force", direction=[1.0, 0.2, 0.0], expression="40 * sin(2*pi*3000*t)"),
    "motion": _motion,
    "probes": _probes,
    "gravity": _run(gravity=[9.81, 2.0, 0.0]),
    **{name: _contact(name) for name in CONTACTS},
    "friction": _friction,
    "elastic-friction": _nothing,
    "belt": _nothing,
    "two-bodies": _two_bodies,
    "facets": _facets,
    "sliding": _sliding,
    "several-points": _corners,
    "wave-guide": _guided,
    "start-rest": _run(start="rest"),
    "start-undeformed": _run(start="undeformed"),
    "given-step": _run(step=STEP),
    "automatic-step": _run(step=None, checks=True),
}
"""What each adds to a scene."""

CONTRADICTIONS: dict[frozenset[str], str] = {
    frozenset({"start-rest", "start-undeformed"}): "a run has one start",
    frozenset({"given-step", "automatic-step"}): "a run has one step",
    frozenset({"joint", "motion"}): "joint and drive would hold the same point of the body",
    frozenset({"gas", "motion"}): "joint and drive would hold the same point of the body",
}
"""Pairs that no scene has, with the reason."""


def draft_of(names: Iterable[str]) -> Draft:
    """Return the scene of some features."""
    chosen = frozenset(names)
    if "gas" in chosen:
        chosen |= {"joint"}
    elastic = bool(chosen & ELASTIC)
    draft = Draft(chosen, elastic)
    second = bool(chosen & {"two-bodies", "facets"}) or (elastic and bool(chosen & RIGID))
    draft.scene = {
        "body": {"part": {"velocity": [SPEED, 0.05, 0.03]}},
        "contact": {}, "joint": {}, "force": {}, "probe": {}, "motion": {},
        "run": {
            "duration": DURATION, "samples": 50, "frames": 5, "step": STEP, "checks": False, "integrator": "small",
            "start": "undeformed",
        },
    }  # fmt: skip
    if second:
        draft.scene["body"]["mate"] = {
            "velocity": [2 * SPEED, 0.05, 0.0], "position": [-2 * HALF - GAP, 0, 0],
        }  # fmt: skip
    for name, add in FEATURES.items():
        if name in chosen:
            add(draft)
    if not draft.scene["contact"]:
        draft.wall(
            "part", **CONTACTS["residual" if elastic else "layer"], **(draft.own_rubs if elastic else draft.rubs)
        )
    draft.scene["run"] = {key: value for key, value in draft.scene["run"].items() if value is not None}
    return draft


def scene_of(names: Iterable[str], **run: Any) -> Scene:
    """Return the scene of some features; `run` are keys of the run that differ, None: left out."""
    draft = draft_of(names)
    settings = draft.scene["run"] | run
    draft.scene["run"] = {key: value for key, value in settings.items() if value is not None}
    for name, body in draft.scene["body"].items():
        body["component"] = "elastic" if name == "rail" or (name == "part" and draft.elastic) else "rigid"
    return Scene.model_validate(draft.scene)


def system_of(store: Store, names: Iterable[str], **run: Any) -> System:
    """Compile the scene of some features against the records that `store_of` makes; see `scene_of`."""
    return compile_system(store, scene_of(names, **run), keys_of(("elastic", "rigid")))


def store_of(folder: Path) -> Store:
    """Store the records of both components."""
    return stored(folder, {"elastic": records(elastic=True), "rigid": records(elastic=False)})


def fits(names: Iterable[str]) -> bool:
    """Whether a scene has these features, and the solver carries it."""
    return not any(pair <= set(names) for pair in CONTRADICTIONS)


def pairs() -> list[tuple[str, str]]:
    """Return all pairs that fit in a scene."""
    return [pair for pair in combinations(FEATURES, 2) if fits(pair)]


def triples(count: int, seed: int = 0, *, facets: bool = False) -> list[tuple[str, ...]]:
    """Return random triples that fit in a scene, with facets in all of them or in none."""
    rng, found, names = np.random.default_rng(seed), [], [name for name in FEATURES if name != "facets"]
    while len(found) < count:
        chosen = tuple(sorted(str(name) for name in rng.choice(names, 2 if facets else 3, replace=False)))
        chosen = (*chosen, "facets") if facets else chosen
        if chosen not in found and fits(chosen):
            found.append(chosen)
    return found
