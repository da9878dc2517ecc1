"""Elements: a new one is a file and a line of `ELEMENTS`, and a line of `CELLS` where its type of cell is new."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.bar import assemble_bar, bar_samples
from gudgeon.pipeline.fem.elements.beam import assemble_beam, beam_samples
from gudgeon.pipeline.fem.elements.frame import assemble_frame, frame_samples
from gudgeon.pipeline.fem.elements.plane import assemble_plane, plane_samples
from gudgeon.pipeline.fem.elements.rigid import rigid_body
from gudgeon.pipeline.fem.elements.solid import assemble_solid, solid_samples
from gudgeon.pipeline.fem.elements.strain import StrainSamples
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import BEAM2, BEAM3, FRAME2, LINE3, MIXED, SOLIDS, TRIANGLE6, VERTEX, Cell


@dataclass(frozen=True)
class Element:
    """What is computed on cells of a type; both functions take mesh, material and the geometry of the component."""

    cell: Cell
    assemble: Callable[[MeshRecord, Any, Any], FEModel]
    """To K, M and rigid motions."""
    samples: Callable[[MeshRecord, Any, Any], list[StrainSamples]] | None = None
    """The strain inside the elements; None for those whose discretisation errors are not estimated."""
    separate: bool = False
    """Whether the strain of each of the samples is recovered by itself: strains of several have other axes."""


ELEMENTS = {
    element.cell.name: element
    for element in (
        *(Element(cell, assemble_solid, solid_samples) for cell in (*SOLIDS.values(), MIXED)),
        Element(TRIANGLE6, assemble_plane, plane_samples),
        Element(LINE3, assemble_bar, bar_samples),
        Element(BEAM2, assemble_beam, beam_samples),
        Element(BEAM3, assemble_beam, beam_samples),
        Element(FRAME2, assemble_frame, frame_samples, separate=True),
        Element(VERTEX, rigid_body),
    )
}
