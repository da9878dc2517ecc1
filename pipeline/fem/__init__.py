"""Mesh, material and supports to stiffness, mass and rigid motions."""
