"""Notes of a run."""
