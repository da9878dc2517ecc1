"""Integrators over time, one folder each."""
