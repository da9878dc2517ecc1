"""Parts from CAD: STEP, IGES and BREP files and gmsh's scripts, their solids, their faces, and meshes of them."""
