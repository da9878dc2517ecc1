"""Tiny scenes of every integrator, each with optional terms left out in every way and really in.

A pair's first scene never heard of the term: neither its component nor the scene has it. Shared by the count of
operations and by the benchmark of the same pairs, compiled.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import (
    GaugeModes,
    InertiaCouplings,
    InterfaceModes,
    LoadModes,
    ModalRecord,
    MorphRecord,
    TractionModes,
)
from tests.solver import systems

Records = dict[str, tuple[ModalRecord, MorphRecord]]
Scene = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """Records and a scene that asks of them what it needs."""

    records: Records
    scene: Scene


@dataclass(frozen=True)
class Family:
    """One integrator on one kind of contact: the plain case, and what can be left out of it or put in."""

    plain: Case
    out: dict[str, Case] = field(default_factory=dict)
    """Must do just what the plain case does."""
    into: dict[str, Case] = field(default_factory=dict)
    """Must do more."""

    def cases(self) -> dict[str, Case]:
        """Return all by name: `plain`, `out: …`, `in: …`."""
        out, into = (
            {f"{way}: {name}": one for name, one in part.items()}
            for way, part in (("out", self.out), ("in", self.into))
        )
        return {"plain": self.plain} | out | into


def merged(one: Scene, change: Scene) -> Scene:
    """Return nested tables with others put into them."""
    found = dict(one)
    for key, value in change.items():
        found[key] = (
            merged(found[key], value) if isinstance(value, dict) and isinstance(found.get(key), dict) else value
        )
    return found


# What a component can have and a scene need not use


def _more_rows(modal: ModalRecord, name: str, rows: np.ndarray) -> ModalRecord:
    """Give a component further rows in R."""
    first, count = max((end for _, end in modal.interface_rows.values()), default=0), len(rows)
    R = modal.residual_flexibility
    if R is not None:
        R = np.block([[R, 1e-12 * np.ones((first, count))], [1e-12 * np.ones((count, first)), 1e-9 * np.eye(count)]])
    gauges = {
        key: replace(one, residual=np.pad(one.residual, ((0, 0), (0, count)))) for key, one in modal.gauges.items()
    }
    places = modal.interface_rows | {name: [first, first + count]}
    return replace(modal, residual_flexibility=R, interface_rows=places, gauges=gauges)


def with_interface(modal: ModalRecord, morph: MorphRecord) -> tuple[ModalRecord, MorphRecord]:
    """A second interface of two points."""
    rows, points = np.ones((2, len(modal.angular_frequencies))), np.array([[-1.0, 0, 0], [-1.0, 0.01, 0]])
    spare = InterfaceModes(np.arange(2), points, np.tile([-1.0, 0, 0], (2, 1)), np.ones(2), np.zeros(2, bool), rows)
    modal = _more_rows(modal, "spare", rows)
    return replace(modal, interfaces=modal.interfaces | {"spare": spare}), replace(
        morph, points=morph.points | {"spare": points}
    )


def with_load(modal: ModalRecord, morph: MorphRecord) -> tuple[ModalRecord, MorphRecord]:
    """A surface that a joint could hold."""
    rows = np.ones((3, len(modal.angular_frequencies)))
    hook = LoadModes(rows, np.column_stack([np.eye(3), np.zeros((3, 3))]), np.zeros(3), "N")
    return replace(_more_rows(modal, "hook", rows), loads=modal.loads | {"hook": hook}), morph


def with_traction(modal: ModalRecord, morph: MorphRecord) -> tuple[ModalRecord, MorphRecord]:
    """A traction space on which a force could travel."""
    rows = np.ones((16, len(modal.angular_frequencies)))
    chart = {"kind": "plane", "origin": [0.0] * 3, "normal": [-1.0, 0, 0], "across": [0, 0, 1.0], "along": [0, 1.0, 0]}
    space = TractionModes(
        chart, np.zeros(2), np.full(2, 0.01), np.array([4, 4]), rows, np.tile([-1.0, 0, 0, 0, 0, 0], (16, 1))
    )
    return replace(_more_rows(modal, "track", rows), tractions=modal.tractions | {"track": space}), morph


def with_gauges(modal: ModalRecord, morph: MorphRecord) -> tuple[ModalRecord, MorphRecord]:
    """Two gauges."""
    count = max((end for _, end in modal.interface_rows.values()), default=0)
    one = GaugeModes(np.ones((6, len(modal.angular_frequencies))), 1e-3 * np.ones((6, count)), "Pa")
    return replace(modal, gauges=modal.gauges | {"g": one, "h": one}), morph


def with_shapes(modal: ModalRecord, morph: MorphRecord) -> tuple[ModalRecord, MorphRecord]:
    """Shapes of all nodes and inertia couplings."""
    m = len(modal.angular_frequencies)
    couplings = InertiaCouplings(np.zeros((3, m)), np.zeros((3, m)), np.zeros((3, m, m)))
    return replace(modal, shapes=np.ones((9, 3, m)), inertia_couplings=couplings), morph


def with_participation(modal: ModalRecord, morph: MorphRecord) -> tuple[ModalRecord, MorphRecord]:
    """What gravity would do to modes."""
    return replace(modal, participation=np.ones((3, len(modal.angular_frequencies)))), morph


def with_change(modal: ModalRecord, morph: MorphRecord) -> tuple[ModalRecord, MorphRecord]:
    """A design change of zero: nodes of their own that stand where they stood."""
    return modal, replace(morph, update="reuse", nodes=np.ones((9, 3)))


HAS: dict[str, Callable[[ModalRecord, MorphRecord], tuple[ModalRecord, MorphRecord]]] = {
    "gauges not named": with_gauges,
    "interface without contact": with_interface,
    "load surface without joint or force": with_load,
    "traction space without force": with_traction,
    "shapes and couplings": with_shapes,
    "participation without gravity": with_participation,
    "design change of zero": with_change,
}


WEIGHTLESS = tuple(HAS)
UNGAUGED = tuple(name for name in HAS if name != "gauges not named")
"""Of integrators that read no gauges, and of rigid bodies."""
HEAVY = tuple(name for name in UNGAUGED if name != "participation without gravity")


def capable(records: Records, names: tuple[str, ...]) -> Records:
    """Return records whose component has what a scene need not use."""
    whole = records["part"]
    for name in names:
        whole = HAS[name](*whole)
    return records | {"part": whole}


def family(
    case: Case, neutral: dict[str, Scene], more: dict[str, Scene], names: tuple[str, ...] = WEIGHTLESS, *,
    each: bool = False,
) -> Family:  # fmt: skip
    """Return the family of a plain case.

    Args:
        neutral: Changes of the scene that leave a term out by its value.
        more: Changes that put a term in; its component has all that it can have.
        names: What its component can have.
        each: Whether every one of these stands alone, too.
    """
    records = capable(case.records, names)
    out = {name: Case(capable(case.records, (name,)), case.scene) for name in names if each}
    out |= {"all that a component can have": Case(records, case.scene)}
    out |= {name: Case(case.records, merged(case.scene, change)) for name, change in neutral.items()}
    return Family(case, out, {name: Case(records, merged(case.scene, change)) for name, change in more.items()})


DAMPED: Scene = {"body": {"part": {"damping": {"ratio": 0.05, "frequency": 1e4}}}}
STILL: Scene = {"run": {"gravity": [0.0, 0.0, 0.0]}}
READ: Scene = {"body": {"part": {"gauges": ["g"]}}}
UNREAD: Scene = {"body": {"part": {"gauges": []}}}


def _run(integrator: str, duration: float, step: float | None = None) -> Scene:
    # The window is given: one that follows the impact is found by a run of its own.
    run = {"integrator": integrator, "duration": duration, "samples": 20, "frames": 4, "window": duration / 20}
    return {"run": run | ({} if step is None else {"step": step})}


def _contact(name: str, **keys: Any) -> Scene:
    return {"contact": {name: keys}}


def implicit(finer: int = 1) -> dict[str, Family]:
    """Families of the implicit integrator.

    Damping and gravity have no loops of their own there: with them steps without either took longer, not less.
    """
    block = Case({"part": systems.block_records(3)}, merged(systems.block_scene(), _run("small", 2e-4, 4e-6 / finer)))
    parts = {"part": systems.block_records(3), "plate": systems.plate_records(3)}
    pair = Case(parts, merged(systems.pair_scene(), _run("small", 4e-5, 2e-6 / finer)))
    push = {"kind": "moving", "body": "part", "interface": "track", "force": 9.0, "at": [0.005, 0.001]}
    guided = merged(systems.piston_scene(clearance=1e-5), _run("small", 2e-4, 4e-6 / finer))
    drives = {key: guided.pop(key) for key in ("joint", "force")}
    guided = merged(guided, {"body": {"part": {"velocity": [1.0, 0.0, 0.0]}}})
    modal, morph = systems.piston_records(3)
    R = modal.residual_flexibility
    assert R is not None
    rows = {name: place for name, place in modal.interface_rows.items() if name in modal.interfaces}
    bare = replace(modal, loads={}, interface_rows=rows, residual_flexibility=R[:6, :6])
    guides = Case({"part": (bare, morph)}, guided)
    full = {"part": (modal, morph)}
    return {
        "small": family(
            block, {"dashpot 'none'": _contact("wall", dashpot="none"), "no gravity": STILL},
            {"surface layer": _contact("wall", surface_stiffness=1e14), "moving force": {"force": {"f": push}},
             "damping": DAMPED},
            UNGAUGED, each=True,
        ),
        "implicit, sliding pair": family(pair, {}, {"moving force": {"force": {"f": push}}}, HEAVY),
        "implicit, joint and gas": Family(
            guides, {"pin and crown without them": replace(guides, records=full)},
            {"joint": Case(full, guided | {"joint": drives["joint"]}), "joint and gas": Case(full, guided | drives)},
        ),
    }  # fmt: skip


def located() -> dict[str, Family]:
    """Families of located events."""
    rod = Case({"part": systems.rod_records(4)}, merged(systems.rod_scene(), _run("event", 3e-4)))
    foot = {"foot": ([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])}
    floor = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    ball: Scene = {
        "body": {"part": {"position": [0, 0, 0.01], "velocity": [1.0, 0, 0]}},
        "contact": {"floor": {"body": "part", "interface": "foot", "against": floor, "method": "constraint"}},
        "run": {"gravity": [0.0, 0.0, -9.81]},
    }
    rigid = Case({"part": systems.rigid_records(1.0, foot)}, merged(ball, _run("event", 0.2)))
    rubs = {"direction": [1.0, 0, 0], "static": 0.3}
    moves = floor | {"velocity": [0.5, 0, 0]}
    spring = {"force": {"s": {"kind": "spring", "body": "part", "direction": [1, 0, 0], "stiffness": 1e3}}}
    return {
        "event, R": family(
            rod, {"dashpot 'none'": _contact("wall", dashpot="none"), "no gravity": STILL, "no gauges": UNREAD},
            {"gauge": READ},  # With gravity the run has no coefficient of restitution, which takes more than gravity.
        ),
        "event, rigid": family(
            rigid,
            {"friction 0": _contact("floor", friction=rubs | {"static": 0.0}),
             "belt that stands": _contact("floor", against=floor | {"velocity": [0.0, 0.0, 0.0]})},
            {"friction": _contact("floor", friction=rubs), "spring": spring,
             "belt": _contact("floor", friction=rubs, against=moves)}, HEAVY,
        ),
    }  # fmt: skip


def smooth(finer: int = 1) -> dict[str, Family]:
    """Families of contact laws."""
    law = {"kind": "hertz", "stiffness": 2e9}
    spring = {"force": {"s": {"kind": "spring", "body": "part", "direction": [1, 0, 0], "stiffness": 1e3}}}
    lossy = _contact("wall", law={"kind": "hunt-crossley", "stiffness": 2e9, "restitution": 0.5})
    mass = {"part": systems.rigid_records(1.0, {"tip": ([systems.LENGTH, 0, 0], [1.0, 0, 0])})}
    rod = merged(systems.rod_scene(law=law, method="residual"), _run("small", 3e-4, 1e-6 / finer))
    point = merged(systems.rod_scene(law=law, method="penalty"), _run("small", 6e-4, 2e-6 / finer))
    return {
        "law, elastic": family(
            Case({"part": systems.rod_records(3)}, rod), {"no gravity": STILL, "no gauges": UNREAD}, {"gauge": READ}
        ),
        "law, rigid": family(Case(mass, point), {"no gravity": STILL}, {"loss": lossy, "spring": spring}, UNGAUGED),
    }


def families(finer: int = 1) -> dict[str, Family]:
    """Return all families.

    Args:
        finer: By what the steps of integrators that are given one are divided.
    """
    return implicit(finer) | located() | smooth(finer)
