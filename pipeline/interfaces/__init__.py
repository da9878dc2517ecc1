"""Rows of a body: displacements conjugate to contact forces, loads, ties and gauges."""
