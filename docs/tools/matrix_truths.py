"""`python -m docs.tools.matrix_truths FOLDER`: matrices of Abaqus against shift-invert and Exudyn's reader.

The folder has `NAME.inp` with `NAME_STIF1.mtx` and `NAME_MASS1.mtx`, or without the underscore, as
`main/pythonDev/TestModels/testData` of Exudyn's repository and its folder `abaqus`. Where ansys-mapdl-reader is
installed, the sample .full that comes with it follows.
"""

import sys
from pathlib import Path

import numpy as np
from scipy import sparse

from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.matrices.part import Matrices
from gudgeon.pipeline.modes.normal import normal_modes

COUNT = 12


def shift_invert(model: FEModel) -> np.ndarray:
    """Return the lowest elastic frequencies [rad/s] of a model's matrices, (COUNT,)."""
    K, M = model.free_matrices()
    rigid = len(model.rigid_twists)
    shift = -1e-3 * float(K.diagonal().max() / M.diagonal().max()) if rigid else 0.0
    values = sparse.linalg.eigsh(K, COUNT + rigid, M, sigma=shift, return_eigenvectors=False, tol=0)
    return np.sqrt(np.sort(values)[rigid:])


def by_exudyn(deck: Path, stiffness: Path, mass: Path) -> np.ndarray | None:
    """Return what Exudyn's reader and eigenvalue solver find [rad/s], (COUNT,); None where it is not installed."""
    try:
        from exudyn.FEM import FEMinterface
    except ImportError:
        return None
    fem = FEMinterface()
    instance = next(
        line.partition("name=")[2].split(",")[0] for line in deck.read_text().splitlines() if "*Instance" in line
    )
    fem.ImportFromAbaqusInputFile(str(deck), typeName="Instance", name=instance)
    fem.ReadMassMatrixFromAbaqus(str(mass))
    fem.ReadStiffnessMatrixFromAbaqus(str(stiffness))
    fem.ComputeEigenmodes(COUNT, excludeRigidBodyModes=6, useSparseSolver=True)
    return 2 * np.pi * np.asarray(fem.GetEigenFrequenciesHz())[:COUNT]


def row(name: str, part: Matrices, other: np.ndarray | None) -> str:
    """Return a line with the largest relative differences."""
    model = build_model(part.build(None), None, (), name)
    found = normal_modes(model, COUNT).angular_frequencies
    own = np.abs(found / shift_invert(model) - 1).max()
    against = "" if other is None else f", to Exudyn {np.abs(found / other - 1).max():.1e}"
    return (
        f"{name:16} {model.K.shape[0]:6} dofs, {model.mesh.cell_type:13} first {found[0] / (2 * np.pi):.8g} Hz,"
        f" difference to shift-invert {own:.1e}{against}"
    )


def main(folder: Path) -> None:
    """Print a line for each part of the folder."""
    for stiffness in sorted(folder.glob("*STIF1.mtx")):
        mass = stiffness.with_name(stiffness.name.replace("STIF1", "MASS1"))
        deck = folder / f"{stiffness.name.removesuffix('STIF1.mtx').removesuffix('_')}.inp"
        part = Matrices(kind="matrices", stiffness=str(stiffness), mass=str(mass), model=str(deck))
        print(row(deck.stem, part, by_exudyn(deck, stiffness, mass)), flush=True)
    try:
        from ansys.mapdl.reader import examples
    except ImportError:
        return
    part = Matrices(kind="matrices", stiffness=examples.fullfile, model=examples.hexarchivefile)
    print(row("file.full", part, None))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
