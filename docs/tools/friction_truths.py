"""`python -m docs.tools.friction_truths`: run the tests of friction and print what each of their comparisons found."""

import sys
from typing import Any

import numpy as np
import pytest

FOLDER = "tests/validation/friction"
PLAIN = pytest.approx


class Shown:
    """A value with its tolerance, which prints what it is compared with."""

    def __init__(self, expected: Any, **tolerance: float) -> None:
        self._expected, self._plain = expected, PLAIN(expected, **tolerance)

    def __eq__(self, found: object) -> bool:
        error = np.max(np.abs(np.asarray(found, float) / np.asarray(self._expected, float) - 1))
        print(f"found {found}, exact {self._expected}, relative difference {error:.2%}", flush=True)
        return bool(found == self._plain)

    __hash__ = None  # type: ignore[assignment]


class Plugin:
    """Names each test before its comparisons."""

    def pytest_runtest_call(self, item: Any) -> None:
        print(f"\n{item.name}", flush=True)


if __name__ == "__main__":
    pytest.approx = Shown  # type: ignore[assignment]
    sys.exit(pytest.main(["-q", "-s", "-p", "no:cacheprovider", "-n", "0", FOLDER], plugins=[Plugin()]))
