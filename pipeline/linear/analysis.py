"""`gudgeon linear`: assembled modes of a scene and frequency responses between its ports, as tables and a picture."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import csv_text, write_text
from gudgeon.pipeline.linear.static import StaticTable, static_table
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.folder import claim, held
from gudgeon.pipeline.stages.job import Job, refuse_turning
from gudgeon.pipeline.stages.run import run_job
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.errors import SceneError, SolverError

if TYPE_CHECKING:
    from gudgeon.solver.linear.modes import AssembledModes
    from gudgeon.solver.linear.state import Linearised, Place

MODES, RESPONSE, PICTURE = "linear-modes.csv", "linear-response.csv", "linear-response.png"
STATIC = "linear-static.csv"
POINTS, MOST_POINTS = 2001, 1_000_000
WIDTHS = np.concatenate([-np.geomspace(32, 0.25, 15), [0.0], np.geomspace(0.25, 32, 15)])
"""Points in a resonance, over half of its width at 1/√2 of the peak."""
SOURCES = ("basis", "mesh")
"""Of errors of frequencies."""
NO_RESPONSE_ERROR = "a resonance has the error of its frequency, what lies between has that of R and modes at rest"
"""Why responses and static answers have no estimate of their own."""
UNDAMPED = 1e-12
"""Damping ratio that is round-off."""
MISSED = 0.1
"""Distance of a resonance from the next point over half of its width from which on its peak is low by 0.5 % or more."""
QUANTITIES = {"displacement": ("m", 0), "velocity": ("m/s", 1), "acceleration": ("m/s^2", 2)}
"""Unit of each quantity, and the power of iω with which it follows from a displacement."""


@dataclass(frozen=True)
class Asked:
    """What is asked for."""

    closed: tuple[str, ...] = ()
    """`contact.NAME` whose points are all closed."""
    force: str | None = None
    """Port where a unit force acts, or a driven one that moves by a unit; None: no response."""
    at: tuple[str, ...] = ()
    """Ports and probes where the response is read; default: where the force acts."""
    quantity: str = "displacement"
    frequencies: tuple[float, float] | None = None
    """Lowest and highest of the response [Hz]; default: around the modes."""
    points: int | None = None
    """Number of frequencies, spaced evenly on a logarithmic scale; default: `POINTS`, and more in each resonance."""
    loss: float = 0.0
    """Structural loss factor of all elastic bodies."""
    static: bool = False
    """Whether the static answers to unit forces are asked for."""


@dataclass(frozen=True)
class Answer:
    """Modes and response of a scene."""

    modes: list[dict[str, Any]]
    closed: dict[str, int]
    """Number of closed points of each contact."""
    files: list[Path]
    notes: list[str] = field(default_factory=list)
    static: StaticTable | None = None
    not_estimated: dict[str, str] = field(default_factory=dict)
    """Why errors are not estimated, by source: `basis`, `mesh`, and `response` where one is computed."""

    def as_json(self) -> dict[str, Any]:
        """Return the document that `--json` prints."""
        document = {"modes": self.modes, "closed": self.closed, "files": [str(file) for file in self.files],
                    "notes": self.notes, "not_estimated": self.not_estimated}  # fmt: skip
        return document | ({} if self.static is None else {"static": self.static.as_json()})


def analyse(job: Job, request: Asked, progress: Progress) -> Answer:
    """Write modes and response of a scene of bodies at its start into its folder of results.

    Raises:
        InputError, SceneError, SolverError: a name, a range or the scene is wrong.
    """
    _refuse(request)
    refuse_turning(job, "linear")
    for name in job.scene.fields() | job.scene.electrodes():
        raise InputError(
            f"{job.path}: linear: the stiffness of electrostatic fields is not part of it; remove force.{name}, or"
            " put a spring in its place"
        )
    run_job(job, "morph", progress)
    progress("linear", 0.0)
    from gudgeon.solver.checks.frequencies import frequency_errors
    from gudgeon.solver.linear.load_stiffness import with_load_stiffness
    from gudgeon.solver.linear.modes import assembled_modes
    from gudgeon.solver.linear.state import linearised

    with named(job.path, InputError, SceneError, SolverError):
        system = with_load_stiffness(system_of(job))
        linear = linearised(system, request.closed)
        force, read = _ends(linear, request)
        modes = assembled_modes(linear)
        table = static_table(linear, request.force, request.at) if request.static else None
        errors, reasons = frequency_errors(system, request.closed, modes)
    rows, notes = _mode_rows(modes, errors), _notes(linear, modes)
    files = [job.out / MODES]
    with held(job.out):
        claim(job)
        write_text(files[0], _modes_text(rows))
        (job.out / STATIC).unlink(missing_ok=True)
        if table is not None:
            write_text(job.out / STATIC, table.as_csv())
            files.append(job.out / STATIC)
        if force is None or request.static:
            for name in (RESPONSE, PICTURE):
                (job.out / name).unlink(missing_ok=True)
        else:
            notes += _write_response(job, request, linear, modes, (force, read))
            files += [job.out / RESPONSE, job.out / PICTURE]
    progress("linear", 1.0)
    if force is not None or request.static:
        reasons["response"] = NO_RESPONSE_ERROR
    return Answer(rows, linear.closed, files, notes, table, reasons)


def _ends(linear: "Linearised", request: Asked) -> tuple["Place | None", list["Place"]]:
    """Return the row of the force, if one is named, and the rows that are read: of the force by default."""
    from gudgeon.solver.linear.state import places

    rows = [] if request.force is None else places(linear, request.force, "--force")
    if request.force is not None and request.force.startswith("motion."):
        rows = rows[:1]  # Along its direction; the rest are held.
    if len(rows) > 1 and not request.static:
        raise SceneError(f"--force '{request.force}': it has {len(rows)} rows; name one, as '{rows[0].label}'")
    if rows and rows[0].port < 0:
        raise SceneError(f"--force '{request.force}': a force acts at a contact, joint, force or motion")
    names = request.at or filter(None, [request.force])
    read = [row for name in names for row in places(linear, name, "--at")]
    return (rows[0] if rows else None), read


def _refuse(request: Asked) -> None:
    if request.quantity not in QUANTITIES:
        raise InputError(f"--quantity '{request.quantity}': allowed: {', '.join(QUANTITIES)}")
    if not 0 <= request.loss < 1:
        raise InputError(f"--loss {request.loss:g}: allowed: 0 to below 1")
    if request.static and request.frequencies is not None:
        raise InputError("--frequencies: a static answer has none; leave it out, or --static")
    if request.force is None and request.at and not request.static:
        raise InputError("--at: a response needs --force, where it acts")
    if request.frequencies is not None:
        low, high = request.frequencies
        if not 0 < low < high < np.inf:
            raise InputError(f"--frequencies {low:g} {high:g}: two rising frequencies above zero [Hz] are needed")
    if request.points is not None and not 2 <= request.points <= MOST_POINTS:
        raise InputError(f"--points {request.points}: allowed: 2 to {MOST_POINTS}")


def _mode_rows(modes: "AssembledModes", errors: dict[str, np.ndarray]) -> list[dict[str, Any]]:
    """Return the rows of assembled modes, with the errors of their frequencies by source, (m,) each."""
    rows = []
    for n, (frequency, ratio) in enumerate(zip(modes.frequencies, modes.damping, strict=True)):
        row: dict[str, Any] = {"number": n + 1, "frequency": float(frequency), "damping": float(ratio)}
        row["energy"] = {name: float(fractions[n]) for name, fractions in modes.shares.items()}
        row["estimated_errors"] = {s: float(values[n]) for s, values in errors.items() if np.isfinite(values[n])}
        row["mass"] = None if modes.masses is None else modes.masses[n].tolist()
        rows.append(row)
    return rows


def _modes_text(rows: list[dict[str, Any]]) -> str:
    heads = ["mode", "frequency [Hz]", "damping ratio [1]"]
    heads += [f"energy of {name} [1]" for name in (rows[0]["energy"] if rows else ())]
    masses = bool(rows) and rows[0]["mass"] is not None
    heads += [f"effective mass {axis} [kg]" for axis in "xyz"] if masses else []
    heads += [f"estimated error by {source} [1]" for source in SOURCES]
    lines = [
        [str(row["number"]), *(repr(x) for x in (row["frequency"], row["damping"], *row["energy"].values())),
         *(repr(x) for x in row["mass"] or ()),
         *(repr(row["estimated_errors"].get(source, np.nan)) for source in SOURCES)]
        for row in rows
    ]  # fmt: skip
    return csv_text([heads, *lines])


def _notes(linear: "Linearised", modes: "AssembledModes") -> list[str]:
    from gudgeon.solver.linear.response import band

    notes, limit = [], band(linear)
    if np.isfinite(limit):
        notes.append(
            f"up to {limit:.4g} Hz, half of the lowest of the bodies' highest kept frequencies, the residual"
            " flexibility stands for the modes that are left out"
        )
    if modes.masses is None:
        notes.append("effective masses of supported bodies need a run.gravity, with which their record is read")
    if modes.overdamped:
        notes.append(f"{modes.overdamped} overdamped motions are no oscillations and are left out")
    return notes


def _write_response(
    job: Job, request: Asked, linear: "Linearised", modes: "AssembledModes", ends: tuple["Place", list["Place"]]
) -> list[str]:
    """Write table and picture of the response; returns notes."""
    from gudgeon.pipeline.linear.picture import draw
    from gudgeon.solver.linear.response import band, resonances, response

    force, read = ends
    low, high = request.frequencies or _range(modes, band(linear))
    frequencies = np.geomspace(low, high, request.points or POINTS)
    peaks, ratios = resonances(modes.frequencies, modes.damping, request.loss)
    within = (peaks > low) & (peaks < high)
    peaks, ratios = peaks[within], ratios[within]
    if request.points is None:
        frequencies = np.union1d(frequencies, _in_resonances(peaks, ratios, (low, high)))
    symbol, power = QUANTITIES[request.quantity]
    answers = response(linear, force, read, frequencies, loss=request.loss)
    powers = np.array([0 if p.unit else power for p in read])
    answers = answers * (2j * np.pi * frequencies[:, None]) ** powers
    per = "" if force.given else "/N"
    heads, units = ["frequency [Hz]"], [f"{point.unit or symbol}{per}" for point in read]
    for point, unit in zip(read, units, strict=True):
        heads += [f"{point.label} amplitude [{unit}]", f"{point.label} phase [deg]"]
    columns = np.stack([np.abs(answers), np.degrees(np.angle(answers))], axis=2).reshape(len(answers), -1)
    rows = np.column_stack([frequencies, columns])
    write_text(job.out / RESPONSE, csv_text([heads, *([repr(float(x)) for x in row] for row in rows)]))
    title = f"{request.quantity} per {'motion' if force.given else 'force'} at {force.label}"
    draw(job.out / PICTURE, (job.name, title), frequencies, answers, ([p.label for p in read], units), band(linear))
    notes = _stepped_over(frequencies, peaks, ratios)
    if high > band(linear):
        notes.append(f"--frequencies: beyond {band(linear):.4g} Hz modes are missing from the response")
    return notes


def _in_resonances(peaks: np.ndarray, ratios: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Return frequencies in the resonances of damped modes, within limits [Hz]."""
    within = (peaks[:, None] * (1 + ratios[:, None] * WIDTHS))[ratios > UNDAMPED].ravel()
    return within[(within > limits[0]) & (within < limits[1])]


