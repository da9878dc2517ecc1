"""Decks of Abaqus and CalculiX: keywords, sets, and what they say beside a mesh."""
