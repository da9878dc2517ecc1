"""Tests of what the solver reads of the machine."""
