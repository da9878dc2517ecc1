"""Wear over many cycles: runs with worn shapes, and how far their wear is carried on."""
