"""Pictures of a result, drawn in child processes: VTK without working GL libraries kills its process.

matplotlib and pyvista are imported by the child alone.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import uuid
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import MappingProxyType
from typing import Any

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.process.lifeline import lifeline

Pictures = dict[str, dict[str, str]]
"""Name → drawing function, by group; each group has its own child process, so that a crash affects one group only."""

PLOTS: Pictures = {
    "flat": {
        "force": "gudgeon.pipeline.plots.contact.curves:draw_force",
        "energy": "gudgeon.pipeline.plots.contact.curves:draw_energy",
        "impacts": "gudgeon.pipeline.plots.contact.contact_events:draw_impacts",
        "gauges": "gudgeon.pipeline.plots.contact.readings:draw_gauges",
        "probes": "gudgeon.pipeline.plots.contact.readings:draw_probes",
        "pressure": "gudgeon.pipeline.plots.contact.pressure:draw_pressure",
        "slip": "gudgeon.pipeline.plots.contact.slip:draw_slip",
        "waves": "gudgeon.pipeline.plots.deformation.line:draw_waves",
        "sheets": "gudgeon.pipeline.plots.deformation.plane:draw_sheets",
        "pressure-film": "gudgeon.pipeline.plots.contact.pressure_film:draw_pressure_film",
    },
    "rendered": {
        "deformation": "gudgeon.pipeline.plots.deformation.solid:draw_deformation",
        "stress": "gudgeon.pipeline.plots.deformation.solid:draw_stress",
        "modes": "gudgeon.pipeline.plots.deformation.modes:draw_modes",
        "movie": "gudgeon.pipeline.plots.deformation.movie:draw_movie",
    },
}
"""Pictures of a scene of bodies."""

DRIVEN: Pictures = {
    "flat": {
        **{name: PLOTS["flat"][name] for name in ("force", "energy", "gauges", "probes", "pressure", "slip")},
        "cycle": "gudgeon.pipeline.plots.driven.cycle:draw_cycle",
        "pressure-film": PLOTS["flat"]["pressure-film"],
    },
    "rendered": {
        "deformation": "gudgeon.pipeline.plots.driven.assembly:draw_assembly",
        "modes": PLOTS["rendered"]["modes"],
        "stress": PLOTS["rendered"]["stress"],
        "movie": "gudgeon.pipeline.plots.driven.movie:draw_cycle_movie",
    },
}
"""Pictures of a scene that a joint drives."""

TURNING: Pictures = {
    "flat": {
        "mechanism": "gudgeon.pipeline.plots.mechanism.picture:draw_mechanism",
        "journals": "gudgeon.pipeline.plots.mechanism.journals:draw_journals",
        "line-loads": "gudgeon.pipeline.plots.mechanism.line_loads:draw_line_loads",
        **{name: PLOTS["flat"][name] for name in ("energy", "gauges", "probes")},
    },
    "rendered": {
        "stress": PLOTS["rendered"]["stress"],
        "movie": "gudgeon.pipeline.plots.mechanism.film:draw_film",
    },
}
"""Pictures of a scene whose bodies turn by any angle."""

FILES = (
    "mechanism.png", "journals.png", "line-loads.png", "force.png", "energy.png", "impacts.png", "gauges.png",
    "probes.png", "pressure.png", "slip.png", "cycle.png", "deformation.png", "stress.png", "modes.png", "impact.mp4",
    "motion.mp4", "cycle.mp4", "pressure.mp4", "mechanism.mp4", "nodal-diameters.png", "blades.png", "wheel.png",
    "charge.png",
)  # fmt: skip
"""Names of all pictures; one of several bodies or contacts has its name before the dot."""

CHILD, FACES = "gudgeon.pipeline.plots.child", "gudgeon.pipeline.plots.faces"
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")
ALONE: Mapping[str, str] = MappingProxyType({})


def render(
    store: str | Path,
    key: str,
    out: Path,
    scene_name: str,
    compare: Mapping[str, str] = ALONE,
    *,
    pictures: Pictures | None = None,
    reference: Mapping[str, Any] | None = None,
    tell: Callable[[str, float], None] = lambda stage, fraction: None,
) -> tuple[list[Path], list[str]]:
    """Draw all pictures of a trajectory, or of a wheel, into a folder.

    Args:
        store: Folder or URL of the database.
        key: Of the trajectory, or of the wheel's response.
        compare: Keys of other runs of the same scene, by their labels in `cycle.png`; the trajectory's own key may be
            among them, for its label.
        pictures: Of another kind of scene; the default is `PLOTS`, `DRIVEN` or `TURNING`.
        reference: Of the force in `force.png`: its `label`, and `times` [s] and `force` [N] or the `key` of a full-FE
            run.
        tell: Called with `plot (3 of 7 pictures)` and the share of them, from two threads, never by both at once.

    Returns:
        The files that were drawn, and a note for each picture that could not be drawn.

    Raises:
        InputError: the folder cannot be written.
    """
    # Named before it is made: Ctrl-C within mkdtemp would leave a folder of unknown name.
    database = str(store) if "://" in str(store) else str(Path(store).resolve())
    scratch = out / f".drawing-{uuid.uuid4().hex}"
    jobs: dict[str, Path] = {}
    try:
        scratch.mkdir(parents=True)
        # A picture that fails this time must not remain from an earlier result.
        for name in FILES:
            (out / name).unlink(missing_ok=True)
        for group in PLOTS:
            job = {
                "store": database, "key": key, "pictures": pictures, "scene": scene_name,
                "compare": dict(compare), "out": str(out.resolve()), "scratch": str(scratch.resolve()), "group": group,
                "reference": reference,
            }  # fmt: skip
            jobs[group] = scratch / f"{group}.json"
            jobs[group].write_text(json.dumps(job))
        # The lifeline ends first: an interrupt stops the children, for which the pool then waits.
        count = _Count(len(jobs), tell)
        with ThreadPoolExecutor(len(jobs)) as pool, lifeline() as alive:
            futures = [pool.submit(_draw_group, *job, alive, count) for job in jobs.items()]
            groups = [future.result() for future in futures]
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror or error})") from error
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    drawn = [out / name for names, _ in groups for name in names]
    return drawn, list(dict.fromkeys(note for _, notes in groups for note in notes))


class _Count:
    """Counts what the children of all groups have drawn of what they try; what turns out empty is not counted.

    Args:
        groups: Number of children; nothing is told before all have begun.
    """

    def __init__(self, groups: int, tell: Callable[[str, float], None]) -> None:
        self._lock, self._tell = threading.Lock(), tell
        self._waited, self._drawn, self._all = groups, 0, 0

    def begin(self, pictures: int) -> None:
        with self._lock:
            self._waited -= 1
            self._all += pictures

    def end(self, drawn: bool) -> None:
        with self._lock:
            self._drawn += drawn
            self._all -= not drawn
            if not self._waited and self._drawn < self._all:
                self._tell(f"plot ({self._drawn} of {self._all} pictures)", self._drawn / self._all)


def _draw_group(group: str, job: Path, alive: int, count: _Count) -> tuple[list[str], list[str]]:
    """Run the child, and return the files that it drew and its notes."""
    drawn: list[str] = []
    notes: list[str] = []

    def heard(line: str, again: bool) -> None:
        event, _, value = line.rstrip("\n").partition(" ")
        if event == "note":
            notes.append(value)
        elif event == "drawn" and value not in drawn:
            drawn.append(value)
        elif event == "begin" and not again:
            count.begin(int(value))
        elif event == "end" and not again:
            count.end(value == "drawn")

    code, stderr = _run_shown([CHILD, str(job)], alive, heard)
    if code < 0 and group == "rendered":
        notes.append(f"pictures with 3-D rendering were not drawn: {_crash(code)}")
    elif code:
        notes.append(f"pictures ({group}) were not drawn: {_last_line(code, stderr)}")
    return drawn, notes


def render_faces(data: Path, picture: Path) -> str | None:
    """Draw the faces of a part in a child process, see `plots.faces`; return why not if that failed."""
    with lifeline() as alive:
        code, stderr = _run_shown([FACES, str(data), str(picture)], alive)
    return None if code == 0 else _crash(code) if code < 0 else _last_line(code, stderr)


def _last_line(code: int, stderr: str) -> str:
    return [f"exit code {code}", *stderr.strip().splitlines()][-1]


def _crash(code: int) -> str:
    name = next((number.name for number in signal.Signals if number == -code), f"signal {-code}")
    return (
        f"rendering crashed ({name}); install libgl1 libegl1 libegl-mesa0 or libosmesa6; `gudgeon doctor` lists which"
    )


def _run_shown(
    arguments: Sequence[str], alive: int, heard: Callable[[str, bool], None] = lambda line, again: None
) -> tuple[int, str]:
    """Run a child, see `_run_child`; after a crash, run it again without a display.

    VTK uses the first window system that works: X, EGL, OSMesa. Only a broken X server, such as a forwarded one without
    GLX, prevents that.
    """
    code, stderr = _run_child(arguments, (), alive, lambda line: heard(line, False))
    if code < 0 and any(name in os.environ for name in DISPLAYS):
        code, stderr = _run_child(arguments, DISPLAYS, alive, lambda line: heard(line, True))
    return code, stderr


def _run_child(
    arguments: Sequence[str], hidden: Collection[str], alive: int, heard: Callable[[str], None]
) -> tuple[int, str]:
    """Return the child's exit code (−n: killed by signal n) and stderr; it ends with the file `alive`.

    Args:
        heard: Called with each line of stdout as it comes.
    """
    environment = {name: value for name, value in os.environ.items() if name not in hidden} | {"MPLBACKEND": "Agg"}
    command = [sys.executable, "-P", "-m", *arguments]
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as errors:
        child = subprocess.Popen(
            command, env=environment, stdin=alive, stdout=subprocess.PIPE, stderr=errors, encoding="utf-8",
            errors="replace",
        )  # fmt: skip
        with child:
            assert child.stdout is not None
            try:
                for line in child.stdout:
                    heard(line)
            except BaseException:
                child.kill()
                raise
        errors.seek(0)
        return child.returncode, errors.read()
