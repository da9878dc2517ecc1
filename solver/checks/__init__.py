"""Estimated errors of a run by its modal basis and its mesh, from further runs."""
