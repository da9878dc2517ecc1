"""CAD files for tests: parts drawn here by OpenCASCADE, and those of others that come with gmsh."""

import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gmsh

from gudgeon.pipeline.geometry.cad.part import CadPart
from gudgeon.pipeline.geometry.quiet import quiet_stdout

EXAMPLES = Path(sysconfig.get_path("data")) / "share/doc/gmsh/examples"
COMPONENT, ASSEMBLY = EXAMPLES / "boolean/component8.step", EXAMPLES / "api/as1-tu-203.stp"
COLOURS = EXAMPLES / "api/step_boundary_colors.stp"

Draw = Callable[[Any], object]


def write_cad(path: Path, draw: Draw) -> Path:
    """Draw a part by OpenCASCADE in mm and write it to a file of CAD."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        with quiet_stdout():
            gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


def bracket(occ: Any) -> None:
    """Draw an angle with a blend of 10 mm, a bore of radius 11, two holes of 4.5, one of them countersunk."""
    body, _ = occ.fuse([(3, occ.addBox(0, 0, 0, 80, 40, 8))], [(3, occ.addBox(0, 0, 0, 8, 40, 60))])
    occ.synchronize()
    inner = gmsh.model.getEntitiesInBoundingBox(7.9, -1, 7.9, 8.1, 41, 8.1, 1)
    blended = occ.fillet([body[0][1]], [inner[0][1]], [10.0])
    tools = [(3, occ.addCylinder(55, y, -1, 0, 0, 10, 4.5)) for y in (10, 30)]
    tools += [(3, occ.addCylinder(-1, 20, 42, 10, 0, 0, 11)), (3, occ.addCone(55, 10, 6, 0, 0, 2, 4.5, 6.5))]
    occ.cut(blended, tools)


def part(path: Path | str, **more: Any) -> CadPart:
    """Return the geometry of a file."""
    return CadPart.model_validate({"kind": "cad", "path": str(path), **more})
