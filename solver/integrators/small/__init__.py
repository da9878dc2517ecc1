"""Small motion, every feature: all ports of a system respond together."""
