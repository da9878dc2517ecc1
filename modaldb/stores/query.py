"""What is asked of a database, and what it answers: records by kind, scene, date and values of their inputs."""

import json
import re
from dataclasses import asdict, dataclass, field
from typing import Any

from gudgeon.modaldb.errors import ModalDBError
from gudgeon.modaldb.keys import KEY

RELATIONS = (">=", "<=", "!=", "=", ">", "<")
CONDITION = re.compile(rf"\s*([\w-]+(?:\.[\w-]+)*)\s*({'|'.join(RELATIONS)})\s*(\S|\S.*\S)\s*", re.DOTALL)
LATEST = 1e11
"""Time beyond which no record is made [s since 1970]: the year 5138."""
LIKE_A_CONDITION = rf"^\s*[\w-]+(\.[\w-]+)*\s*({'|'.join(RELATIONS)})\s*\S"
"""What a text that states a condition begins with."""


class QueryWrong(ModalDBError, ValueError):
    """A query that cannot be understood."""


@dataclass(frozen=True)
class Condition:
    """A comparison of one value of the inputs, such as `material.E >= 2e11`."""

    path: str
    """Names from the top of the inputs on, joined by full stops."""
    relation: str
    """`=`, `!=`, `<`, `<=`, `>` or `>=`."""
    value: Any
    """A number, text or truth value."""

    def __str__(self) -> str:
        return f"{self.path}{self.relation}{json.dumps(self.value)}"


def condition(text: str) -> Condition:
    """Return the condition that a text such as `mesh.size<0.003` or `material.rho=7850` states.

    The value is a number, true, false, or a text, with or without quotation marks.

    Raises:
        QueryWrong: it states none.
    """
    if (match := CONDITION.fullmatch(text)) is None:
        raise QueryWrong(f"'{text[:80]}' given; expected PATH=VALUE, with = or one of != < <= > >=, such as size<0.003")
    path, relation, value = match.groups()
    try:
        parsed = json.loads(value)
    except (ValueError, RecursionError):
        parsed = value
    return Condition(path, relation, parsed if isinstance(parsed, str | int | float | bool) else value)


@dataclass(frozen=True)
class Query:
    """Which records are asked for; what is empty or None asks for all."""

    kind: str = ""
    scene: str = ""
    """Part of the name of a scene that uses the record."""
    component: str = ""
    """Part of the name of a component that it is of."""
    tag: str = ""
    """Name that was given to it."""
    key: str = ""
    """First digits of its key."""
    text: str = ""
    """A text in its inputs."""
    since: float | None = None
    """Written at or after this time [s since 1970]."""
    until: float | None = None
    """Written before this time [s since 1970]."""
    where: tuple[Condition, ...] = ()
    limit: int | None = None
    """Most records of the answer, the newest ones."""


@dataclass(frozen=True)
class Entry:
    """What a list says of a record."""

    key: str
    kind: str
    """`?` of a file that is no record."""
    size: int
    """[bytes]"""
    made: float
    """When its file was written [s since 1970]."""
    uses: tuple[tuple[str, str], ...] = ()
    """Scene and component of each use."""
    tags: tuple[str, ...] = ()
    refers: tuple[str, ...] = ()
    """Keys in its inputs."""
    referred: int = 0
    """Number of records of this database that refer to it."""
    inputs: dict[str, Any] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return all of it as JSON."""
        return asdict(self)


def entry_of(row: dict[str, Any]) -> Entry:
    """Return the entry that `as_json` made a row of.

    Raises:
        LookupError, TypeError, ValueError: it is none.
    """
    texts = (row["kind"], *row["tags"], *(name for use in row["uses"] for name in use[:2]))
    sound = all(map(KEY.fullmatch, (row["key"], *row["refers"]))) and all(isinstance(text, str) for text in texts)
    counts = all(type(row[name]) is int and 0 <= row[name] < 2**63 for name in ("size", "referred"))
    if not (sound and counts and 0 <= row["made"] < LATEST and isinstance(row["inputs"], dict)):
        raise ValueError("no entry")
    return Entry(
        row["key"], row["kind"], row["size"], row["made"], tuple((use[0], use[1]) for use in row["uses"]),
        tuple(row["tags"]), refers=tuple(row["refers"]), referred=row["referred"], inputs=row["inputs"],
    )  # fmt: skip
