"""A component reduced to a modal record."""
