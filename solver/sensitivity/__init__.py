"""Derivatives of quantities of a run by one pass back over its steps."""
