"""How a body moves."""
