"""Errors of the pipeline: one line each, naming file, key, value and what is allowed."""

from typing import Any


class PipelineError(Exception):
    """Base of every error that the pipeline raises; its text is one line."""


class InputError(PipelineError):
    """The user's input is wrong: exit code 2."""


class StageError(PipelineError):
    """A stage failed on correct input: exit code 1."""


def pandas() -> Any:
    """Return the library of tables.

    Raises:
        ImportError: it is not installed; the message has the command.
    """
    try:
        import pandas as found
    except ModuleNotFoundError:
        raise ImportError("to_frame needs pandas: pip install 'gudgeon[frames]'") from None
    return found
