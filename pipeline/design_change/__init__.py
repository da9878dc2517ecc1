"""Design changes: moved nodes, with the modes of the original design or new ones."""
