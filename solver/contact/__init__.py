"""Gaps and their forces: rows, pairing, compliance, the complementarity problem."""
