"""Processes that end with the one that started them, for libraries that may end the process they run in."""
