"""The machine that this process runs on; light, of the standard library alone."""
