"""Workers that are killed, fail or never start lose nothing but what they do."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from gudgeon.modaldb.errors import StoreUnusable
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.studies.dispatch import BREAKS, TRIES, dispatched
from gudgeon.pipeline.studies.executors import Workers, executor_of, named_executor, processes
from gudgeon.pipeline.studies.planning import Step
from gudgeon.pipeline.studies.task import LOST, Row, Source, Task
from tests.pipeline.studies import cases

SOURCE = Source("scene", "scene.toml", "{}", "db", "")


def steps(count: int, after: dict[int, Sequence[int]] | None = None) -> list[Step]:
    """Return steps for designs 1 to `count`; `after` has the numbers of steps on which some wait."""
    tasks = [Task(SOURCE, number, "[]", ("solve",)) for number in range(1, count + 1)]
    return [Step(task, frozenset((after or {}).get(i, ())), (task.design,)) for i, task in enumerate(tasks)]


def rows_of(found: Sequence[Step], workers: Workers, work: Callable[[Task], Row]) -> dict[int, Row]:
    return {row.design: row for _, row in dispatched(found, workers, work)}


@pytest.fixture
def marks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(cases.MARKS, str(tmp_path))
    return tmp_path


def test_steps_wait_on_others() -> None:
    order: list[int] = []

    def work(task: Task) -> Row:
        time.sleep(0.001 * (5 - task.design))
        order.append(task.design)
        return cases.answer(task)

    found = steps(5, {0: [4], 1: [0, 4], 2: [1]})
    assert len(rows_of(found, executor_of(lambda: ThreadPoolExecutor(3), "test"), work)) == 5
    assert order.index(5) < order.index(1) < order.index(2) < order.index(3)


def test_no_more_tasks_are_given_out_than_asked() -> None:
    most, now = [0], [0]

    class Counting(ThreadPoolExecutor):
        def submit(self, work: Any, *arguments: Any) -> Any:
            now[0] += 1
            most[0] = max(most[0], now[0])
            return super().submit(work, *arguments)

    def work(task: Task) -> Row:
        now[0] -= 1
        return cases.answer(task)

    assert len(rows_of(steps(30), executor_of(lambda: Counting(1), "test", 3), work)) == 30
    assert most[0] <= 4  # One may have begun that is not yet seen to be done.


def test_a_killed_worker_loses_nothing(marks: Path, tmp_path: Path) -> None:
    found = rows_of(steps(8), processes(2), cases.killed_always)
    assert {row.design: row.result for row in found.values()} == dict.fromkeys(range(1, 9), "FINISHED") | {3: LOST}
    assert "its worker ended 2 times (BrokenProcessPool" in found[3].reason
    begun = Counter(int(path.name.partition("-")[0]) for path in marks.iterdir())
    assert begun[3] == TRIES
    assert all(begun[number] <= TRIES for number in range(1, 9))


def test_workers_that_never_finish_end_the_study() -> None:
    with pytest.raises(StageError, match=f"workers ended {BREAKS} times in succession without finishing a task"):
        rows_of(steps(40), processes(1), cases.killed_by_all)


def test_what_a_task_raises_is_tried_again_and_lost() -> None:
    found = rows_of(steps(4), executor_of(cases.thread, "test"), cases.raising)
    assert found[2].result == LOST
    assert "ValueError: no row" in found[2].reason
    assert [found[number].result for number in (1, 3, 4)] == ["FINISHED"] * 3


def test_an_unusable_database_ends_the_study() -> None:
    def work(task: Task) -> Row:
        raise StoreUnusable("db: cannot be written")

    closed: list[Executor] = []
    workers = executor_of(cases.thread, "test")
    workers = Workers(workers.open, lambda pool: (closed.append(pool), workers_close(pool))[0], workers.given_out)
    with pytest.raises(StoreUnusable, match="cannot be written"):
        rows_of(steps(9), workers, work)
    assert len(closed) == 1


def workers_close(pool: Executor) -> None:
    pool.shutdown(wait=False, cancel_futures=True)


def test_an_executor_that_breaks_is_made_again() -> None:
    made: list[int] = []

    class Fragile(ThreadPoolExecutor):
        def submit(self, work: Any, *arguments: Any) -> Any:
            if len(made) < 3:
                future: Future[Row] = Future()
                future.set_exception(BrokenExecutor("gone"))
                return future
            return super().submit(work, *arguments)

    def make() -> Executor:
        made.append(len(made))
        return Fragile(1)

    found = rows_of(steps(1), executor_of(make, "test"), cases.answer)
    assert (found[1].result, len(made)) == (LOST, 2)
    assert [row.result for row in rows_of(steps(3), executor_of(make, "test"), cases.answer).values()] == [
        "FINISHED"
    ] * 3


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cases", "expected module:function"),
        ("no_such_module:make", "cannot be imported: ModuleNotFoundError"),
        ("tests.pipeline.studies.cases:nothing", "has no 'nothing'"),
        ("tests.pipeline.studies.cases:MARKS", "str given; allowed: a function that returns an executor"),
    ],
)
def test_wrong_executors_are_refused(name: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        named_executor(name, None)
    assert str(caught.value).startswith(f"--executor {name}: ")


def test_a_function_that_makes_no_executor() -> None:
    with pytest.raises(InputError, match="returned dict; allowed: an executor"):
        rows_of(steps(1), executor_of(dict, "executor"), cases.answer)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="executor: raised ZeroDivisionError"):
        rows_of(steps(1), executor_of(lambda: 1 / 0, "executor"), cases.answer)  # type: ignore[arg-type, return-value]


def test_a_module_of_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_cluster.py").write_text("from tests.pipeline.studies.cases import thread as executor\n")
    monkeypatch.chdir(tmp_path)
    assert len(rows_of(steps(2), named_executor("own_cluster:executor", None), cases.answer)) == 2
