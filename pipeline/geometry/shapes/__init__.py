"""Built-in parametric shapes, one a file."""
