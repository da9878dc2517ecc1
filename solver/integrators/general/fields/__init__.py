"""Fields in the loop over ports."""
