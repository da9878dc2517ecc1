"""Scenes with friction on elastic bodies against exact solutions: `mindlin` (N1), `cattaneo` (N2), `bar` (N3)."""
