"""Solids from mesh files and decks, with named, outward surfaces; their families and readers are in `decks`.

Surfaces get their names from gmsh's physical groups of dimension 2, from sets of faces, of elements or of nodes, from
integer cell or point arrays (non-zero = member), or from their true shape only. A true plane, cylinder, cone or sphere
is recognised without being declared. Linear tetrahedra become tet10.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord, Relation, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import (
    FACETS,
    MIXED,
    TETRA4,
    TETRA10,
    Block,
    blocks_of,
    boundary_facets,
    cell_blocks,
    joined,
    outer_faces,
)
from gudgeon.pipeline.geometry.numbers import CAD_KINDS, Point, UnitVector
from gudgeon.pipeline.geometry.shape_fit import fit_shape
from gudgeon.pipeline.geometry.soundness import refuse_pieces
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, distance, true_surface
from gudgeon.solver.numbers import RANGES, Length, Mass, Name, Strict

if TYPE_CHECKING:
    from gudgeon.pipeline.geometry.decks.model import Deck

ON_SHAPE = 1e-5
"""How far corners may lie from a true shape, relative to its size: the round-off of files with six digits."""
FACING = 0.5
"""Least cosine between the normals of facet and true shape: a facet of an end face may have all three corners on the
cylinder, but its normal is perpendicular to the radius."""
CORNERS = 4
"""Of a facet, which columns are kept even where all have three."""
SAME_UNIT = 1e-6
"""Relative difference of two units of length that are one."""
LIFTS = 30
"""Alternating projections onto shapes with a common edge; one is enough where they meet at right angles."""


class CylinderShape(Strict):
    """A circular cylinder."""

    kind: Literal["cylinder"]
    radius: Length = Field(description="Radius")
    axis: UnitVector = Field(description="Direction of the axis")
    origin: Point = Field(description="A point of the axis [m]")


class PlaneShape(Strict):
    """A plane."""

    kind: Literal["plane"]
    normal: UnitVector = Field(description="Normal of the plane")
    origin: Point = Field(description="A point of the plane [m]")


SurfaceShape = Annotated[CylinderShape | PlaneShape, Field(discriminator="kind")]


class MeshFile(Strict):
    """A mesh of solid elements in a file, or the solid of a deck."""

    kind: Literal["file"]
    path: str = Field(description="File of the mesh, from the folder of the scene")
    unit: Length = Field(default=1.0, description="Metres per unit of length of the file")
    part: str | None = Field(
        default=None,
        description="Part of a deck of several, as it was modelled; of files without parts, the set of solid elements"
        " that is one of several bodies",
    )
    instance: str | None = Field(default=None, description="Instance of a deck's assembly, as it is placed there")
    leave_out: tuple[str, ...] = Field(
        default=(), description="What a deck says that its body shall not have, by keywords, such as MASS or RBE2"
    )
    mass_unit: Mass | None = Field(
        default=None,
        description="Kilograms per unit of mass of the file, whose time is in seconds, for its point masses and"
        " springs: 1000 for mm, t and N; default: 1, if its densities are in kg/m^3",
    )
    materials: bool = Field(
        default=False,
        description="Take the materials and orientations of a deck, in place of the component's `material`",
    )
    surfaces: dict[Name, SurfaceShape] = Field(
        default={}, description="True shapes by name; a name that is not in the file gets the facets on its shape"
    )

    def build(self, size: float | None) -> MeshRecord:
        """Read the mesh; `size` is not used, the file has its own.

        Raises:
            InputError: the file is missing or no mesh, not one solid, not on its declared surfaces, or says something
                that the body would not have and `leave_out` does not name.
        """
        from gudgeon.pipeline.geometry.decks.members.attached import attached_notes, attachments, with_middles
        from gudgeon.pipeline.geometry.decks.members.carriers import Placed, carriers_of
        from gudgeon.pipeline.geometry.decks.members.related import related_notes, relations
        from gudgeon.pipeline.geometry.decks.naming import left_out, named_cells, named_facets, stated_materials
        from gudgeon.pipeline.geometry.decks.solids import solid_of

        deck = self.deck()
        notes = [*left_out(deck, self.leave_out, self.path), *self._unit_notes(deck)]
        solid = solid_of(deck, scaled_points(deck.points, self.unit, self.path), self.path)
        used = np.unique(np.concatenate([block.nodes.ravel() for block in solid.blocks]))
        new_row = np.full(len(solid.points), -1)
        new_row[used] = np.arange(len(used))
        nodes = solid.points[used]
        blocks = [Block(block.cell, block.rows, new_row[block.nodes]) for block in solid.blocks]
        deck_rows, deck_count = new_row[: solid.deck_count], int(np.searchsorted(used, solid.deck_count))
        placed = Placed(solid.points[: solid.deck_count], deck_rows, self.unit, self.mass_unit, self.path)
        carriers = carriers_of(deck, self.leave_out, placed)
        attached = attachments(deck, self.leave_out, carriers, placed)
        related = relations(deck, self.leave_out, carriers, placed)
        faces = boundary_facets(blocks, self.path)[1]
        members = named_facets(deck, faces, new_row, 2, deck_count)
        shapes: dict[str, SurfaceRule] = {name: s.model_dump(mode="json") for name, s in self.surfaces.items()}
        members |= {name: self._on_shape(name, shape, nodes, faces, members) for name, shape in shapes.items()}
        fitted = {name: _fitted(nodes, faces[members[name]]) for name in sorted(members.keys() - shapes.keys())}
        corners = [(block.rows, block.nodes[:, : block.cell.shape.corners]) for block in blocks]
        cells, cell = joined([block.nodes for block in blocks]), blocks[0].cell if len(blocks) == 1 else MIXED
        if straight := cell is TETRA4:
            cell, (nodes, cells) = TETRA10, _with_mid_nodes(nodes, cells)
            faces = outer_faces(cells)
        facets = {name: _narrow(faces[chosen]) for name, chosen in members.items()}
        if straight:
            _lift(nodes, facets, shapes)
        surfaces = {name: Surface(facets[name], (fitted | shapes)[name]) for name in facets}
        ties, tie_notes = self._ties(deck, nodes, facets, deck_rows)
        record = MeshRecord(
            nodes, cells, cell.name, surfaces, named_cells(deck, corners, new_row), formulations=solid.formulations,
            relations=related | ties,
            remarks=_remarks(
                [*notes, *solid.notes, *attached_notes(attached), *related_notes(related), *tie_notes],
                stated_materials(deck, self.path),
            ),
        )  # fmt: skip
        if attached:
            edges, middles = _added_middles(record, deck_count)
            attached = {name: with_middles(attachment, edges, middles) for name, attachment in attached.items()}
            record = replace(record, attachments=attached)
        refuse_pieces(record, self.path, remedy=self._remedy(deck))
        return record

    def _remedy(self, deck: "Deck") -> str:
        """Return the key by which a mesh of several pieces is one of them, the end of a message."""
        from gudgeon.pipeline.geometry.decks.separate import MOST_LISTED, bodies_of

        if self.part is not None or self.instance is not None:
            return ""
        names = bodies_of(deck)
        return f', or one of them by geometry.part = "…": {", ".join(names[:MOST_LISTED])}' if names else ""

    def deck(self) -> "Deck":
        """Return what the file says; errors as of `build`."""
        from gudgeon.pipeline.geometry.decks.model import Scope
        from gudgeon.pipeline.geometry.decks.reading import read_deck

        if cad_kind := CAD_KINDS.get(Path(self.path).suffix.lower()):
            raise InputError(f'{self.path}: {cad_kind} is a shape without a mesh; kind = "cad" meshes it')
        refuse_both(self.part, self.instance, self.path)
        return read_deck(self.path, Scope(self.part, self.instance))

    def _unit_notes(self, deck: "Deck") -> list[str]:
        """Return a line if the file states another unit of length than the scene.

        Raises:
            InputError: the scene states none.
        """
        if deck.length_unit is None or abs(deck.length_unit[1] / self.unit - 1) < SAME_UNIT:
            return []
        source, unit = deck.length_unit
        if "unit" not in self.model_fields_set:
            raise source.error(f"the file's unit of length is {unit:g} m; geometry.unit = {unit:g} is missing")
        return [f"line {source.line}: the file's unit of length is {unit:g} m, geometry.unit = {self.unit:g} is used"]

    def _ties(
        self, deck: "Deck", nodes: np.ndarray, facets: dict[str, np.ndarray], deck_rows: np.ndarray
    ) -> tuple[dict[str, Relation], list[str]]:
        """Return the constraints of the deck's ties and a line for each; their nodes are moved onto each other."""
        from gudgeon.pipeline.geometry.decks.members.tied import tied_relations

        if not deck.ties:
            return {}, []
        rows = {name: deck_rows[deck.rows(labels, self.path)] for name, labels in deck.node_sets.items()}
        sets = {name: chosen[chosen >= 0] for name, chosen in rows.items()}
        return tied_relations(deck, self.leave_out, nodes, facets, sets, self.unit)

    def _on_shape(
        self, name: str, shape: SurfaceRule, nodes: np.ndarray, faces: np.ndarray, members: dict[str, np.ndarray]
    ) -> np.ndarray:
        """Return which boundary facets (f, s) of the mesh belong to the surface `name` of a true shape."""
        corners = nodes[faces[:, :3]]
        off, limit = (
            _off(nodes, faces, shape),
            ON_SHAPE * shape.get("radius", float(np.ptp(corners, axis=(0, 1)).max())),
        )
        hint = "check `unit` and the shape, which is in metres"
        if name in members and (worst := off[members[name]].max()) > limit:
            raise InputError(
                f"{self.path}: surface '{name}' lies up to {worst:.3g} m off its {shape['kind']}, allowed:"
                f" {limit:.3g} m; {hint}"
            )
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        with np.errstate(invalid="ignore"):  # a facet with its middle on the axis has no radial direction
            _, true_normal = true_surface(corners.mean(axis=1), normal, shape)
        facing = np.einsum("fi,fi->f", normal, true_normal) > FACING
        belongs = members.get(name, np.ones(len(off), bool)) & facing & (off <= limit)
        if not belongs.any():
            have = ", ".join(sorted(members)) or "no surface"
            raise InputError(
                f"{self.path}: no boundary facet lies on the {shape['kind']} of surface '{name}', and the file"
                f" names {have}; {hint}"
            )
        return belongs


