"""Seconds, memory, the machine, and windows on histories."""
