"""Scenes of wheels: a sector, its cyclic symmetry, mistuned blades, and their response to an engine order.

`scene` is the file, `job` its products, `stages` and `response` what makes them, `report` compares the choices of kept
interface.
"""
