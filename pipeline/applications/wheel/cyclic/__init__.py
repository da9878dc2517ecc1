"""Cyclic symmetry: a wheel of N equal sectors computed from one of them, and the effect of mistuning."""
