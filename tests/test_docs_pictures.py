"""Pictures in the documents: their captions, and figures on pages, are what stands in the pictures. Nothing is run."""

import re
from collections import defaultdict
from pathlib import Path

import pytest

pytest.importorskip("PIL")

from PIL import Image

from docs.tools.pictures import DOCS, PICTURES, ROOT, caption, captioned, copy, described, pages

FORGE = 900
"""Width from which a picture is legible where a forge shows README [px]."""
LARGEST = re.compile(r"largest force of (\S+): ([\d.]+ k?N)")
"""A contact's largest force, as pictures and their captions name it."""
UNTITLED: tuple[str, ...] = ()
"""Pictures without a description, which `make pictures` gives them."""


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_captions_are_what_pictures_say(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert text == captioned(text, page.parent), "run python -m docs.tools.pictures"


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_of_a_run_says_what_it_shows(name: str) -> None:
    assert (DOCS / name).is_file()
    if "@" not in PICTURES[name].file:
        assert bool(caption(DOCS / name)) == (name not in UNTITLED), "run make pictures"


def test_pictures_of_a_scene_have_one_largest_force() -> None:
    """`deformation.png` and `force.png` of the piston name the same force of a contact."""
    forces = defaultdict(set)
    for name, source in PICTURES.items():
        for match in LARGEST.finditer(described(DOCS / name)):
            forces[source.scene, match[1]].add(match[2])
    assert {contact for scene, contact in forces if scene == "piston"} >= {"thrust"}
    assert all(len(values) == 1 for values in forces.values()), forces


def test_pictures_of_readme_are_legible_on_a_forge() -> None:
    files = re.findall(r"!\[[^]]*\]\(([^)]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert files
    assert not [file for file in files if file.endswith(".gif") or Image.open(ROOT / file).width < FORGE]
    assert not [line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("| ![")]


def test_a_copy_has_the_description_and_a_caption(tmp_path: Path) -> None:
    from gudgeon.pipeline.plots.base import style

    with style.styled():
        figure = style.new_figure("Contact force", "piston  ·  one impact of 5.11 kN")
        figure.add_subplot().plot([0, 1], [0, 1])
        style.save(figure, tmp_path / "large.png")
    copy(tmp_path / "large.png", tmp_path / "small.png")
    assert Image.open(tmp_path / "small.png").width == 1000
    assert caption(tmp_path / "small.png") == "piston · one impact of 5.11 kN"
    assert described(tmp_path / "small.png").startswith("Contact force\npiston")
