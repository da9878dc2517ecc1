"""Tests of calibration, signals and inferred wrenches."""
