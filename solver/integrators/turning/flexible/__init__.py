"""Bodies of a mechanism that deform: floating frames, and points on them."""
