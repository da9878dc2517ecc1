"""Changes of nested tables and of texts, chosen by a random generator."""

import copy
import random
import string
import sys
from collections.abc import Iterator
from typing import Any

NUMBERS = (
    0, -1, 1, 2, 3.5, 1e-9, -1e-9, 5e-324, -5e-324, 1e-300, 1e-160, 1e-30, 1e30, 1e154, 1e160, 1e300, -1e300, 1e308,
    float("nan"), float("inf"), -float("inf"), 2**31, 2**63, 10**400, 0.5, 0.4999999999999999, 1 - 1e-16, 1e6,
)  # fmt: skip
"""Numbers at which arithmetic changes its ways."""
VALUES = (True, False, "", "x", "../x", "a/b", "\0", "é" * 300, "nan", [], {}, [[]], [1, 2, 3], {"kind": "x"}, "unset")
NAMES = ("", ".", "..", "../x", "a/b", "/etc/passwd", "a\0b", "x" * 5000, " ", "é", "a b", "1", "with\nline")
Place = tuple[Any, Any]
"""A table or list, and the key of one of its entries."""


def places(tables: Any) -> Iterator[Place]:
    """Yield every entry of nested tables and lists."""
    entries = tables.items() if isinstance(tables, dict) else enumerate(tables) if isinstance(tables, list) else ()
    for key, value in list(entries):
        yield tables, key
        yield from places(value)


def mutated(tables: dict[str, Any], rng: random.Random) -> None:
    """Change one entry of nested tables in any way."""
    holder, key = rng.choice(list(places(tables)))
    kind = rng.random()
    if kind < 0.5:
        scaled(tables, rng, NUMBERS)
    elif kind < 0.6:
        holder[key] = copy.deepcopy(rng.choice(VALUES))
    elif kind < 0.7:
        del holder[key]
    elif isinstance(holder, dict) and kind < 0.8:
        holder[rng.choice([*NAMES, *holder])] = holder.pop(key)
    elif isinstance(holder, list) and kind < 0.8:
        holder.extend([holder[key]] * rng.choice([1, 2, 100]))
    else:
        other, name = rng.choice(list(places(tables)))
        holder[key] = copy.deepcopy(other[name])


def scaled(tables: Any, rng: random.Random, numbers: tuple[float, ...] = (), most: float = 40.0) -> None:
    """Replace one number of nested tables by one of `numbers`, or by itself times a power of ten up to `most`."""
    found = [(h, k) for h, k in places(tables) if isinstance(h[k], int | float) and not isinstance(h[k], bool)]
    if not found:
        return
    holder, key = rng.choice(found)
    if numbers and rng.random() < 0.6:
        holder[key] = rng.choice(numbers)
    else:
        # A whole number may have more digits than any float.
        value = float(max(-sys.float_info.max, min(sys.float_info.max, holder[key])))
        holder[key] = value * 10.0 ** rng.uniform(-most, most) * rng.choice([1, 1, 1, -1])


def garbled(text: bytes, rng: random.Random) -> bytes:
    """Return a text with bytes changed, cut out, repeated or cut off, or a number in it replaced."""
    found = bytearray(text)
    for _ in range(rng.choice([1, 1, 2, 5])):
        at, kind = rng.randrange(max(1, len(found))), rng.random()
        if kind < 0.25:
            found[at : at + 1] = bytes([rng.randrange(256)])
        elif kind < 0.4:
            del found[at : at + rng.choice([1, 5, 100])]
        elif kind < 0.55:
            found[at:at] = found[at : at + rng.choice([1, 20, 200])] * rng.choice([1, 3])
        elif kind < 0.65:
            del found[at:]
        elif kind < 0.8:
            found[at:at] = rng.choice([*NUMBERS[:-3], "-", ",", "1e", '"', "[", "*", "\n"]).__str__().encode()
        else:
            start = max(found.rfind(b" ", 0, at), found.rfind(b",", 0, at), found.rfind(b"\n", 0, at)) + 1
            end = start
            while end < len(found) and found[end] in (string.digits + ".+-e").encode():
                end += 1
            found[start:end] = str(rng.choice([0, -1, 1, 7, 10**6, 10**12, 10**30, 1e300, "nan"])).encode()
    return bytes(found)
