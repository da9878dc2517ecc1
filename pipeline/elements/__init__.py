"""Elements: each turns a mesh of its cell type into K, M and rigid motions. A new one is a file and a line here."""

from collections.abc import Callable

from pydantic import BaseModel

from modaldb.schema import MeshRecord
from pipeline.elements.bar import assemble_bar
from pipeline.elements.beam import assemble_beam
from pipeline.elements.plane import assemble_plane
from pipeline.elements.solid import assemble_solid
from pipeline.femodel import FEModel
from pipeline.material import Material

ASSEMBLERS: dict[str, Callable[[MeshRecord, Material, BaseModel | None], FEModel]] = {
    "tetra10": assemble_solid,
    "triangle6": assemble_plane,
    "line3": assemble_bar,
    "beam2": assemble_beam,
    "beam3": assemble_beam,
}
