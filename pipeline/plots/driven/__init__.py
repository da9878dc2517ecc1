"""Pictures of driven mechanisms."""
