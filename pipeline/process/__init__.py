"""Processes: children that end with the one that started them, and time, memory and end of this one."""
