"""`python -m gudgeon.pipeline.plots.child JOB.json`: draws one group of pictures and writes a line each to stdout:

`begin N` for the number of drawing functions, `drawn NAME` for a complete file, `note TEXT` for a picture that could
not be drawn, and `end drawn` or `end empty` after each function.
"""

import importlib
import json
import sys
import traceback
from pathlib import Path

from gudgeon import modaldb
from gudgeon.pipeline.plots import DRIVEN, PLOTS, TURNING
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.process.lifeline import end_with_parent


def main(job_path: str) -> None:
    """Draw the pictures of the job; one that fails is noted, and the others are drawn."""
    job = json.loads(Path(job_path).read_text())
    files: list[str] = []

    def drawn(name: str) -> None:
        files.append(name)
        _tell("drawn", name)

    drawing = Drawing(
        modaldb.open(job["store"]), job["key"], job["scene"], Path(job["out"]), Path(job["scratch"]), drawn,
        compare=job["compare"], reference=job["reference"],
    )  # fmt: skip
    foreign = job["pictures"]
    pictures = (foreign or (TURNING if drawing.turning else DRIVEN if drawing.driven else PLOTS))[job["group"]]
    _tell("begin", str(len(pictures)))
    for name, function in pictures.items():
        before = len(files)
        module, _, attribute = function.partition(":")
        try:
            getattr(importlib.import_module(module), attribute)(drawing)
        except ModuleNotFoundError as error:
            _tell("note", f"{name} was not drawn: {error.name} is not installed; pip install 'gudgeon[plots]'")
        except Exception as error:
            # Any error of a drawing library: the result is valid, and other pictures can be drawn.
            traceback.print_exc()
            reason = (str(error).splitlines() or [""])[0]
            _tell("note", f"{name} was not drawn: {type(error).__name__}: {reason}")
        _tell("end", "drawn" if len(files) > before else "empty")


def _tell(event: str, value: str) -> None:
    print(event, value, flush=True)


if __name__ == "__main__":
    end_with_parent()
    main(sys.argv[1])
