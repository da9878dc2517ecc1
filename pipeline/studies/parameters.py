"""What a study varies: keys of a scene with their values, as `--vary` takes them.

path=1,2,5           these values, of any kind that TOML has, or texts
path=LOW:HIGH:N      N values from LOW to HIGH
path=LOW:HIGH:N:log  the same with equal ratios
path=LOW:HIGH        between these, for designs that are drawn; LOW:HIGH:log with equal ratios
"""

import json
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from gudgeon.pipeline.errors import InputError

MOST = 100_000
"""Largest number of values of one parameter, and of designs of one study."""
SHOWN = 200
"""Characters of a wrong text in a message."""
NUMBER = r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
RANGE = re.compile(rf"\s*{NUMBER}\s*:\s*{NUMBER}\s*(?::\s*(\d+)\s*)?(?::\s*(log)\s*)?")
FORMS = "VALUE,VALUE,…, LOW:HIGH:N or LOW:HIGH:N:log, or LOW:HIGH with --random or --latin"
DRAWN_DIGITS, SPREAD_DIGITS = 6, 15
"""Significant digits of values that are drawn, so that tables are readable, and of those spread over a range."""


@dataclass(frozen=True)
class Parameter:
    """A key of a scene and the values that designs give it: those of a list, or of a range."""

    path: str
    """Names of tables and the key, separated by points; an item of a list by its number, from 0 on."""
    source: str
    """Where it stands, for messages."""
    values: tuple[Any, ...] = ()
    """Of a list; empty for a range."""
    low: float = 0.0
    high: float = 0.0
    count: int = 0
    """Number of values of a range; 0: all between its ends."""
    log: bool = False
    """Whether values of a range have equal ratios, otherwise equal differences."""
    whole: bool = False
    """Whether values of a range are rounded to whole numbers."""
    places: Mapping[str, str] = field(default_factory=dict)
    """Of values of a table by their text: where the first of them stands, for messages."""

    def place(self, value: Any) -> str:
        """Return where a value stands, for messages."""
        return self.places.get(repr(value), self.source)

    def listed(self) -> tuple[Any, ...]:
        """Return its values, those of a range from one end to the other."""
        if self.values:
            return self.values
        shares = [i / (self.count - 1) for i in range(self.count)]
        return tuple(dict.fromkeys(self._between(fraction, SPREAD_DIGITS) for fraction in shares))

    def at(self, fraction: float) -> Any:
        """Return the value at a share of the values, or of the range, 0 to 1."""
        if self.values or self.count:
            values = self.listed()
            return values[min(int(fraction * len(values)), len(values) - 1)]
        return self._between(fraction, DRAWN_DIGITS)

    def representatives(self) -> tuple[Any, ...]:
        """Return the values that are checked before any design runs: those of a list, and the ends of a range."""
        return self.values or tuple(dict.fromkeys(self._between(fraction, SPREAD_DIGITS) for fraction in (0.0, 1.0)))

    def _between(self, fraction: float, digits: int) -> float | int:
        ratio = self.high / self.low if self.log else 1.0
        value = self.low * ratio**fraction if self.log else self.low + fraction * (self.high - self.low)
        lower, upper = sorted((self.low, self.high))
        value = min(max(float(f"{value:.{digits}g}"), lower), upper)
        return round(value) if self.whole else value


def parse_parameters(texts: Sequence[str], *, drawn: bool) -> list[Parameter]:
    """Return the parameters of texts `path=values`.

    Args:
        drawn: Whether designs are drawn, so that ranges need no number of values.

    Raises:
        InputError: a text is none of the forms above, or two texts are about the same key.
    """
    parameters = [_parsed(text, drawn) for text in texts]
    refuse_same([p.path for p in parameters], "--vary")
    return parameters


def refuse_same(paths: Sequence[str], source: str) -> None:
    """Raise an InputError where two paths are the same, or one contains the other."""
    for n, path in enumerate(paths):
        for earlier in paths[:n]:
            if f"{path}.".startswith(f"{earlier}.") or f"{earlier}.".startswith(f"{path}."):
                both = f"{path}: given twice" if path == earlier else f"{earlier} and {path}: one contains the other"
                raise InputError(f"{source} {both}; allowed: each key once")


def _parsed(text: str, drawn: bool) -> Parameter:
    shown = text if len(text) <= SHOWN else f"{text[:SHOWN]}…"
    key, equals, right = text.partition("=")
    names = [k.strip() for k in key.split(".")]
    if not equals or not all(names) or not right.strip():
        raise InputError(f"--vary {shown}: expected path.to.key={FORMS}")
    path, source = ".".join(names), f"--vary {'.'.join(names)}"
    if (match := RANGE.fullmatch(right)) is not None:
        return _range(path, shown, match, drawn)
    values = listed_values(right)
    for value in values:
        if value == "" or (isinstance(value, float) and not math.isfinite(value)):
            got = "an empty value" if value == "" else value
            raise InputError(f"--vary {shown}: {got} given; allowed: finite numbers, texts, lists and truth values")
    if len(values) > MOST:
        raise InputError(f"--vary {path}: {len(values)} values given; allowed: up to {MOST}")
    return Parameter(path, source, tuple(values))


def _range(path: str, shown: str, match: re.Match[str], drawn: bool) -> Parameter:
    low, high, count = float(match[1]), float(match[2]), None if match[3] is None else int(match[3])
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"--vary {shown}: allowed: finite numbers")
    if low == high:
        raise InputError(f"--vary {shown}: both ends are {low:g}; allowed: two different ends")
    if match[4] and not (low > 0 and high > 0):
        raise InputError(f"--vary {shown}: {min(low, high):g} given; allowed with log: ends above 0")
    if count is None and not drawn:
        raise InputError(f"--vary {shown}: a range without number of values; expected path.to.key={FORMS}")
    if count is not None and not 2 <= count <= MOST:
        raise InputError(f"--vary {shown}: {count} values given; allowed: 2 to {MOST}")
    return Parameter(path, f"--vary {path}", low=low, high=high, count=count or 0, log=bool(match[4]))


def listed_values(text: str) -> list[Any]:
    """Return the values of a list without brackets: values of TOML, or texts between commas."""
    try:
        tables = tomllib.loads(f"v = [{text}]")
        if len(tables) == 1 and tables["v"] and _is_json(tables["v"]):
            return tables["v"]
    except (ValueError, RecursionError):
        pass
    return [one_value(v) for v in _split(text)]


def one_value(text: str) -> Any:
    """Return the value of a text: of TOML, or the text itself."""
    text = text.strip()
    try:
        tables = tomllib.loads(f"v = {text}")
        return tables["v"] if len(tables) == 1 and _is_json(tables["v"]) else text
    except (ValueError, RecursionError):
        return text


def _is_json(value: Any) -> bool:
    """Return whether JSON has a value; it has no dates and times."""
    try:
        json.dumps(value)
    except (TypeError, RecursionError):
        return False
    return True


def _split(text: str) -> list[str]:
    """Return the parts of a text between commas that stand in no brackets."""
    texts, depth = [""], 0
    for letter in text:
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth <= 0:
            texts.append("")
        else:
            texts[-1] += letter
    return texts
