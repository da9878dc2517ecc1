"""The theory manual: equations are numbered through and found, figures and modules exist, formulas are well formed."""

import re
from pathlib import Path

import pytest

from docs.tools import equations

ROOT = Path(__file__).resolve().parents[1]
PAGES = equations.chapters()
MODULE = re.compile(r"`((?:solver|pipeline|modaldb)/[\w/.]+)`")


def text_of(chapter: str) -> str:
    return PAGES[chapter].read_text(encoding="utf-8")


@pytest.mark.parametrize("chapter", PAGES)
def test_equations_are_numbered_through(chapter: str) -> None:
    """Each chapter counts from 1 on; a number in brackets that looks like one of them is one."""
    text = text_of(chapter)
    tags = equations.TAG.findall(text)
    assert tags == [f"{chapter}.{i}" for i in range(1, len(tags) + 1)]
    assert chapter == "0" or (len(tags) > 3 and text.startswith(f"# {chapter} "))
    assert [n for n in equations.REFERENCE.findall(text) if n not in equations.numbers()] == []


@pytest.mark.parametrize("chapter", PAGES)
def test_formulas_are_closed(chapter: str) -> None:
    """Dollars come in pairs, and none is left where formulas are taken out; a table has no bar within a formula."""
    text = text_of(chapter)
    assert "$" not in equations.FORMULA.sub("", text)
    assert [m[0] for m in equations.FORMULA.finditer(text) if m["display"] and m[0].count("\n\n")] == []
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert [m[0] for row in rows for m in equations.FORMULA.finditer(row) if "|" in m[0]] == []


@pytest.mark.parametrize("chapter", PAGES)
def test_modules_exist(chapter: str) -> None:
    """Every chapter but the first names what computes it, and that is there."""
    modules = MODULE.findall(text_of(chapter))
    assert chapter == "0" or modules
    assert [path for path in modules if not (ROOT / path).exists()] == []


def test_figures_are_shown_and_drawn() -> None:
    """Each figure is on a page, and the tools draw it."""
    shown = [name for chapter in PAGES for name in re.findall(r"\]\(([\w-]+)\.svg\)", text_of(chapter))]
    assert sorted(shown) == sorted(path.stem for path in equations.FOLDER.glob("*.svg"))
    tools = "".join((ROOT / f"docs/tools/theory_{part}.py").read_text() for part in ("figures", "schemes"))
    assert [name for name in shown if f'"{name}":' not in tools] == []


def test_numbers_become_links(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reference leads to the formula of its number in the page of its chapter; punctuation stays with a formula."""
    monkeypatch.setattr(equations, "svg", lambda latex, *, display: f"<{latex.strip()}|{display}>")
    text, pictures = equations.held_back("By (4.2) and (99.1) $a$:\n\n$$\nb \\tag{4.2}\n$$\n")
    html = equations.completed(text, pictures, "{chapter}.html#eq-{number}")
    assert '(<a href="4-contact.html#eq-4.2">4.2</a>) and (99.1) <span class="together"><a|False>:</span>' in html
    assert 'id="eq-4.2"><span class="formula"><b|True></span><span class="number">(4.2)</span>' in html
