"""Pictures of contact over time."""
