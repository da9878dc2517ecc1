"""What a run prints that did not come to its end is told from what a finished one prints."""

import pytest

from gudgeon.pipeline.cli.commands import _print_run
from gudgeon.pipeline.stages.run_report import RunReport

IMPULSE = {"wall.impulse": {"value": 1.0, "unit": "N s", "reference": None, "error": None}}


@pytest.mark.parametrize(("result", "reason"), [("FINISHED", None), ("CHATTER", "impacts follow each other")])
def test_quantities_of_a_run_that_failed_are_said_to_be_incomplete(
    result: str, reason: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    _print_run(RunReport("scene", result, quantities=IMPULSE, reason=reason))
    lines = capsys.readouterr().out.splitlines()
    assert any(line.split()[:1] == ["impulse"] for line in lines)
    assert ("of an incomplete run, up to its end:" in lines) == (reason is not None)
