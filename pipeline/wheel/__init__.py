"""Scenes of wheels: a sector, its cyclic symmetry, mistuned blades, and their response to an engine order.

`settings` is the file, `job` the stages, `solve` what they make, `report` every choice of kept interface.
"""
