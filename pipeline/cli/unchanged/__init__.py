"""Runs with nothing to do, answered from a note of the last one."""
