"""Measured time and memory, the machine, and windowed force histories."""
