"""What may stand in a scene file, read and checked; no numerics."""
