"""Models of the dynamics in a scene file: bodies, contacts, the run."""
