"""What a scene file may say of the dynamics: bodies, contacts, the run."""
