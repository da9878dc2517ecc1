"""What a run found: histories, quantities, contact events, momentum."""
