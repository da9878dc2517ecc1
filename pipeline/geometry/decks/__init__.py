"""Readers of mesh files beside meshio's: decks of Abaqus and Ansys, and what gmsh reads."""
