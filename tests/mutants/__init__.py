"""Deliberate faults, one at a time, against the tests that lie nearest: `make mutants`."""
