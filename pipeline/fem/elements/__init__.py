"""Elements: each assembles K, M and rigid motions of a mesh of its cell type. A new one is a file and a line here."""

from collections.abc import Callable

from pydantic import BaseModel

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.bar import assemble_bar
from gudgeon.pipeline.fem.elements.beam import assemble_beam
from gudgeon.pipeline.fem.elements.frame import assemble_frame
from gudgeon.pipeline.fem.elements.plane import assemble_plane
from gudgeon.pipeline.fem.elements.solid import assemble_solid
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.scenes.material import Material

ASSEMBLERS: dict[str, Callable[[MeshRecord, Material, BaseModel | None], FEModel]] = {
    "tetra10": assemble_solid,
    "triangle6": assemble_plane,
    "line3": assemble_bar,
    "beam2": assemble_beam,
    "beam3": assemble_beam,
    "frame2": assemble_frame,
}
