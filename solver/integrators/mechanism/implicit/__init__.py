"""Implicit steps of a mechanism, whose size the frequencies of bodies that deform do not bound."""
