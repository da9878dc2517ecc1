"""Pictures of a wheel."""
