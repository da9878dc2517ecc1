"""Bulk data of Nastran: cards, grid points, solids, and what they say beside a mesh."""
