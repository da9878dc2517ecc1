"""Functions of the commands on strain gauges that measure a wrench, and on an arm on a base that feels.

All take a scene and the arguments `set`, `db` and `out` of `kinds.open_job`, and raise its errors; see there and
docs/base-sensor.md.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.kinds.commands import Changes, Place
from gudgeon.pipeline.kinds.given import Given
from gudgeon.pipeline.kinds.progress import shown
from gudgeon.pipeline.stages.run_report import Progress

if TYPE_CHECKING:
    from gudgeon.pipeline.applications.sensing.calibration import Calibration
    from gudgeon.pipeline.applications.sensing.identify import Parameters
    from gudgeon.pipeline.applications.sensing.job import Inferred
    from gudgeon.pipeline.applications.sensing.tool import Tool

NOISE = (0.5, 0.05)
"""Default standard deviation of a sample of load cells: force [N], moment [N m]."""


def calibrate(
    scene: Given,
    *,
    sensor: str | None = None,
    data: Place = None,
    excite: bool = False,
    parameters: Place = None,
    to: Place = None,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> "Calibration":
    """Write the calibration of a sensor of a scene, from signals of its bridges to the wrench, and return it.

    >>> import gudgeon
    >>> calibration = gudgeon.calibrate(gudgeon.example("base-sensor") / "plate-beams.toml", to="calibration.json")
    >>> calibration.matrix.shape, calibration.condition < 10
    ((6, 8), True)

    Args:
        sensor: Name of the sensor; default: the only one of the scene.
        data: CSV of wrenches and signals; default: unit wrenches on the model.
        excite: Whether the data are of a run in which the arm on the plate moves.
        parameters: Parameters of the arm, as `identify` writes them; default: those of the scene.
        to: File to write; default: calibration.json in the folder of results.
    """
    job = open_job(scene, set=set, db=db, out=out)
    source = (_path(data), excite, _path(parameters))
    return job.kind.function(job.path, "calibrate")(job, sensor, source, _path(to), shown(progress))[1]


def signals(
    scene: Given,
    *,
    sensor: str | None = None,
    to: Place = None,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> Path:
    """Run a scene, write the signals of a sensor's bridges over time as CSV, and return the file.

    >>> import gudgeon
    >>> short = {"run.duration": 1e-4}
    >>> file = gudgeon.signals(gudgeon.example("base-sensor") / "plate-beams.toml", to="signals.csv", set=short)
    >>> file.read_text()[:24]
    'time [s],top0 [V/V],side'

    Args:
        sensor: Name of the sensor; default: the only one of the scene.
        to: File to write; default: signals.csv in the folder of results.
    """
    job = open_job(scene, set=set, db=db, out=out)
    return job.kind.function(job.path, "signals")(job, sensor, _path(to), shown(progress))[0]


def infer(calibration: str | Path, signals: str | Path, *, to: Place = None) -> "Inferred":
    """Write the wrenches of a table of signals by a calibration, as CSV.

    >>> import gudgeon
    >>> scene = gudgeon.example("base-sensor") / "plate-beams.toml"
    >>> calibration = gudgeon.calibrate(scene, to="calibration.json")
    >>> file = gudgeon.signals(scene, to="signals.csv", set={"run.duration": 1e-4})
    >>> inferred = gudgeon.infer("calibration.json", file)
    >>> inferred.path.name, inferred.samples > 100
    ('signals-wrench.csv', True)

    Args:
        calibration: File that `calibrate` wrote.
        signals: CSV whose columns are the channels [V/V, or the unit in brackets], with a column `time` or without.
        to: File to write; default: SIGNALS-wrench.csv next to the signals.

    Raises:
        InputError: a file is missing or none of its kind.
    """
    from gudgeon.pipeline.applications.sensing.job import infer as inferred

    return inferred(Path(calibration), Path(signals), _path(to))


def identify(
    scene: Given,
    *,
    sensor: str | None = None,
    limits: tuple[float, float, float] = (3.0, 0.5, 3.0),
    noise: tuple[float, float] = NOISE,
    data: Place = None,
    calibration: Place = None,
    to: Place = None,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> "Parameters":
    """Identify the base parameters of an arm from the wrench on its base, and write them.

    >>> import gudgeon
    >>> scene = gudgeon.example("base-sensor") / "robot-cells.toml"
    >>> parameters = gudgeon.identify(scene, limits=(0.5, 0.5, 3.0), to="parameters.json")
    >>> len(parameters.document["values"]), parameters.path.name
    (41, 'parameters.json')

    Args:
        sensor: Name of the plate's sensor; default: the only one of the scene.
        limits: Duration of the exciting trajectory [s], largest angle [rad] and rate [rad/s] of a joint.
        noise: Standard deviation of a sample of load cells, of force and moment [N, N m].
        data: CSV of samples; default: a run of the scene on a trajectory of low condition number.
        calibration: File that `calibrate` wrote; default: by unit wrenches.
        to: File to write; default: parameters.json in the folder of results.
    """
    job = open_job(scene, set=set, db=db, out=out)
    files = (_path(data), _path(calibration), _path(to))
    return job.kind.function(job.path, "identify")(job, sensor, limits, noise, files, shown(progress))[0]


def wrench(
    scene: Given,
    *,
    sensor: str | None = None,
    noise: tuple[float, float] = NOISE,
    parameters: Place = None,
    calibration: Place = None,
    data: Place = None,
    to: Place = None,
    set: Changes = (),
    db: Place = None,
    out: Place = None,
    progress: Progress | None = None,
) -> "Tool":
    """Infer the wrench on the tool of an arm from what its base feels, and write it as CSV.

    >>> import gudgeon
    >>> scene = gudgeon.example("base-sensor") / "robot-cells.toml"
    >>> short = {"run.duration": 0.01, "run.samples": 50, "run.checks": False}
    >>> gudgeon.wrench(scene, to="tool-wrench.csv", set=short).contact.shape
    (100, 6)

    Args:
        sensor: Name of the plate's sensor; default: the only one of the scene.
        noise: Standard deviations as `identify` takes them.
        parameters: File that `identify` wrote; default: parameters of the scene.
        calibration: File that `calibrate` wrote; default: by unit wrenches.
        data: CSV of samples; default: a run of the scene, with which the result is compared.
        to: File to write; default: tool-wrench.csv in the folder of results.
    """
    job = open_job(scene, set=set, db=db, out=out)
    files = (_path(parameters), _path(calibration), _path(data), _path(to))
    return job.kind.function(job.path, "wrench")(job, sensor, noise, files, shown(progress))[0]


def _path(file: Place) -> Path | None:
    return None if file is None else Path(file)
