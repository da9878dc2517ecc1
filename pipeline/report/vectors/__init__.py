"""How many vectors, and of which kind, a force that moves over a held body needs; what other ones cost."""
