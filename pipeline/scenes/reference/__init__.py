"""What a scene file may hold, from its models: JSON schema and reference of the keys."""
