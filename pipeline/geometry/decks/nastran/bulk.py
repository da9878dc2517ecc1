"""Bulk data of Nastran as cards, whatever their field format and however they go on.

Small, large and free field, mixed; continuation by `+` and `*`, by a blank field, by names in columns 73 to 80 wherever
the line stands; `INCLUDE` with and without quotes, over several lines, nested, in any section; comments; `ENDDATA`.
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
DIGITS = 19
"""Digits that a number of a list has less of."""
WIDTH, WIDE = 8, 16
"""Columns of a small and of a large field."""
FIELDS = 8
"""Small fields of a line between its name and its continuation."""
NAME = re.compile(r"[A-Z][A-Z0-9]* *\*?$")
REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]?([+-]\d+)|[EeDd](\d+))?$")
BEGIN = re.compile(r"\s*BEGIN\b", re.IGNORECASE)
INCLUDE = re.compile(r"\s*INCLUDE\b", re.IGNORECASE)
CHOICE = re.compile(r"\s*MPC\s*=\s*(\d{1,18})\b", re.IGNORECASE)
"""Of a set of equations, by a case."""
END = re.compile(r"\s*ENDDATA\b", re.IGNORECASE)
SHOWN = 60
"""Characters of a line in a message."""


class Card(NamedTuple):
    """A card with its continuations."""

    name: str
    """In upper case, without the star of large fields."""
    fields: list[str]
    """What follows the name, without blanks around it."""
    source: Source

    def text(self, k: int) -> str:
        """Return field k from 0; empty where there is none."""
        return self.fields[k] if k < len(self.fields) else ""

    def integer(self, k: int, default: int | None = None) -> int:
        """Return the whole number of field k.

        Raises:
            InputError: it is none, or blank without a default.
        """
        text = self.text(k)
        if not text and default is not None:
            return default
        try:
            return whole(text)
        except ValueError:
            raise self.source.error(f"{self.name} has {text!r} in field {k + 2}, expected a whole number") from None

    def real(self, k: int) -> float:
        """Return the number of field k, 0 where it is blank.

        Raises:
            InputError: it is none.
        """
        text = self.text(k)
        if not text:
            return 0.0
        match = REAL.match(text)
        try:
            value = float(f"{match[1]}e{match[2] or match[3] or 0}") if match else float("nan")
        except OverflowError:
            value = float("inf")
        if not abs(value) < FARTHEST:
            raise self.source.error(f"{self.name} has {text!r} in field {k + 2}, expected a finite number")
        return value

    def listed(self, start: int) -> list[int]:
        """Return the numbers from field `start` on, `a THRU b` and `a THRU b BY c` written out.

        Raises:
            InputError: a field is neither.
        """
        words = [word for word in self.fields[start:] if word]
        numbers: list[int] = []
        k = 0
        while k < len(words):
            if words[k + 1 : k + 2] and words[k + 1].upper() == "THRU":
                by = words[k + 3 : k + 4] and words[k + 3].upper() == "BY"
                numbers += self._range(words[k : k + 5 : 2] if by else words[k : k + 3 : 2])
                k += 5 if by else 3
            elif words[k].isdecimal() and len(words[k]) < DIGITS:
                numbers.append(int(words[k]))
                k += 1
            else:
                raise self.source.error(f"{self.name} has {words[k]!r}, expected numbers, or a range by THRU")
        return numbers

    def _range(self, words: list[str]) -> range:
        """Return the numbers from the first of two or three words to the second, by steps of the third."""
        numbers = [int(word) for word in words if word.isdecimal() and len(word) < DIGITS]
        start, stop, step = (*numbers, 1, 1, 1)[:3]
        if len(numbers) != len(words) or len(words) < 2 or step < 1 or (stop - start) // step > MOST_MEMBERS:
            raise self.source.error(f"{self.name} has {' THRU '.join(words[:2])!r}, expected a range of numbers")
        return range(start, stop + 1, step)


MOST_MEMBERS = 10_000_000
"""Numbers that a range stands for."""


class _Line(NamedTuple):
    """A line in fields."""

    name: str
    """Of a card or, where it goes on with one, empty."""
    head: str
    """Name of the continuation that it is; empty: of the card above."""
    fields: list[str]
    tail: str
    """Name of the continuation that follows; empty if none is named."""
    source: Source


def read_cards(path: str) -> list[Card]:
    """Return the cards of the bulk data of a file and of those that it includes.

    Raises:
        InputError: a file is missing, a line is no card, or a continuation belongs to none.
    """
    lines = list(_text_lines(path, Path(path).parent, (), None))
    start = next((k + 1 for k, (text, _) in enumerate(lines) if BEGIN.match(text)), 0)
    body_lines = lines[start:]
    if (again := next((source for text, source in body_lines if BEGIN.match(text)), None)) is not None:
        raise again.error("a second BEGIN BULK; allowed: one body, without superelements (BEGIN SUPER)")
    stop = next((k for k, (text, _) in enumerate(body_lines) if END.match(text)), len(body_lines))
    return _cards([_split(text, source) for text, source in body_lines[:stop]])


def chosen_equations(path: str) -> set[int] | None:
    """Return the sets of equations that the cases of a file choose by MPC; None of bulk data without cases."""
    chosen: set[int] = set()
    for text, _ in _text_lines(path, Path(path).parent, (), None):
        if BEGIN.match(text):
            return chosen
        if match := CHOICE.match(text):
            chosen.add(int(match[1]))
    return None


def _cards(lines: list[_Line]) -> list[Card]:
    """Join the continuations of cards."""
    groups, scattered = _grouped(lines)
    cards = []
    for group in groups:
        while group[-1].tail in scattered:
            group += scattered.pop(group[-1].tail)
        fields = [field for line in group for field in line.fields]
        while fields and not fields[-1]:
            fields.pop()
        cards.append(Card(group[0].name, fields, group[0].source))
    if scattered:
        name, (line, *_) = next(iter(scattered.items()))
        raise line.source.error(f"continuation '+{name}' belongs to no card; allowed: behind its card, or named by it")
    return cards


def _grouped(lines: list[_Line]) -> tuple[list[list[_Line]], dict[str, list[_Line]]]:
    """Return cards with the lines behind them, and by name the continuations that stand elsewhere."""
    groups: list[list[_Line]] = []
    named = {line.tail for line in lines if line.tail}
    scattered: dict[str, list[_Line]] = {}
    target: list[_Line] | None = None
    for line in lines:
        if line.name:
            target = [line]
            groups.append(target)
        elif target is not None and _continues(line, target[-1], named):
            target.append(line)
        else:
            target = [line]
            if line.head in scattered or not line.head:
                raise line.source.error(f"continuation '{line.head}' follows no card or stands twice")
            scattered[line.head] = target
    return groups, scattered


def _continues(line: _Line, above: _Line, named: set[str]) -> bool:
    """Return whether a line goes on with the one above; `named` continuations follow the line that names them."""
    return not line.head or above.tail == line.head or (not above.tail and line.head not in named)


def _split(text: str, source: Source) -> _Line:
    """Return a line in fields."""
    if "," in text:
        words = [word.strip() for word in text.split(",")]
        head, wide = words[0].upper(), words[0].endswith("*") or words[0].startswith("*")
        count = FIELDS // 2 if wide else FIELDS
        long = len(words) > count + 2 and not words[count + 1].startswith(("+", "*"))
        fields, tail = (words[1:], "") if long else (words[1 : count + 1], "".join(words[count + 1 : count + 2]))
    else:
        text = text.expandtabs(WIDTH)
        head = text[:WIDTH].strip().upper()
        wide = "*" in head
        width, count = (WIDE, FIELDS // 2) if wide else (WIDTH, FIELDS)
        fields = [text[WIDTH + k * width : WIDTH + (k + 1) * width].strip() for k in range(count)]
        tail = text[WIDTH + count * width : WIDTH + count * width + WIDTH].strip()
        long = False
    if not long:
        fields += [""] * (count - len(fields))
    tail = tail.lstrip("+*").strip().upper()
    if not head or head[0] in "+*":
        return _Line("", head.lstrip("+*").strip(), fields, tail, source)
    if not NAME.match(head):
        text_of_fault = "replicated cards are not read" if head[0] == "=" else "expected the name of a card"
        raise source.error(f"{text[:SHOWN].strip()!r}: {text_of_fault}; allowed: bulk data of Nastran with GRID cards")
    return _Line(head.rstrip("* "), "", fields, tail, source)


def _text_lines(path: str, folder: Path, above: tuple[str, ...], named: Source | None) -> Iterator[tuple[str, Source]]:
    """Yield lines without comments, and those of included files in their place."""
    if path in above or len(above) > DEPTH:
        raise (named or Source(path, 0)).error(f"INCLUDE of {path}, which includes itself")
    try:
        raw = deck_text(path).splitlines()
    except OSError as error:
        if named is None:
            raise InputError(f"{path}: {error.strerror}; allowed: bulk data of Nastran") from None
        raise named.error(f"names the file {path}, {error.strerror}") from None
    k = 0
    while k < len(raw):
        source, text = Source(path, k + 1), raw[k].partition("$")[0].rstrip()
        k += 1
        if INCLUDE.match(text):
            name = text.strip()[len("INCLUDE") :].strip()
            while name[:1] in ("'", '"') and name.count(name[0]) < 2 and k < len(raw):
                name += raw[k].strip()
                k += 1
            name = name.strip("'\"").replace("\\", "/")
            choices = [base / name for base in (folder, Path(path).parent)]
            inner = next((choice for choice in choices if choice.is_file()), choices[0])
            yield from _text_lines(str(inner), folder, (*above, path), source)
        elif text.strip():
            yield text, source
