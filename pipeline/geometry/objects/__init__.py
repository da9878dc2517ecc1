"""Meshes and matrices of Python that stand where a scene names a file of a geometry."""
