"""The family of geometries: each member is a pydantic model whose `build(size)` returns a `MeshRecord`."""

from typing import Annotated

from pydantic import Field

from gudgeon.pipeline.geometry.cad.part import CadPart
from gudgeon.pipeline.geometry.matrices.part import Matrices
from gudgeon.pipeline.geometry.mesh_file import MeshFile
from gudgeon.pipeline.geometry.plane_file import PlaneFile
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.bladed_sector import BladedSector
from gudgeon.pipeline.geometry.shapes.box import Box
from gudgeon.pipeline.geometry.shapes.cylinder import Cylinder
from gudgeon.pipeline.geometry.shapes.frame import Frame
from gudgeon.pipeline.geometry.shapes.liner import Liner
from gudgeon.pipeline.geometry.shapes.piston import Piston
from gudgeon.pipeline.geometry.shapes.plane import Rectangle
from gudgeon.pipeline.geometry.shapes.plate import Plate
from gudgeon.pipeline.geometry.shapes.rigid import Rigid
from gudgeon.pipeline.geometry.shapes.ring import Ring
from gudgeon.pipeline.geometry.shapes.skirt import Skirt
from gudgeon.pipeline.geometry.shapes.sphere import Sphere

Geometry = Annotated[
    Skirt
    | Piston
    | Liner
    | Box
    | Plate
    | Sphere
    | Cylinder
    | Rectangle
    | Ring
    | Bar
    | Beam
    | Frame
    | Rigid
    | BladedSector
    | CadPart
    | MeshFile
    | Matrices
    | PlaneFile,
    Field(discriminator="kind"),
]
"""Any member, discriminated by its `kind`."""
