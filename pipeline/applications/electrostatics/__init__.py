"""Electrostatics of conductors by boundary elements; only scenes with conductors import it."""
