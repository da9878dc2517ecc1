"""Tests of the linear analysis."""
