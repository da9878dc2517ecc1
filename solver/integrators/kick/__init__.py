"""The explicit integrator."""
