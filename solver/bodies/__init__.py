"""Bodies of a scene and their coordinates."""
