"""Calibration of strain gauges that measure a wrench, signals of their bridges, and wrenches from signals."""
