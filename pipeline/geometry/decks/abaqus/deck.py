"""Decks of Abaqus and CalculiX (.inp): parts, instances and assemblies, nodes, solids, sets, surfaces.

Own reading. meshio 5 keeps only the last `*NODE` block and the last piece of a set, assigns sets to wrong elements
where an `*ELEMENT` has no name (its issue 1530), and does not know instances, `SYSTEM`, `INCLUDE` or surfaces.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.abaqus import rest as abaqus_rest
from gudgeon.pipeline.geometry.decks.abaqus.body import Body
from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword, read_keywords
from gudgeon.pipeline.geometry.decks.abaqus.members import Members
from gudgeon.pipeline.geometry.decks.abaqus.sets import Names, Resolved
from gudgeon.pipeline.geometry.decks.abaqus.words import Words
from gudgeon.pipeline.geometry.decks.axes import Axes
from gudgeon.pipeline.geometry.decks.model import Block, Deck, Scope, Source, deck_of
from gudgeon.pipeline.geometry.decks.separate import of_elements

MADE = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "PARAMETER", "SUBSTRUCTURE PATH")
"""Keywords that make nodes or elements which no line lists."""
REFERENCE = "assembly"
"""Name of what stands outside parts."""


class Instance(NamedTuple):
    """A part in an assembly."""

    part_name: str
    axes: Axes


def read_abaqus(path: str, scope: Scope) -> Deck:
    """Read a deck; of several parts or instances the one that `scope` names.

    Raises:
        InputError: a file is missing, a line is wrong, or the deck has several bodies of which none is named.
    """
    bodies, instances = _parsed(path)
    return _chosen(path, scope, bodies, instances)


def instances_of(path: str) -> dict[str, tuple[str, Axes]]:
    """Return part and place of each instance of a deck's assembly; of one without instances, each part as it stands.

    Raises:
        InputError: a line is wrong; empty of a deck without parts.
    """
    bodies, instances = _parsed(path)
    names = [bodies[level].name for level in bodies if level and not level.startswith("*")]
    placed = {name: (bodies[i.part_name].name, i.axes) for name, i in instances.items() if i.part_name in bodies}
    return placed or {name: (name, Axes()) for name in names}


def _parsed(path: str) -> tuple[dict[str, Body], dict[str, Instance]]:
    """Return the parts, with the assembly under the empty name, and the instances of a deck."""
    bodies = {"": Body("", path)}
    instances: dict[str, Instance] = {}
    names = Names()
    level = ""
    for keyword in read_keywords(path):
        if keyword.name in MADE:
            raise keyword.source.error(f"*{keyword.name} makes nodes or elements that no line lists; allowed: decks"
                                       " that list them, as preprocessors write them")  # fmt: skip
        if keyword.name == "PART":
            level = names.add(keyword.option("NAME"))
            bodies[level] = Body(keyword.option("NAME"), path)
        elif keyword.name == "INSTANCE":
            name = keyword.option("NAME")
            part_name = names.add(keyword.option("PART"))
            instances[name] = Instance(part_name, _moved(keyword))
            level = f"*{name}"
            bodies[level] = Body(name, path)
        elif keyword.name in ("END PART", "END INSTANCE"):
            level = ""
        elif not bodies[level].take(keyword):
            bodies[level].extras.take(keyword)
    return bodies, instances


def _chosen(path: str, scope: Scope, bodies: dict[str, Body], instances: dict[str, Instance]) -> Deck:
    """Return the deck of one body."""
    levels = [level for level in bodies if level and not level.startswith("*")]
    have = _listed(levels, bodies, instances)
    root = bodies[""]
    if scope.part_name is not None and levels:
        level = _alike(scope.part_name, levels)
        if level is None:
            raise InputError(f'{path}: has no part = "{scope.part_name}", it has {have}')
        return _part(path, level, bodies, instances)
    if scope.instance is not None:
        name = _alike(scope.instance, list(instances))
        if name is None:
            raise InputError(f'{path}: has no instance = "{scope.instance}", it has {have}')
        return _placed(path, name, bodies, instances)
    if not levels:
        deck = _deck(path, root, None, "", [])
        return deck if scope.part_name is None else of_elements(deck, scope.part_name, path)
    if len(instances) > 1 or len(levels) > max(len(instances), 1):
        raise InputError(f'{path}: has {have}; name one by geometry.part = "…" (*PART, as it was modelled) or'
                         ' geometry.instance = "…" (*INSTANCE, as the assembly moves it)')  # fmt: skip
    if instances:
        return _placed(path, next(iter(instances)), bodies, instances)
    return _deck(path, bodies[levels[0]], None, "", [root.extras])


def _listed(levels: Sequence[str], bodies: Mapping[str, Body], instances: Mapping[str, Instance]) -> str:
    """Return what bodies a deck has, as text."""
    have = f"the parts {', '.join(bodies[level].name for level in levels)}" if levels else "no *PART"
    return have + (f" and the instances {', '.join(instances)} (*INSTANCE)" if instances else "")


def _alike(name: str, names: Sequence[str]) -> str | None:
    """Return the name that is the same but for its case."""
    return next((spelling for spelling in names if spelling.casefold() == name.casefold()), None)


def _part(path: str, level: str, bodies: Mapping[str, Body], instances: Mapping[str, Instance]) -> Deck:
    """Return the deck of a part as it was modelled, with sets of the assembly by names such as `PART-1.SET`, and what
    the assembly says of its only instance."""
    mine = [name for name, instance in instances.items() if instance.part_name == level]
    if len(mine) == 1:
        return moved_back(_placed(path, mine[0], bodies, instances, prefixed=True), instances[mine[0]].axes)
    root, body = bodies[""], bodies[level]
    deck = _deck(path, body, None, "", [root.extras])
    blocks = body.blocks()
    groups = [dict(deck.node_sets), dict(deck.side_sets), dict(deck.element_sets)]
    for name in mine:
        upper = root.sets.resolved(blocks, path, name, body.sets.resolved(blocks, path))
        for lower, added in zip(groups, upper, strict=True):
            lower.update({f"{name}.{key}": some for key, some in added.items() if len(some)})
    return replace(deck, node_sets=groups[0], side_sets=groups[1], element_sets=groups[2])


def moved_back(deck: Deck, axes: Axes) -> Deck:
    """Return a deck in axes of its own."""
    sections = [s._replace(axes=None if s.axes is None else axes.turn.T @ s.axes) for s in deck.sections]
    directions = {label: axes.turn.T @ turn for label, turn in deck.directions.items()}
    points = (deck.points - axes.origin) @ axes.turn
    return replace(deck, points=points, sections=tuple(sections), directions=directions)


def _placed(
    path: str, name: str, bodies: Mapping[str, Body], instances: Mapping[str, Instance], *, prefixed: bool = False
) -> Deck:
    """Return the deck of an instance; sets of the assembly may have its name before theirs."""
    instance, root, extras = instances[name], bodies[""], bodies[f"*{name}"]
    if instance.part_name not in bodies:
        have = ", ".join(level for level in bodies if level and not level.startswith("*")) or "none"
        raise InputError(f"{path}: *INSTANCE {name} is of part '{instance.part_name}'; the deck has {have}")
    body = bodies[instance.part_name]
    if extras.labels or extras.elements:
        if body.labels:
            raise InputError(f"{path}: *INSTANCE {name} has nodes or elements, its part too; allowed: those of one")
        body = extras
    rests = [root.extras, extras.extras]
    return _deck(path, body, instance, name, rests, above=root, crowd=len(instances) > 1, prefixed=prefixed)


def _deck(
    path: str,
    body: Body,
    placed: Instance | None,
    instance: str,
    rests: Sequence[abaqus_rest.Rest],
    *,
    above: Body | None = None,
    crowd: bool = False,
    prefixed: bool = False,
) -> Deck:
    """Return the deck of a body that an instance places.

    Args:
        placed: How; None of a body that stands as it was modelled.
        instance: Its name.
        rests: What stands outside the body.
        above: The assembly, whose own nodes get numbers behind those of the body.
        crowd: Whether the assembly has other instances.
        prefixed: Whether names of the assembly's sets begin with that of the instance.
    """
    axes = placed.axes if placed is not None else Axes()
    labels = np.array(body.labels, np.int64)
    local = np.concatenate([np.empty((0, 3)), *body.points])
    points = axes.placed(local)
    blocks = body.blocks()
    if not blocks and not len(points):
        raise InputError(f"{path}: has no nodes (*NODE); allowed: a deck of Abaqus or CalculiX")
    resolved = body.sets.resolved(blocks, path)
    words = Words(resolved[0], {**resolved[2], **_owners(resolved[1])})
    local_directions = body.extras.stated.directions(words, labels, local)
    directions = {label: axes.turn @ turn for label, turn in local_directions.items()}
    members = body.extras.stated.members(words, directions)
    gathered = _Gathered(labels, points, resolved, directions, members)
    if above is not None:
        gathered.join(above, instance, blocks, path, crowd=crowd, prefixed=prefixed)
    node_sets, side_sets, element_sets = resolved
    extras = abaqus_rest.joined([body.extras, *(extras for extras in rests if extras is not body.extras)])
    omissions = [o for o in extras.omissions(element_sets) if o.source not in members.foreign]
    node_sets |= members.sets
    return deck_of(
        gathered.labels, gathered.points, blocks, path,
        node_sets=node_sets, side_sets=side_sets, element_sets=element_sets,
        couplings=members.couplings, links=members.links, masses=members.masses, sums=members.sums, ties=members.ties,
        directions=directions, dependent=_dependent(members, node_sets, side_sets, blocks), omissions=omissions,
        materials=extras.materials.stated, sections=extras.materials.sections(axes.turn),
    )  # fmt: skip


@dataclass
class _Gathered:
    """Nodes, sets and members of a body, and what its assembly adds."""

    labels: np.ndarray
    points: np.ndarray
    sets: Resolved
    directions: dict[int, np.ndarray]
    members: Members

    def join(
        self, above: Body, instance: str, blocks: Sequence[Block], path: str, *, crowd: bool, prefixed: bool
    ) -> None:  # fmt: skip
        """Add nodes, sets and members of the assembly; arguments as of `_deck`."""
        shift = _shift(self.labels, *(block.labels for block in blocks))
        upper = above.sets.resolved(blocks, path, instance, self.sets, shift)
        spelling: dict[str, str] = {}
        for lower, added in zip(self.sets, upper, strict=True):
            chosen = added.keys() if prefixed else lower.keys() & added.keys()
            spelling |= {name: f"{instance}.{name}" for name in chosen}
        for lower, added in zip(self.sets, upper, strict=True):
            if not prefixed:
                lower.update({spelling[name]: lower[name] for name in lower.keys() & added.keys()})
            lower.update({spelling[name] if prefixed else name: labels for name, labels in added.items()})
        words = Words(upper[0], {**upper[2], **_owners(upper[1])}, instance, shift)
        self.labels = np.concatenate([self.labels, np.array(above.labels, np.int64) + shift])
        self.points = np.concatenate([self.points, *above.points])
        self.directions |= above.extras.stated.directions(words, self.labels, self.points)
        stated = _loose_dropped(above.extras.stated.members(words, self.directions), shift, crowd)
        _rename(stated if prefixed else self.members, spelling)
        self.members.extend(stated)


def _shift(*labels: np.ndarray) -> int:
    """Return what is added to numbers of the assembly, so that they are behind those of its instance."""
    return 10 ** len(str(max((int(some.max(initial=0)) for some in labels), default=0)))


def _owners(side_sets: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the elements of surfaces of faces."""
    return {name: np.unique(sides[:, 0]) for name, sides in side_sets.items()}


