"""The implicit integrator for every feature: all ports of a system respond together."""