def refuse_both(part_name: str | None, instance: str | None, path: str) -> None:
    """Refuse a part and an instance of a deck at once."""
    if part_name is not None and instance is not None:
        raise InputError(f"{path}: geometry.part and geometry.instance given; allowed: one of them")


def _added_middles(mesh: MeshRecord, deck_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return edges (k, 2) whose nodes in the middle, (k,), are none of the first `deck_count`, those of the file."""
    edges, middles = [np.empty((0, 2), np.int64)], [np.empty(0, np.int64)]
    for block in cell_blocks(mesh):
        shape = block.cell.shape
        middle = block.nodes[:, shape.corners : shape.corners + len(shape.edges)].ravel()
        added = middle >= deck_count
        edges.append(block.nodes[:, shape.edges].reshape(-1, 2)[: len(middle)][added])
        middles.append(middle[added])
    return np.concatenate(edges), np.concatenate(middles)


def _remarks(notes: list[str], materials: list[dict[str, Any]]) -> dict[str, Any]:
    return ({"notes": notes} if notes else {}) | ({"materials": materials} if materials else {})


def _off(nodes: np.ndarray, faces: np.ndarray, shape: SurfaceRule) -> np.ndarray:
    """Return the largest distance of a corner of each facet (f, s) from a shape [m], (f,)."""
    off = np.zeros(len(faces))
    for block in blocks_of(faces, FACETS):
        corners = nodes[block.nodes[:, : block.cell.shape.corners]]
        off[block.rows] = distance(corners.reshape(-1, 3), shape).reshape(len(corners), -1).max(axis=1)
    return off


def _narrow(facets: np.ndarray) -> np.ndarray:
    """Return facets (f, s) without the columns that only repeat their last nodes."""
    width = max((block.nodes.shape[1] for block in blocks_of(facets, FACETS)), default=facets.shape[1])
    return facets[:, : max(width, CORNERS)]


def _fitted(nodes: np.ndarray, facets: np.ndarray) -> SurfaceRule:
    """Return the true shape on which all nodes of facets (f, 3) or (f, 6) lie, empty if there is none.

    The nodes stay: those between the corners of a straight mesh lie on chords.
    """
    if not len(facets):
        return {}
    a, b, c = np.moveaxis(nodes[facets[:, :3]], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return fit_shape(nodes[facets].reshape(-1, 3), np.repeat(normals, facets.shape[1], axis=0)).shape


def _lift(nodes: np.ndarray, facets: dict[str, np.ndarray], shapes: dict[str, SurfaceRule]) -> None:
    """Move the mid-edge nodes of facets onto their true shapes, in place."""
    for _ in range(LIFTS):
        for name, shape in shapes.items():
            middle = np.unique(facets[name][:, 3:])
            nodes[middle], _ = true_surface(nodes[middle], nodes[middle], shape)


def _with_mid_nodes(nodes: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn linear tetrahedra (e, 4) into straight tet10 (e, 10); new nodes are last."""
    edges, numbers = np.unique(
        np.sort(cells[:, TETRA4.shape.edges].reshape(-1, 2), axis=1), axis=0, return_inverse=True
    )
    middle = len(nodes) + numbers.reshape(-1, 6)
    return np.concatenate([nodes, nodes[edges].mean(axis=1)]), np.hstack([cells, middle])


def scaled_points(points: np.ndarray, unit: float, path: str) -> np.ndarray:
    """Return the points of a file [m], (n, 3), with its `unit` [m].

    Raises:
        InputError: the file is farther across than any part.
    """
    farthest, limit = unit * float(np.abs(points).max(initial=0.0)), RANGES["m"][1]
    if farthest > limit:
        raise InputError(f"{path}: has a coordinate of {farthest:.3g} m; allowed: up to {limit:g} m")
    return unit * points
