"""Linear analysis of a scene at a state: assembled modes and frequency responses."""
