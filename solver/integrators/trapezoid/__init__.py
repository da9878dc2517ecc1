"""The implicit integrator."""
