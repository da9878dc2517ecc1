"""Every fuzzer, briefly."""

from importlib import import_module

import pytest

from tests.fuzz.__main__ import NAMES


@pytest.mark.parametrize("name", NAMES)
def test_briefly(name: str) -> None:
    fuzzer = import_module(f"tests.fuzz.{name}")
    outcomes = fuzzer.main(fuzzer.BRIEF, 20)
    assert len(outcomes) > 1, f"all cases came out alike: {outcomes}"
