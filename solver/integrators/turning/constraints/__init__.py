"""Rows of joints, their pattern, and multipliers."""