def _stepped_over(frequencies: np.ndarray, peaks: np.ndarray, ratios: np.ndarray) -> list[str]:
    """Return notes on resonances that a response may step over: narrow ones between its points, and undamped ones."""
    notes, i = list[str](), np.clip(np.searchsorted(frequencies, peaks), 1, len(frequencies) - 1)
    distance = np.minimum(np.abs(peaks - frequencies[i - 1]), np.abs(frequencies[i] - peaks))
    narrow, undamped = (
        np.flatnonzero((ratios > UNDAMPED) & (distance > MISSED * ratios * peaks)),
        peaks[ratios <= UNDAMPED],
    )
    if len(narrow):
        k = narrow[int((distance / (ratios * peaks))[narrow].argmax())]
        notes.append(
            f"--points: {len(narrow)} resonances are narrower than the spacing, that at {peaks[k]:.6g} Hz is"
            f" {2 * ratios[k] * peaks[k]:.2g} Hz wide and the next point {distance[k]:.2g} Hz away; leave --points out"
        )
    if len(undamped):
        notes.append(
            f"the response has no bound at {len(undamped)} undamped modes, the lowest at {undamped.min():.6g} Hz; its"
            " peaks there are those of its points; --loss or body.NAME.damping bounds them"
        )
    return notes


