"""The reference of a scene's contact force over time, for its picture: of its file, or its finest full-FE run."""

import json
from collections.abc import Callable
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.scenes.reading import find_file


def reference_curve(path: Path, scene: SceneFile, full_fe: Callable[[float], str | None]) -> dict[str, Any] | None:
    """Return `label` with `times` [s] and `force` [N] of the scene's contact, or with the `key` of a full-FE run.

    `report.history` and `report.pulse` name values of the reference file; without them it is the finest full-FE run of
    `report.full_fe` that is in the database, if any.

    Args:
        path: Of the scene file.
        full_fe: Returns the key of the full-FE run with a step [s]; None if it is not in the database.

    Raises:
        InputError: the file does not have these values, or the scene has several contacts.
    """
    report = scene.report
    if report.reference is not None and (report.history or report.pulse):
        if (count := len(scene.contact)) != 1:
            raise InputError(f"{path}: report.history, report.pulse: {count} contacts; allowed with one contact")
        path = find_file(report.reference, path.parent, "report.reference")
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            if report.history:
                keys = report.history.split("/") if report.history != "." else ()
                node: Any = reduce(getitem, keys, content["histories"])
                times, force = ([float(value) for value in node[name]] for name in ("t", "F"))
            else:
                pulse = report.pulse
                assert pulse is not None
                height, duration = (
                    float(content["expected"][name]["value"]) for name in (pulse.height, pulse.duration)
                )
                times, force = [0.0, duration, duration, max(duration, scene.run.duration)], [height, height, 0.0, 0.0]
            if len(times) != len(force):
                raise ValueError(f"{len(times)} times and {len(force)} forces")
        except (ValueError, LookupError, TypeError) as error:
            raise InputError(f"{path}: no force as report.history or report.pulse names it ({error})") from error
        return {"label": path.name, "times": times, "force": force}
    for step in sorted(report.full_fe.steps) if report.full_fe is not None else ():
        if (key := full_fe(step)) is not None:
            return {"label": f"full FE, step {step:.3g} s", "key": key}
    return None
