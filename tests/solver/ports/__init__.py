"""Tests of `solver.ports`."""
