"""Tests against exact answers share records."""

import pytest


@pytest.fixture(scope="session", autouse=True)
def _shared(shared_records: None) -> None:
    """All tests of this folder share records."""
