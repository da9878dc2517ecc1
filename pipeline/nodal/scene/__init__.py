"""Scenes as problems of the full FE."""
