"""A body whose stiffness and mass another finite-element program assembled."""

from typing import Literal

from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.mesh_file import SurfaceShape, refuse_both
from gudgeon.solver.numbers import Length, Name, PositiveRatio, Strict

FILES = ("stiffness", "mass", "dofs", "model")


class Matrices(Strict):
    """Stiffness and mass of a body in files of CalculiX, Abaqus, Nastran, Ansys or Sierra/SD; superelements too."""

    kind: Literal["matrices"]
    stiffness: str = Field(
        description="File of the stiffness: .sti of CalculiX, .mtx of Abaqus (*MATRIX GENERATE), .op4 or DMIG (.pch,"
        " .bdf) of Nastran, .full and .sub of Ansys and reduced .nc4 or .exo of Sierra/SD with both matrices"
    )
    mass: str | None = Field(default=None, description="File of the mass; default: that of the stiffness")
    dofs: str | None = Field(
        default=None,
        description="File with node and direction of each row, such as .dof of CalculiX; default: all nodes in"
        " ascending order, each with as many directions as fit",
    )
    model: str | None = Field(
        default=None,
        description="File of nodes, elements and named sets: .inp, .bdf, .asm, .cdb, …; default: that of the stiffness,"
        " of formats that have nodes",
    )
    part: str | None = Field(default=None, description="Part of a deck of several, as it was modelled")
    instance: str | None = Field(default=None, description="Instance of a deck's assembly, as it is placed there")
    stiffness_name: str | None = Field(default=None, description="Name of the stiffness in a file with several")
    mass_name: str | None = Field(default=None, description="Name of the mass in a file with several")
    unit: Length = Field(default=1.0, description="Metres per unit of length of the files")
    mass_unit: PositiveRatio = Field(
        default=1.0,
        description="Kilograms per unit of mass of the files, whose time is in seconds: 1000 for mm, t and N",
    )
    surfaces: dict[Name, SurfaceShape] = Field(
        default={}, description="True shapes of sets by name; round contact surfaces need one"
    )

    def build(self, size: float | None) -> MeshRecord:
        """Read the files; `size` is not used.

        Raises:
            InputError: a file is missing or damaged, or they do not fit each other.
        """
        from gudgeon.pipeline.geometry.matrices.model import MatrixFiles
        from gudgeon.pipeline.geometry.matrices.reading import read_matrices

        model = self.model or self.stiffness
        refuse_both(self.part, self.instance, model)
        given = self.model_dump(mode="json", exclude={"kind"})
        given["model"] = model
        return read_matrices(MatrixFiles(**given))
