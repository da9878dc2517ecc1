"""A change of the design: nodes move, modes stay."""
