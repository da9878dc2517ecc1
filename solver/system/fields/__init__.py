"""Fields of a scene compiled against its records."""