def _rename(members: Members, spelling: Mapping[str, str]) -> None:
    """Let members name their sets, where these are spelled otherwise."""
    members.couplings[:] = [c._replace(surface=spelling.get(c.surface, c.surface)) for c in members.couplings]
    members.ties[:] = [
        t._replace(slave=spelling.get(t.slave, t.slave), master=spelling.get(t.master, t.master)) for t in members.ties
    ]


def _loose_dropped(members: Members, shift: int, crowd: bool) -> Members:
    """Return members without masses on points of the assembly that other instances lead."""
    leading = {c.reference for c in members.couplings} | {n for link in members.links for n in link.nodes}
    if crowd:
        loose = [m for m in members.masses if m.node > shift and m.node not in leading]
        members.masses[:] = [m for m in members.masses if m not in loose]
        members.foreign |= {m.source for m in loose} - {m.source for m in members.masses}
    return members


def _dependent(
    members: Members, nodes: Mapping[str, np.ndarray], sides: Mapping[str, np.ndarray], blocks: Sequence[Block]
) -> np.ndarray:
    """Return labels of the nodes that couplings and equations express by others."""
    labels = [np.array([s.terms[0].node for s in members.sums if s.stiffness is None], np.int64)]
    for coupling in members.couplings:
        if coupling.tie == "rbe3":
            labels.append(np.array([coupling.reference]))
        elif coupling.surface in sides:
            labels.append(abaqus_rest.nodes_of_sides(sides[coupling.surface], blocks))
        else:
            labels.append(nodes.get(coupling.surface, np.empty(0, np.int64)))
    return np.unique(np.concatenate(labels))


def _moved(keyword: Keyword) -> Axes:
    """Return where an instance stands: moved by a vector, then turned about a line by an angle [deg]."""
    rows = keyword.rows
    if len(rows) > 2:
        raise rows[2].source.error(f"*INSTANCE: {rows[2].text[:60]!r}, expected a translation and a rotation at most")
    shift = np.array(((rows[0].reals() if rows else []) + [0.0] * 3)[:3])
    axes = Axes(np.eye(3), shift)
    if len(rows) < 2:
        return axes
    values = rows[1].reals()
    if len(values) != 7:
        raise rows[1].source.error("*INSTANCE: expected two points of the axis and an angle, 7 numbers")
    return axes.turned(np.array(values[:3]), np.array(values[3:6]), values[6], Source(*rows[1].source))
