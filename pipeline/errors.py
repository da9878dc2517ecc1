"""Errors of the pipeline: one line each, naming file, key, value and what is allowed."""

import difflib
from collections.abc import Iterable
from typing import Any


class PipelineError(Exception):
    """Base of every error that the pipeline raises; its text is one line."""


class InputError(PipelineError):
    """The user's input is wrong: exit code 2."""


class StageError(PipelineError):
    """A stage failed on correct input: exit code 1."""


def closest(name: str, allowed: Iterable[str], cutoff: float = 0.6) -> str:
    """Return a question with the allowed name that resembles the given one; empty if there is none."""
    matches = difflib.get_close_matches(name, list(allowed), 1, cutoff)
    return f"did you mean '{matches[0]}'? " if matches else ""


def pandas() -> Any:
    """Return the library of tables.

    Raises:
        ImportError: it is not installed; the message has the command.
    """
    try:
        import pandas as library
    except ModuleNotFoundError:
        raise ImportError("to_frame needs pandas: pip install 'gudgeon[frames]'") from None
    return library
