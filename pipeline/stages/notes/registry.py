"""The notes that runs of scenes give, in the order in which they are printed: one line each, with figure and key."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from gudgeon.pipeline.stages.keys.products import STAGES
from gudgeon.pipeline.stages.notes import beams, decks, estimates, frequencies, impacts, joints, run, scene
from gudgeon.pipeline.stages.notes.facts import Facts


class Note(NamedTuple):
    """A kind of note."""

    text: Callable[[Any], Iterable[str]]
    """Yields a line for each member of the scene that it concerns; of `Facts`, or of `Parts` where these suffice."""
    after: str
    """The first stage whose runs give it."""


NOTES: Mapping[str, Note] = {
    "found interfaces": Note(lambda facts: facts.job.found, "mesh"),
    "left out": Note(scene.left_out, "mesh"),
    "units": Note(scene.units, "mesh"),
    "deck materials": Note(decks.deck_materials, "mesh"),
    "extents": Note(scene.extents, "mesh"),
    "gravity": Note(scene.gravity, "mesh"),
    "laws": Note(scene.laws, "solve"),
    "step limit": Note(run.step_limit, "solve"),
    "edges": Note(run.edges, "solve"),
    "energy": Note(run.energy, "solve"),
    "gaps": Note(run.gaps, "solve"),
    "probes": Note(run.probes, "solve"),
    "solver": Note(run.solver, "solve"),
    "impacts": Note(impacts.impacts, "solve"),
    "ringing": Note(joints.ringing, "solve"),
    "patches": Note(estimates.patches, "solve"),
    "step error": Note(estimates.step, "solve"),
    "basis error": Note(estimates.basis, "solve"),
    "mesh error": Note(estimates.mesh, "solve"),
    "grid error": Note(estimates.grid, "solve"),
    "reused modes": Note(scene.reused_modes, "morph"),
    "certified modes": Note(scene.certified_modes, "modes"),
    "coarse meshes": Note(frequencies.coarse, "mesh"),
    "coarse volumes": Note(frequencies.volumes, "mesh"),
    "parted modes": Note(frequencies.parted, "mesh"),
    "short beams": Note(beams.short, "mesh"),
}
"""Notes by name. Modes that are in the database are judged by every run."""


def notes(facts: Facts, until: str) -> list[str]:
    """Return the notes of a run up to a stage."""
    stages = STAGES[: STAGES.index(until) + 1]
    return [line for note in NOTES.values() if note.after in stages for line in note.text(facts)]


def run_notes(facts: Facts) -> list[str]:
    """Return the notes on the solution alone, not those on components."""
    return [line for note in NOTES.values() if note.after == "solve" for line in note.text(facts)]
