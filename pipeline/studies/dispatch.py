"""Gives the steps of a study to workers and collects their rows; workers may fail, end or be killed at any time."""

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait

from gudgeon.modaldb.errors import RecordNotWritten, StoreUnusable
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.studies.executors import Workers
from gudgeon.pipeline.studies.planning import Step
from gudgeon.pipeline.studies.task import LOST, Row, Task

TRIES = 2
"""Times that a task is given out whose worker ends; where all workers end together, the last time alone, so that it
cannot be another task's fault."""
BREAKS = 6
"""Times in succession that all workers end, with nothing done between, after which the study ends."""
STORE = (StoreUnusable, RecordNotWritten)
"""Errors that every further task would have."""

Work = Callable[[Task], Row]


def dispatched(steps: Sequence[Step], workers: Workers, work: Work) -> Iterator[tuple[int, Row]]:
    """Yield the number of each step and its row as they are done.

    A task whose worker ended is given out again; if its worker ends again, its row is `LOST`. The workers are
    closed at the end, and at once where the caller leaves the loop, as Ctrl-C does.

    Raises:
        StoreUnusable, RecordNotWritten: nothing can be kept in the database.
        StageError: workers end again and again without doing anything.
    """
    run = _Run(steps, workers, work)
    try:
        yield from run.rows()
    finally:
        run.close()


class _Run:
    """The state of a study that is running."""

    def __init__(self, steps: Sequence[Step], workers: Workers, work: Work) -> None:
        self._steps, self._workers, self._work = steps, workers, work
        self._pool: Executor | None = None
        self._left = [len(step.after) for step in steps]
        """Number of steps on which each still waits."""
        self._before: dict[int, list[int]] = {}
        """Steps that wait on each."""
        for n, step in enumerate(steps):
            for earlier in step.after:
                self._before.setdefault(earlier, []).append(n)
        self._ready = deque(n for n, waiting in enumerate(self._left) if not waiting)
        self._suspects: deque[int] = deque()
        """Steps whose workers ended, to be tried alone."""
        self._running: dict[Future[Row], int] = {}
        self._tries: Counter[int] = Counter()
        self._alone, self._breaks = False, 0
        self._done: deque[tuple[int, Row]] = deque()
        """Rows that the caller has not seen yet."""

    def rows(self) -> Iterator[tuple[int, Row]]:
        """Yield rows until every step has one."""
        while self._ready or self._suspects or self._running:
            self._give_out()
            done, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in done:
                # What a broken executor had at the same time has been taken back already.
                if future in self._running:
                    self._finished(future)
            while self._done:
                yield self._done.popleft()

    def close(self) -> None:
        """End the workers."""
        for future in self._running:
            future.cancel()
        if self._pool is not None:
            self._workers.close(self._pool)
            self._pool = None

    def _give_out(self) -> None:
        """Give tasks to the workers: suspects alone, otherwise as many as they may have."""
        if self._alone and self._running:
            return
        if self._suspects and not self._running:
            self._alone = True
            self._submit(self._suspects)
        elif not self._suspects:
            self._alone = False
            while self._ready and len(self._running) < self._workers.given_out and self._submit(self._ready):
                pass

    def _submit(self, queue: deque[int]) -> bool:
        """Give out the first task of a queue; return whether the executor took it."""
        if self._pool is None:
            self._pool = self._workers.open()
        step = queue.popleft()
        try:
            self._running[self._pool.submit(self._work, self._steps[step].task)] = step
        except Exception as error:
            queue.appendleft(step)
            self._broken(error)
            return False
        return True

    def _finished(self, future: "Future[Row]") -> None:
        """Note the row of a task that is done, unless it is to be tried again."""
        try:
            row = future.result()
        except STORE:
            raise
        except BrokenExecutor as error:
            self._broken(error)
        except (Exception, asyncio.CancelledError) as error:
            # An executor of a cluster replaces its workers by itself.
            self._lost(self._running.pop(future), error, self._ready)
        else:
            self._breaks = 0
            self._note(self._running.pop(future), row)

    def _note(self, step: int, row: Row) -> None:
        self._done.append((step, row))
        for waiting in self._before.get(step, ()):
            self._left[waiting] -= 1
            if not self._left[waiting]:
                self._ready.append(waiting)

    def _broken(self, error: Exception) -> None:
        """Take back all tasks of workers that have ended."""
        self._breaks += 1
        if self._breaks > BREAKS:
            raise StageError(
                f"study: workers ended {BREAKS} times in succession without finishing a task ({_text(error)}); what is"
                " done is in the database"
            ) from error
        self.close()
        numbers = [*self._running.values()]
        self._running.clear()
        for step in numbers:
            self._lost(step, error, self._suspects)

    def _lost(self, step: int, error: BaseException, queue: deque[int]) -> None:
        """Put a task whose worker ended into a queue again, or note that it is lost."""
        self._tries[step] += 1
        if self._tries[step] < TRIES:
            queue.append(step)
            return
        text = f"its worker ended {TRIES} times ({_text(error)}); it is tried again when the study is run again"
        self._note(step, Row(self._steps[step].task.design, LOST, text))


def _text(error: BaseException) -> str:
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0]}" if lines else type(error).__name__
