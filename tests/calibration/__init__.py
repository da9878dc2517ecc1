"""Calibration of stated errors: random scenes with exact answers, and stated over true errors by kind of scene."""
