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
LARGEST = re.compile(r"(?:largest force of (?P<before>\S+): |(?P<after>\S+): largest force )(?P<value>[\d.]+ k?N)")
"""A contact's largest force, as pictures name it."""
PRINTED = re.compile(r"^ +force_peak +(?P<value>[\d.]+) (?P<unit>k?N)$", re.MULTILINE)
DIGITS = 3
"""Of numbers in pictures."""


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_captions_are_what_pictures_say(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert text == captioned(text, page.parent), "run python -m docs.tools.pictures"


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_of_a_run_says_what_it_shows(name: str) -> None:
    assert (DOCS / name).is_file()
    if "@" not in PICTURES[name].file:
        assert caption(DOCS / name), "run make pictures"


def test_pictures_of_a_scene_have_one_largest_force() -> None:
    """`deformation.png` and `force.png` of the piston name the same force of a contact."""
    forces = defaultdict(set)
    for name, source in PICTURES.items():
        for match in LARGEST.finditer(described(DOCS / name)):
            forces[source.scene, match["before"] or match["after"]].add(match["value"])
    assert {contact for scene, contact in forces if scene == "piston"} >= {"thrust"}
    assert all(len(values) == 1 for values in forces.values()), forces


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_forces_in_pictures_are_those_that_pages_print(page: Path) -> None:
    """Where a page prints `force_peak` and shows a picture of a force, one of the printed values is the picture's."""
    text = page.read_text(encoding="utf-8")
    printed = {f"{float(m['value']):.{DIGITS}g} {m['unit']}" for m in PRINTED.finditer(text)}
    for file in re.findall(r"^!\[[^]]*\]\(([^)]+\.png)\)", text, re.MULTILINE) if printed else ():
        shown = re.findall(r"(?:largest|force of \S+:) ([\d.]+ k?N)", described((page.parent / file).resolve()))
        assert not shown or printed & {f"{float(v.split()[0]):.{DIGITS}g} {v.split()[1]}" for v in shown}, file


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
