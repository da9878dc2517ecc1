"""What a run that is stopped goes on from: the marches that it finished, and the state of the one that it was in.

A run is a sequence of marches, the same whenever it is repeated: those that find its steps, then those by which its
errors are estimated. A march that goes on from a state has the same bits as one that was never stopped. What is kept
belongs to one key of everything that the run depends on; who keeps it sees to that.
"""

import io
import time
import zipfile
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.integrators.outcome import Marching
from gudgeon.solver.result import RunStopped
from gudgeon.solver.results.trajectory import Histories

WORTH = 3.0
"""CPU time of a march from which it is kept [s]: shorter ones are repeated."""
COST = 0.01
"""Share of the time of a march that writing its states may take."""
DONE = "done"


class Keeper(Protocol):
    """A place for what is kept, by name."""

    interval: float
    """CPU time between two states of a march [s]; it becomes longer where writing takes more than `COST` of it."""

    def read(self, name: str) -> bytes | None:
        """Return what was written under a name, None where nothing was."""
        ...

    def write(self, name: str, content: bytes) -> None:
        """Write at once all of it, or nothing."""
        ...

    def read_trajectory(self, name: str) -> Trajectory | None:
        """Return the trajectory that was written under a name, None where none was."""
        ...

    def write_trajectory(self, name: str, trajectory: Trajectory) -> None:
        """Write a trajectory at once, or nothing."""
        ...


class Course:
    """Progress of a run through its marches, and what is kept of them.

    Args:
        progress: Called with the share of a march that is done after each of its frames.
        keeper: None: nothing is kept.
    """

    def __init__(self, progress: Callable[[float], None] | None = None, keeper: Keeper | None = None) -> None:
        self.progress, self._keeper = progress, keeper
        self._interval = 0.0 if keeper is None else keeper.interval
        self._march, self._begin = 0, 0.0
        self._last = self._pause = 0.0

    def finished(self) -> Trajectory | None:
        """Begin the next march; return its trajectory where it was finished before."""
        self._march += 1
        self._begin = self._last = time.process_time()
        self._pause = self._interval
        return None if self._keeper is None else self._keeper.read_trajectory(f"march-{self._march}")

    def keep(self, trajectory: Trajectory) -> None:
        """Keep the trajectory of a march that is finished."""
        if self._keeper is not None and time.process_time() - self._begin > min(WORTH, self._interval):
            self._keeper.write_trajectory(f"march-{self._march}", trajectory)

    def restore(self, integrator: Marching, histories: Histories) -> int:
        """Set integrator and histories to the state that is kept of this march; return the frames that were done."""
        live = integrator.state()
        content = None if self._keeper is None or live is None else self._keeper.read(self._name)
        if content is None or live is None:
            return 0
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                stored = dict(file)
        except (ValueError, OSError, EOFError, zipfile.BadZipFile):
            return 0
        done, targets = int(stored.pop(DONE)), _arrays(histories)
        if any(name not in stored for name in (*targets, *live)):
            return 0
        for name, array in targets.items():
            recorded = stored.pop(name)
            array[: len(recorded)] = recorded
        integrator.resume(stored)
        return done

    def stops(self, integrator: Marching, histories: Histories, done: int) -> bool:
        """Tell the progress after a frame, and keep the state from time to time; return whether the run is to stop.

        Args:
            done: Frames of the march so far.
        """
        stopped = False
        try:
            if self.progress is not None:
                self.progress(done / len(histories.frames))
        except RunStopped:
            stopped = True
        if self._keeper is not None and (stopped or time.process_time() - self._last >= self._pause):
            self._keep_state(self._keeper, integrator, histories, done)
        return stopped

    def _keep_state(self, keeper: Keeper, integrator: Marching, histories: Histories, done: int) -> None:
        start_time = time.process_time()
        if (state := integrator.state()) is not None:
            frames, content = len(histories.frames), io.BytesIO()
            arrays = {
                name: array[: len(array) * done // frames] if name.startswith("history.") else array
                for name, array in _arrays(histories).items()
            }
            np.savez(content, allow_pickle=False, **{DONE: np.array(done)}, **arrays, **state)
            keeper.write(self._name, content.getvalue())
        self._last = time.process_time()
        self._pause = max(self._interval, (self._last - start_time) / COST)

    @property
    def _name(self) -> str:
        return f"state-{self._march}.npz"


def _arrays(histories: Histories) -> Mapping[str, np.ndarray]:
    """Return the arrays of histories; those with a row for each sample or frame are named `history`."""
    samples = histories.samples
    frames = {name: array for name, array in histories._asdict().items() if isinstance(array, np.ndarray)}
    rows = {name: array for name, array in samples._asdict().items() if isinstance(array, np.ndarray)}
    return {
        **{f"history.frames.{name}": array for name, array in frames.items()},
        **{f"history.samples.{name}": array for name, array in rows.items()},
        **{f"history.paths.{name}": getattr(samples.paths, name) for name in ("values", "squares")},
        **{f"peaks.{name}": array for name, array in samples.peaks._asdict().items()},
    }
