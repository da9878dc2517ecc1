"""Errors of the solver: one line each."""


class SolverError(Exception):
    """Base of every error that the solver raises; its text is one line."""


class SceneError(SolverError):
    """The scene is inconsistent, or something that it needs is missing from its bodies and records."""