def _range(modes: "AssembledModes", limit: float) -> tuple[float, float]:
    """Return a range around the modes below a limit [Hz]."""
    elastic = modes.frequencies[modes.frequencies > 0]
    if not len(elastic):
        return 1.0, 1000.0
    below_limit = elastic[elastic <= limit]
    return 0.2 * float(elastic[0]), 1.5 * float(below_limit[-1] if len(below_limit) else elastic[0])


def answer_text(answer: Answer) -> str:
    """Return the modes as a table for the terminal."""
    names = list(answer.modes[0]["energy"]) if answer.modes else []
    heads = f"{'mode':>4} {'frequency':>14}    {'damping':>9}  {'basis':>7}  {'mesh':>7}  "
    lines = [heads + "  ".join(f"{name:>10}" for name in names)]
    for row in answer.modes[:30]:
        shares = "  ".join(f"{row['energy'][name]:10.1%}" for name in names)
        stated = row["estimated_errors"]
        errors = "  ".join(f"{stated[source]:7.1e}" if source in stated else f"{'–':>7}" for source in SOURCES)
        lines.append(f"{row['number']:4} {row['frequency']:14.6g} Hz {row['damping']:9.3g}  {errors}  {shares}")
    if len(answer.modes) > 30:
        lines.append(f"… {len(answer.modes)} modes in all")
    if answer.static is not None:
        lines += ["", answer.static.as_text()]
    closed = [f"{name}: {count} points" for name, count in answer.closed.items() if count]
    lines += [f"error of {source} not estimated: {reason}" for source, reason in answer.not_estimated.items()]
    lines.append(f"\nclosed contacts: {', '.join(closed) or 'none'}")
    return "\n".join([*lines, *(f"written: {file}" for file in answer.files)])
