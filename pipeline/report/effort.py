"""The options of `gudgeon report`, and the head of a report that they lead to."""

import math
import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.process.machine import machine
from gudgeon.pipeline.report.document import Document
from gudgeon.pipeline.stages.base import SceneJob

TOLERANCE = 0.01
"""Default tolerance."""


@dataclass(frozen=True)
class Effort:
    """The options of the command."""

    repeat: int = 3
    """Timed runs of each setting, of which the fastest counts."""
    jobs: int = 1
    """Processes for runs that are not timed."""
    tolerance: float = TOLERANCE
    """Largest conservative error of the selected setting."""
    same_mesh: bool = False
    """Whether a setting is selected whatever the error of its mesh."""

    def __post_init__(self) -> None:
        if self.repeat < 1:
            raise InputError(f"report: repeat: {self.repeat} given; allowed: 1 or more")
        if not 0 < self.tolerance < 1:
            raise InputError(f"report: tolerance: {self.tolerance} given; allowed: between 0 and 1")


def new_document(job: SceneJob, how: Effort) -> Document:
    """Return the report of a scene on this machine before it has runs."""
    command = command_text(job.path, job.overrides, how)
    return Document(
        job.name, command, {"kind": "none", "source": ""}, machine(), version("gudgeon"), quantities=[], runs=[]
    )  # fmt: skip


def command_text(path: Path, overrides: Sequence[str], how: Effort) -> str:
    """Return the command that repeats the report of a scene."""
    words = ["gudgeon", "report", str(path)]
    for text in overrides:
        words += ["--set", text]
    if how.repeat != Effort.repeat:
        words += ["--repeat", str(how.repeat)]
    if how.tolerance != TOLERANCE:
        words += ["--tolerance", f"{how.tolerance:g}"]
    if how.same_mesh:
        words.append("--same-mesh")
    return shlex.join(words)


def parse_tolerance(text: str) -> float:
    """Return a tolerance given as `1%` or `0.01`.

    Raises:
        ValueError: it is neither, or not between 0 and 1.
    """
    match = re.fullmatch(r"\s*([0-9.]+(?:e[+-]?[0-9]+)?)\s*(%?)\s*", text, re.IGNORECASE)
    try:
        value = float(match[1]) * (0.01 if match[2] else 1.0) if match else math.nan
    except ValueError:
        value = math.nan
    if not 0 < value < 1:
        raise ValueError(f"{text!r} given; expected a tolerance between 0 and 1, such as 1% or 0.01")
    return value
