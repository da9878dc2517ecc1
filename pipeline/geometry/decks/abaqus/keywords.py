"""Lines of decks of Abaqus and CalculiX as keywords with options and data, whatever files they stand in.

Keywords and options in any case, with blanks; a keyword line that ends with a comma goes on in the next line;
`*INCLUDE` and `INPUT=` name files from the deck's folder, nested; names in quotes keep blanks and commas.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.model import FARTHEST, Source, whole
from gudgeon.pipeline.geometry.decks.texts import deck_text

DEPTH = 20
"""Levels of files that include each other."""
MOST_LINES = 50_000_000
"""Lines of a deck with its files: files that include others twice stand for endless ones."""
COMMA, OUTSIDE = re.compile(","), re.compile(r',(?=(?:[^"]*"[^"]*")*[^"]*$)')
"""Between words; and where some are quoted."""
FILLED = ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "EQUATION")
"""Keywords whose data may stand in a file that INPUT names."""
SHOWN = 60
"""Characters of a line in a message."""


class Line(NamedTuple):
    """A line without comments and blanks around it."""

    text: str
    path: str
    line_number: int
    """From 1."""

    @property
    def source(self) -> Source:
        """Where it stands."""
        return Source(self.path, self.line_number)

    def words(self) -> list[str]:
        """Return what stands between commas, without quotes and blanks around it, and without a trailing comma."""
        words = [word.strip().strip('"') for word in (OUTSIDE.split if '"' in self.text else COMMA.split)(self.text)]
        return words[:-1] if not words[-1] else words

    def integers(self) -> list[int]:
        """Return its whole numbers; blanks between commas are left out.

        Raises:
            InputError: a word is no number.
        """
        try:
            return [whole(w) for w in self.text.split(",") if w and not w.isspace()]
        except ValueError:
            pass
        try:
            numbers = [_real(w) for w in self.text.split(",") if w.strip()]
            if all(abs(x) < 2.0**53 and x == int(x) for x in numbers):
                return [int(x) for x in numbers]
        except (ValueError, OverflowError):
            pass
        raise self.source.error(f"{self.text[:SHOWN]!r}, expected whole numbers")

    def reals(self) -> list[float]:
        """Return its numbers; a blank is zero.

        Raises:
            InputError: a word is no finite number.
        """
        try:
            return [_real(w) for w in self.words()]
        except (ValueError, OverflowError):
            raise self.source.error(f"{self.text[:SHOWN]!r}, expected finite numbers") from None


def _real(word: str) -> float:
    word = word.strip()
    if not word:
        return 0.0
    try:
        value = float(word)
    except ValueError:
        value = float(word.upper().replace("D", "E"))
    if not abs(value) < FARTHEST:
        raise ValueError(word)
    return value


class Keyword(NamedTuple):
    """A keyword with its data."""

    name: str
    """In upper case, without the star: `ELEMENT`."""
    options: dict[str, str]
    """By names in upper case; an option without value is empty."""
    rows: list[Line]
    source: Source

    def option(self, name: str) -> str:
        """Return an option that is needed.

        Raises:
            InputError: it is missing.
        """
        if not self.options.get(name):
            raise self.source.error(f"*{self.name} without {name}")
        return self.options[name]


def read_keywords(path: str) -> Iterator[Keyword]:
    """Yield the keywords of a deck and of the files that it includes.

    Raises:
        InputError: a file is missing or includes itself, or a keyword has no name.
    """
    head: Line | None = None
    rows: list[Line] = []
    for line in _lines(path, path, ()):
        if line.text.startswith("*"):
            if head is not None:
                yield _whole(head, rows, path)
            head, rows = line, []
        elif head is None:
            continue  # What stands before all keywords means nothing.
        elif not rows and head.text.endswith(",") and _goes_on(line.text):
            head = head._replace(text=head.text + line.text)
        else:
            rows.append(line)
    if head is not None:
        yield _whole(head, rows, path)


def _goes_on(text: str) -> bool:
    """Return whether a line is one of options, not of data: its first word begins with a letter."""
    return text[:1].isalpha()


def _whole(head: Line, rows: list[Line], deck: str) -> Keyword:
    """Return a keyword with the data of the file that it names by INPUT."""
    words = head.words()
    options = {}
    for word in words[1:]:
        key, _, value = word.partition("=")
        options[" ".join(key.split()).upper()] = value.strip().strip('"')
    name = " ".join(words[0].lstrip("* \t").split()).upper() if words else ""
    if not name:
        raise head.source.error(f"{head.text[:SHOWN]!r}, expected a keyword")
    file = options.get("INPUT")
    if file and name in FILLED:
        rows = [*_lines(_beside(deck, file, head.source), deck, (), head.source), *rows]
        if (misplaced := next((row for row in rows if row.text.startswith("*")), None)) is not None:
            raise misplaced.source.error(f"{misplaced.text[:SHOWN]!r}, expected data of *{name}, which reads this file")
    return Keyword(name, options, rows, head.source)


def _lines(path: str, deck: str, above: tuple[str, ...], named: Source | None = None) -> Iterator[Line]:
    """Yield the lines of a file, with those of `*INCLUDE` in their place; comments and blank lines are left out."""
    if len(above) > DEPTH or path in above:
        raise (named or Source(path, 0)).error(f"*INCLUDE of {path}, which includes itself")
    try:
        text = deck_text(path)
    except OSError as error:
        if named is None:
            raise InputError(f"{path}: {error.strerror}; allowed: a deck of Abaqus or CalculiX") from None
        raise named.error(f"names the file {path}, {error.strerror}") from None
    count = 0
    for line_number, raw in enumerate(text.splitlines(), 1):
        stripped = raw.strip()
        if not stripped or stripped.startswith("**") or stripped == "*":
            continue
        line = Line(stripped, path, line_number)
        if stripped.startswith("*") and stripped.lstrip("* \t")[:7].upper() == "INCLUDE":
            inner = _beside(deck, _whole(line, [], deck).option("INPUT"), line.source)
            yield from _lines(inner, deck, (*above, path), line.source)
            continue
        count += 1
        if count > MOST_LINES:
            raise InputError(f"{path}: has more than {MOST_LINES:,} lines")
        yield line


def _beside(deck: str, name: str, source: Source) -> str:
    """Return a file that a deck names, from the deck's folder, or as it stands from the file that names it."""
    for folder in (Path(deck).parent, Path(source.path).parent):
        if (folder / name).is_file():
            return str(folder / name)
    return str(Path(deck).parent / name)
