"""Equations of docs/theory as pictures, for the site and the manual as one PDF; numbers of equations become links.

Pages have LaTeX between dollars, which GitHub and GitLab draw: `$R$` within a line, `$$…\\tag{4.2}$$` by itself. mkdocs
runs the functions `on_…` as a hook. Equations become SVG with their outlines, so that pages need no script and no font.
"""

import re
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parents[1] / "theory"
FORMULA = re.compile(r"\$\$(?P<display>.+?)\$\$|\$(?P<inline>[^$\n]+)\$", re.DOTALL)
TAG = re.compile(r"\\tag\{(\d+\.\d+)\}")
REFERENCE = re.compile(r"\((\d+\.\d+)\)")
HELD = re.compile(r"equation-held-(\d+)-([.,;:)]*)")
SIDE = re.compile(r' (width|height)="([\d.]+)"')
SIZE, TEXT = 17.0, 15.5
"""Size of a formula while it is drawn [px], and that of the text next to which it looks alike."""


def chapters() -> dict[str, Path]:
    """Return the pages of the manual in order, by the number of the chapter; the first one, with the symbols, is 0."""
    pages = sorted(FOLDER.glob("[0-9]*.md"), key=lambda path: int(path.stem.partition("-")[0]))
    return {"0": FOLDER / "README.md"} | {path.stem.partition("-")[0]: path for path in pages}


@lru_cache
def numbers() -> frozenset[str]:
    """Return the numbers of all equations of the manual."""
    return frozenset(tag for path in chapters().values() for tag in TAG.findall(path.read_text(encoding="utf-8")))


def svg(latex: str, *, display: bool) -> str:
    """Return an equation as SVG in the colour of the text, its baseline on that of the line."""
    import ziamath  # Of the extra `docs`, which tests do without.

    ziamath.config.svg2 = False
    formula = ziamath.Latex(latex.strip(), size=SIZE, inline=not display, color="currentColor")
    picture = formula.svg()
    style = ";".join(f"{side}:{float(value) / TEXT:.3f}em" for side, value in SIDE.findall(picture)[:2])
    if not display:
        style += f";vertical-align:{formula.getyofst() / TEXT:.3f}em"
    label = escape(" ".join(latex.split()), quote=True)
    return picture.replace("<svg ", f'<svg role="img" aria-label="{label}" style="{style}" ', 1)


def drawn(match: re.Match[str]) -> str:
    """Return the HTML of a formula, that of a numbered one with its number and an anchor."""
    if match["inline"] is not None:
        return svg(match["inline"], display=False)
    tags = TAG.findall(match["display"])
    picture = svg(TAG.sub("", match["display"]), display=True)
    number = f'<span class="number">({tags[0]})</span>' if tags else ""
    anchor = f' id="eq-{tags[0]}"' if tags else ""
    return f'<span class="equation"{anchor}><span class="formula">{picture}</span>{number}</span>'


def held_back(markdown: str) -> tuple[str, list[str]]:
    """Return a page whose formulas are words that Markdown leaves alone, and the HTML that replaces each of them."""
    pictures: list[str] = []

    def hold(match: re.Match[str]) -> str:
        pictures.append(drawn(match))
        return f"equation-held-{len(pictures) - 1}-"

    return FORMULA.sub(hold, markdown), pictures


def completed(html: str, pictures: list[str], target: str) -> str:
    """Return a page with its formulas, in which numbers of equations are links.

    Args:
        target: Place of an equation, with `{chapter}` and `{number}`.
    """

    def link(match: re.Match[str]) -> str:
        if match[1] not in numbers():
            return match[0]
        place = target.format(chapter=chapters()[match[1].partition(".")[0]].stem, number=match[1])
        return f'(<a href="{place}">{match[1]}</a>)'

    def put_back(match: re.Match[str]) -> str:
        # A line does not end between a formula and its punctuation.
        return (
            f'<span class="together">{pictures[int(match[1])]}{match[2]}</span>'
            if match[2]
            else pictures[int(match[1])]
        )

    return HELD.sub(put_back, REFERENCE.sub(link, html))


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Hold the formulas of a page of the manual back from Markdown."""
    if not page.file.src_uri.startswith("theory/"):
        return markdown
    text, page.meta["equations"] = held_back(markdown)
    return text


def on_page_content(html: str, *, page: Any, **_: Any) -> str:
    """Put the formulas of a page of the manual back."""
    pictures = page.meta.get("equations")
    return html if pictures is None else completed(html, pictures, "{chapter}.html#eq-{number}")
