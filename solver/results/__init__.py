"""Results of a run: histories, quantities, contact events, momentum."""
