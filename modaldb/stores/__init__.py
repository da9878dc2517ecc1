"""Stores that keep records."""
