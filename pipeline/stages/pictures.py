"""The plot stage of any kind of scene: pictures are drawn again only if an input of theirs has changed."""

import json
import time
from collections.abc import Callable
from pathlib import Path

from gudgeon.modaldb.keys import content_key, file_digest
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.run_report import Progress, StageReport
from gudgeon.pipeline.stages.status import fresh_pictures

Draw = Callable[[], tuple[list[Path], list[str]]]
"""Draws the pictures and returns them, with a note for each that could not be drawn."""


def plot_stage(job: SceneJob, draw: Draw, tell: Progress) -> tuple[StageReport, list[str], list[str]]:
    """Draw a job's pictures unless fresh ones are in its folder; return the stage's report, the files and the notes."""
    start, key = time.perf_counter(), content_key(job.pictures())
    if (pictures := fresh_pictures(job, key)) is not None:
        return StageReport("fresh", time.perf_counter() - start, key), pictures, []
    drawn, notes = draw()
    if not notes:
        digests = {path.name: file_digest(path) for path in drawn}
        write_text(job.out / "pictures.json", json.dumps({"key": key, "files": digests}, indent=1))
    tell("plot", 1.0)
    return StageReport("ran", time.perf_counter() - start, key), [str(path) for path in drawn], notes
