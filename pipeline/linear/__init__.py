"""Linear analysis of a scene: tables and picture."""
