"""Errors of the pipeline: one line each, naming file, key, value and what is allowed."""


class PipelineError(Exception):
    """Base of every error that the pipeline raises; its text is one line."""


class InputError(PipelineError):
    """The user's input is wrong: exit code 2."""


class StageError(PipelineError):
    """A stage failed on correct input: exit code 1."""
