"""What is told while the time loop is compiled: beside mesh and modes, and again where the solver waits for it."""

from types import SimpleNamespace
from typing import Any

import pytest

from gudgeon.pipeline.stages import bodies


class Waited(Exception):
    """The solver waits for its time loop."""


class Child:
    """A child process that compiles."""

    def __init__(self, code: int | None) -> None:
        self.code = code

    def poll(self) -> int | None:
        return self.code

    def wait(self) -> None:
        raise Waited


def test_waiting_for_the_compiler_is_said() -> None:
    told = list[tuple[str, float]]()
    job: Any = SimpleNamespace(scene=SimpleNamespace(loop="implicit"), compilation=Child(None))
    product: Any = None
    with pytest.raises(Waited):
        bodies.make_run(job, product, lambda *one: told.append(one))
    assert told == [("compile 'implicit', some minutes, once per version", 0.0)]


def test_a_time_loop_that_is_compiled_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(_job: Any) -> Any:
        raise Waited

    told = list[tuple[str, float]]()
    monkeypatch.setattr(bodies, "system_of", stop)
    product: Any = None
    for child in (None, Child(0)):
        job: Any = SimpleNamespace(compilation=child)
        with pytest.raises(Waited):
            bodies.make_run(job, product, lambda *one: told.append(one))
    assert not told
