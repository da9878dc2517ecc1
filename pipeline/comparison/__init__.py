"""Two records beside each other: their inputs, frequencies and mode shapes."""
