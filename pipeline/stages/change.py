"""Design changes with unchanged modes: what they are estimated to change, and whether that is within the tolerance."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.job import Job


def change_estimates(job: Job) -> dict[str, dict[str, Any]]:
    """Return the estimates of each component that reuses modes, and its tolerance; empty before the stage `morph`."""
    estimates_of = {}
    for name, steps in job.components().items():
        key = steps["morph"].key
        if steps["morph"].inputs["update"] != "reuse" or not job.store.has(key):
            continue
        quality = job.store.get(key, "morph", only=["quality"]).quality
        if "frequency_changes" in quality:
            estimates = {entry: quality[entry] for entry in ("frequency_changes", "compliance_changes")}
            estimates_of[name] = estimates | {"tolerance": job.scene.component[name].change.tolerance}
    return estimates_of


def certified_text(design: Mapping[str, Any]) -> str:
    """Return how certified modes were computed and their estimated errors, as text.

    Args:
        design: Entry `DESIGN` of the quality of their record.
    """
    stored = f"{len(design['designs'])} stored design{'s' if len(design['designs']) > 1 else ''}"
    if design["way"] == "recompute":
        return f"modes are recomputed: from {stored} no way is within the tolerance"
    steps = f" in {design['steps']} step{'s' if design['steps'] > 1 else ''}" if design["steps"] else ""
    errors = [f"{np.abs(design['frequency_errors']).max(initial=0.0):.1e} in frequency"]
    if compliances := design["compliance_errors"]:
        name = max(compliances, key=lambda n: abs(compliances[n]))
        errors.append(f"{abs(compliances[name]):.1e} in compliance (interface '{name}')")
    errors.append(f"{design['row_error']:.1e} in that of random forces")
    return f"modes by '{design['way']}'{steps} from {stored}; estimated errors: {', '.join(errors)}"


def refuse_reuse(job: Job) -> None:
    """Raise an InputError where an estimated change of a component that reuses modes is above its tolerance."""
    for name, entry in change_estimates(job).items():
        change, allowed = f"component.{name}.change", entry["tolerance"]
        if any(abs(value) > allowed for value in largest_changes(entry).values()):
            with named(job.path, InputError):
                raise InputError(
                    f"{change}.update: 'reuse' given, the profile is estimated to change {change_text(entry)}; allowed:"
                    f" {change}.tolerance = {allowed:.2%}; use update = 'certified' or 'recompute', or a larger"
                    " tolerance"
                )


def change_text(entry: Mapping[str, Any]) -> str:
    """Return the largest changes of frequencies and of compliance as text."""
    return " and ".join(words.format(f"{value:+.2%}") for words, value in largest_changes(entry).items())


def largest_changes(entry: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest change of frequencies and of compliance, by the words for them."""
    changes = {}
    if frequencies := entry["frequency_changes"]:
        mode = max(range(len(frequencies)), key=lambda i: abs(frequencies[i]))
        changes[f"frequencies by up to {{}} (mode {mode + 1})"] = frequencies[mode]
    if compliances := entry["compliance_changes"]:
        name = max(compliances, key=lambda n: abs(compliances[n]))
        changes[f"compliance by up to {{}} (interface '{name}')"] = compliances[name]
    return changes
