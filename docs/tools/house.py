"""`python -m docs.tools.house`: draw the map of the house, docs/house.svg, from the floors that its test holds."""

from html import escape
from pathlib import Path

from tests.test_layers import FLOORS

PICTURE = Path(__file__).resolve().parents[1] / "house.svg"
COLOURS = {"modaldb": "#dbe9f6", "solver": "#fde3c8", "pipeline": "#dff0d8", "gudgeon": "#eee4f4"}
"""Of the rooms of each package."""
WIDE, HIGH, GAP = 132, 24, 6
"""Size of a room and distance between two [px]."""
ACROSS = 6
"""Rooms in a row."""
HEAD = "A file imports its own room and rooms below; the ground is at the bottom."


def rows() -> list[list[str]]:
    """Return the rooms of each row, from the roof to the ground; a floor of many rooms has several rows."""
    found: list[list[str]] = []
    for rooms in reversed(FLOORS):
        found += [list(rooms[k : k + ACROSS]) for k in range(0, len(rooms), ACROSS)]
    return found


def page() -> str:
    """Return the picture as SVG, with a line between two floors."""
    width, y = ACROSS * (WIDE + GAP) + GAP, 30
    firsts = {rooms[0] for rooms in FLOORS}
    shapes = [f'<text x="{GAP}" y="18" font-weight="bold">{escape(HEAD)}</text>']
    for number, rooms in enumerate(rows()):
        if number and rooms[0] in firsts:
            shapes.append(f'<line x1="0" x2="{width}" y1="{y - GAP / 2}" y2="{y - GAP / 2}" stroke="#bbb"/>')
        for k, room in enumerate(rooms):
            x, (package, _, name) = GAP + k * (WIDE + GAP), room.partition(".")
            colour, label = COLOURS[package], name.removeprefix("applications.") or package
            shapes.append(
                f'<rect x="{x}" y="{y}" width="{WIDE}" height="{HIGH}" rx="3" fill="{colour}" stroke="#888"/>'
            )
            shapes.append(f'<text x="{x + WIDE / 2:g}" y="{y + 16}" text-anchor="middle">{escape(label)}</text>')
        y += HIGH + GAP
    for k, (package, colour) in enumerate(COLOURS.items()):
        x = GAP + k * (WIDE + GAP)
        shapes.append(f'<rect x="{x}" y="{y + 8}" width="14" height="14" fill="{colour}" stroke="#888"/>')
        shapes.append(f'<text x="{x + 20}" y="{y + 20}">{package}</text>')
    body = "\n".join(shapes)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{y + 34}" font-family="sans-serif"'
        f' font-size="12">\n<rect width="100%" height="100%" fill="white"/>\n{body}\n</svg>\n'
    )


if __name__ == "__main__":
    PICTURE.write_text(page(), encoding="utf-8")
