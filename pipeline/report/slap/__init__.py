"""Slaps of a driven piston."""
