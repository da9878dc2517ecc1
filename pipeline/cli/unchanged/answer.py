"""A note of a run that had nothing to do, beside its results: what it was asked, all that it read, and its report.

The same command with the same inputs, records, results and program has the same report, and is answered from the note
with the standard library alone. Whatever else is found leads to the run itself.
"""

import argparse
import contextlib
import os
import sys
from pathlib import Path

from gudgeon.modaldb.keys import content_key
from gudgeon.pipeline.cli.unchanged.reads import Reads, digest
from gudgeon.pipeline.errors import PipelineError
from gudgeon.pipeline.files import read_sealed, results_folder, scene_path, write_sealed
from gudgeon.pipeline.stages.run_report import RunReport, StageReport
from gudgeon.solver.source_state import sources_state

NOTE = "unchanged.json"
ASKED = ("until", "scene", "set", "db", "out")
"""Options on which the report depends; those of one setting by tolerance are not answered from a note."""
VARIABLES = ("GUDGEON_DB", "HOME", "TMPDIR", "XDG_CACHE_HOME")
"""Variables of the environment that name places."""


def answered(options: argparse.Namespace) -> RunReport | None:
    """Return the report of a run command where its note says that nothing has changed since; None where it does not."""
    if options.tolerance is not None or getattr(options, "verbose", False):
        return None
    with contextlib.suppress(AttributeError, LookupError, OSError, PipelineError, TypeError):  # The run says so.
        noted = read_sealed(results_folder(scene_path(options.scene), options.out) / NOTE)
        if noted is None or noted["command"] != _command(options):
            return None
        if any(digest(path) != content for path, content in noted["files"].items()):
            return None
        stages = {name: StageReport(**stage, seconds=0.0) for name, stage in noted["stages"].items()}
        return RunReport(**noted["report"], stages=stages, files=tuple(noted["names"]))
    return None


def keep_note(options: argparse.Namespace, out: Path, report: RunReport, reads: Reads) -> None:
    """Keep the report of a run for `answered`, if nothing was computed and all is known that was read.

    Args:
        out: Folder of the results.
    """
    fresh = all(stage.state == "fresh" for stage in report.stages.values())
    if not (fresh and reads.complete) or options.tolerance is not None:
        return
    document = report.as_json()
    stages = {
        name: {key: v for key, v in stage.items() if key != "seconds"} for name, stage in document.pop("stages").items()
    }
    content = {"files": reads.files, "stages": stages, "report": document, "names": report.files}
    with contextlib.suppress(OSError, PipelineError, ValueError):  # It cannot be written, or a number is not finite.
        write_sealed(out / NOTE, content | {"command": _command(options)})


def _command(options: argparse.Namespace) -> str:
    """Return a key of the command, of what it depends on beside files, and of the program."""
    return content_key(
        {
            "options": {name: getattr(options, name) for name in ASKED},
            "folder": os.getcwd(),
            "variables": {name: os.environ.get(name) for name in VARIABLES},
            "program": [sources_state(), sys.version, *sys.path],
        }
    )
