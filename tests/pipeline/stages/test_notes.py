"""The registry of notes: what each says is in its function, and which ones no test shows."""

import inspect
import re
from pathlib import Path

from gudgeon.pipeline.stages.keys.products import STAGES
from gudgeon.pipeline.stages.notes.registry import NOTES

TESTS = Path(__file__).parents[2]
PHRASES = {
    "found interfaces": "were found,",
    "left out": "is left out: ",
    "units": "give a wave speed",
    "certified modes": "estimated errors: ",
    "deck materials": "the deck's material has",
    "grid error": "the estimated error of the grid of poses is",
    "ringing": "is that of a vibration, which rings",
    "extents": "its largest extent is",
    "gravity": "a thousand times that of the earth",
    "laws": " delivered",
    "step limit": "exceeds the limit of integrator",
    "edges": "of the impulse of contact",
    "energy": "of the energy exchanged",
    "gaps": "no contact touched",
    "probes": "the nearest point of its interface is read",
    "solver": "",
    "impacts": "is closed at the end of the run",
    "patches": "of a curved or tilted surface",
    "step error": "its estimated error is",
    "basis error": "modal basis",
    "mesh error": "error of the mesh",
    "reused modes": "modes are reused",
    "coarse meshes": "the mesh error of the contact's flexibility",
    "coarse volumes": "that within its true surfaces",
    "parted modes": "part a group of equal frequencies",
    "short beams": "geometry.theory",
}
"""What each note says, as tests expect it; empty where the text is given by the solver."""
UNSEEN = {"edges", "grid error", "probes"}
"""Notes that no scene of the tests shows."""


def test_every_note_is_shown_by_a_test_or_listed() -> None:
    assert PHRASES.keys() == NOTES.keys()
    paths = [path for path in TESTS.rglob("*.py") if path != Path(__file__)]
    texts = [re.sub(r"""["']\s+r?f?["']""", "", path.read_text()) for path in paths]
    assert {name for name, phrase in PHRASES.items() if not any(phrase in text for text in texts)} == UNSEEN


def test_a_note_has_a_stage_and_says_what_it_yields() -> None:
    for name, note in NOTES.items():
        assert note.after in STAGES, name
        assert name == "found interfaces" or (inspect.getdoc(note.text) or "").startswith("Yield "), name
