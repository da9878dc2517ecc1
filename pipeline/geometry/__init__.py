"""The family of geometries: each member is a pydantic model whose `build(size)` makes a `MeshRecord`."""

from typing import Annotated

from pydantic import BaseModel, Field

from pipeline.geometry.bar import Bar
from pipeline.geometry.beam import Beam
from pipeline.geometry.bladed_sector import BladedSector
from pipeline.geometry.box import Box
from pipeline.geometry.file import MeshFile
from pipeline.geometry.liner import Liner
from pipeline.geometry.piston import Piston
from pipeline.geometry.plane import Rectangle
from pipeline.geometry.plane_file import PlaneFile
from pipeline.geometry.plate import Plate
from pipeline.geometry.rigid import Rigid
from pipeline.geometry.skirt import Skirt
from pipeline.geometry.sphere import Sphere

GEOMETRIES: dict[str, type[BaseModel]] = {
    "skirt": Skirt,
    "piston": Piston,
    "liner": Liner,
    "box": Box,
    "plate": Plate,
    "sphere": Sphere,
    "rectangle": Rectangle,
    "bar": Bar,
    "beam": Beam,
    "rigid": Rigid,
    "bladed-sector": BladedSector,
    "file": MeshFile,
    "plane-file": PlaneFile,
}
"""Members by the `kind` that a scene names."""

Geometry = Annotated[
    Skirt
    | Piston
    | Liner
    | Box
    | Plate
    | Sphere
    | Rectangle
    | Bar
    | Beam
    | Rigid
    | BladedSector
    | MeshFile
    | PlaneFile,
    Field(discriminator="kind"),
]
"""Any member, told apart by its `kind`."""
