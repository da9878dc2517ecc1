"""Eigenpairs of a component, their proof and their errors."""
