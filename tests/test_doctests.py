"""Every function of `import gudgeon` has an example, and it does what it says: each runs in an empty folder."""

import contextlib
import doctest
from pathlib import Path
from typing import Any

import pytest

import gudgeon
from gudgeon.modaldb.stores.base import Store

pytestmark = pytest.mark.usefixtures("shared_records")
MEMBERS = {name: getattr(gudgeon, name) for name in gudgeon.__all__ if name != "__version__"}
MEMBERS |= {f"Scene.{name}": getattr(gudgeon.Scene, name) for name in ("from_file", "to_toml")}
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def examples(member: Any) -> list[doctest.DocTest]:
    """Return the examples of a function's or method's own docstring."""
    return [test for test in doctest.DocTestFinder(recurse=False).find(member, globs={}) if test.examples]


DEAR = ("identify", "report", "wear", "wrench")
"""Examples of more than 10 s of CPU time: of many runs, or of a moving arm."""
NAMES = [
    pytest.param(name, marks=[pytest.mark.validation] * (name in DEAR)) for name in sorted(MEMBERS.keys() - {"Scene"})
]


@pytest.mark.parametrize("name", NAMES)
def test_example(name: str, tmp_path: Path) -> None:
    (test,) = examples(MEMBERS[name])
    said: list[str] = []
    with contextlib.chdir(tmp_path):
        doctest.DocTestRunner(optionflags=FLAGS, verbose=False).run(test, out=said.append)
    assert not said, "".join(said)


def test_a_function_without_an_example_is_seen() -> None:
    assert examples(Store.place) == []
