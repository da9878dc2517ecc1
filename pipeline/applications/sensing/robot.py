"""A robot arm and what its base feels: on load cells, or on a plate whose strain gauges are wired to a sensor."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.applications.sensing.bridges import bridge_matrix
from gudgeon.pipeline.applications.sensing.excitation import Series
from gudgeon.pipeline.applications.sensing.standing import Arm, Gauged, Standing, about, arm_of, standing
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.linear.analysis import Asked, analyse
from gudgeon.pipeline.linear.inertia import static_inertia
from gudgeon.pipeline.scenes.gauge import Sensor
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.job import Job, contact_job
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.joints.markers import Fixed

KNOTS = 400
"""Of the table of an excited joint, a second."""
DIGITS = 12
"""Of its angles [rad]."""


@dataclass(frozen=True)
class Robot:
    """An arm of a scene on its base."""

    job: Job
    base: Standing | Gauged
    sensor: Sensor | None
    """Of a plate."""
    strains: np.ndarray | None
    """Of the gauges per unit wrench on the plate, (g, 6)."""

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.base.arm

    @property
    def gravity(self) -> np.ndarray:
        """[m/s²], (3,)."""
        return np.array(self.job.scene.run.gravity, float)

    @property
    def bridges(self) -> np.ndarray:
        """Signals per strain [V/V], (n, g)."""
        assert self.sensor is not None
        gauges = self.gauges
        return bridge_matrix(self.sensor.channels(gauges), gauges, self.sensor.gauge_factor)

    @property
    def gauges(self) -> tuple[str, ...]:
        """Names of the plate's gauges."""
        assert self.sensor is not None
        return tuple(self.job.scene.body[self.sensor.body].gauges)

    def signals(self, trajectory: Trajectory) -> np.ndarray:
        """Return the ideal signals of a run [V/V], (s, n)."""
        assert self.sensor is not None
        strains = np.column_stack([trajectory.gauges[f"{self.sensor.body}.{name}"] for name in self.gauges])
        return strains @ self.bridges.T

    def own(self, carried: np.ndarray) -> np.ndarray:
        """Return the weight and inertia of the stand, and the inertia of its base, at accelerations (s, 6), (s, 6)."""
        return (
            carried @ self.base.yields().mass + (np.concatenate([-self.gravity, np.zeros(3)]) + carried) @ self.arm.mass
        )

    def load(self, times: np.ndarray, parameters: np.ndarray, carried: np.ndarray | None = None) -> np.ndarray:
        """Return the wrench of the base on the stand of an arm that touches nothing, (s, 6).

        Args:
            parameters: Of the links, (10 n,).
            carried: Acceleration of the base, (s, 6); default: none.
        """
        moved = np.zeros((len(times), 6)) if carried is None else carried
        return self.arm.chain.regressor(*self.arm.angles(times), self.gravity, moved) @ parameters + self.own(moved)


def names_of(robot: Robot) -> list[str]:
    """Return the names of the driven joints of an arm, from its stand on."""
    return [drive.joint for drive in robot.arm.drives]


def robot_of(job: Job, sensor: str | None, progress: Progress) -> Robot:
    """Return the arm of a scene.

    Raises:
        InputError: the scene has none, or nothing measures the wrench on its base.
    """
    scene = job.scene
    with named(job.path, InputError):
        arm = arm_of(scene)
        feet = [j for j in scene.hinges().values()
                if isinstance(j, Fixed) and j.body == arm.stand and j.against is not None]  # fmt: skip
        if not feet:
            return Robot(job, standing(scene), None, None)
        if len(feet) > 1:
            if sensor is not None:
                raise InputError(f"--sensor: '{sensor}' given, but the stand is fixed on {len(feet)} load cells")
            return Robot(job, _on_cells(job, arm, progress), None, None)
        plate = str(feet[0].against)
        chosen = _sensor_on(scene.sensor, plate, sensor)
    alone = unit_wrenches(job, plate, str(feet[0].against_interface), progress)
    gauges = [f"{plate}.{name}" for name in scene.body[plate].gauges]
    base = Gauged(
        arm, gauges, np.linalg.pinv(alone.strains), alone.compliance, _beta(job, plate), mass=alone.mass, own=alone.own
    )
    return Robot(job, base, chosen, alone.strains)


def _sensor_on(sensors: Mapping[str, Any], plate: str, name: str | None) -> Any:
    """Return the sensor on a plate that has a name, or the only one; raises InputError where there is none."""
    able = {key: sensor for key, sensor in sensors.items() if sensor.body == plate}
    if name is not None and name not in able:
        raise InputError(f"--sensor: '{name}' given, on body '{plate}' are {', '.join(able) or 'none'}")
    if not able or (name is None and len(able) > 1):
        have = ", ".join(able) or "none"
        raise InputError(f"sensor: the stand is fixed on body '{plate}', whose sensors are {have}; name one")
    return able[name] if name is not None else next(iter(able.values()))


def _beta(job: Job, body: str) -> float:
    """Return the damping of a body over its stiffness [s]."""
    return float(getattr(job.scene.body[body].damping, "beta", None) or 0.0)


def _on_cells(job: Job, arm: Arm, progress: Progress) -> Standing:
    """Return an arm whose stand is fixed on several elastic load cells, each on the ground.

    The wrench of a cell is that of its joint with the stand, and its stiffness that of unit wrenches on its top.
    """
    scene, rows, cells = job.scene, [], set[str]()
    probes = {getattr(p, "of", ""): name for name, p in scene.probe.items()}
    for name, joint in scene.hinges().items():
        if not isinstance(joint, Fixed) or joint.body != arm.stand or joint.against is None:
            continue
        if f"joint.{name}" not in probes:
            raise InputError(f"probe: no probe reads joint.{name}; add one of kind 'force'")
        if joint.against_interface is None:
            raise InputError(f"joint.{name}.against_interface: is missing; name the top of cell '{joint.against}'")
        if joint.against in cells:
            raise InputError(f"joint.{name}.against: '{joint.against}' holds the stand twice; a load cell has one top")
        cells.add(joint.against)
        compliance = unit_wrenches(job, joint.against, joint.against_interface, progress).compliance
        beta = _beta(job, joint.against)
        offset, K = np.array(joint.at or (0.0, 0.0, 0.0)), np.linalg.inv(compliance)
        rows.append((probes[f"joint.{name}"], offset, about(K, offset), beta * about(K, offset)))
    names, arms, stiffness, damped = zip(*rows, strict=True)
    positions = arm.chain.base + np.array(arms)
    return Standing(arm=arm, cells=list(names), places=positions, stiffness=np.sum(stiffness, axis=0),
                    damping=np.sum(damped, axis=0))  # fmt: skip


@dataclass(frozen=True)
class Alone:
    """A plate without the arm, supported where joints fix it on the ground."""

    strains: np.ndarray
    """Of its gauges per unit wrench on the hub [1/N, 1/(N m)], (g, 6)."""
    compliance: np.ndarray
    """Motion of the hub by it [m, rad per N, N m], (6, 6)."""
    mass: np.ndarray
    """Φᵀ M Φ of its static shapes Φ, one for each motion of the hub [kg, kg m, kg m²], (6, 6)."""
    own: np.ndarray
    """Strains by its own weight, (g,)."""


def unit_wrenches(job: Job, plate: str, hub: str, progress: Progress) -> Alone:
    """Return the static answers of the plate of an arm.

    Its basis has the static shapes of the hub's motions (R. J. Guyan, AIAA J. 3 (1965) 380) and of gravity. Over the
    modes of these, C = Σ b bᵀ/ω² is the hub's compliance and C Φᵀ M Φ C = Σ b bᵀ/ω⁴.
    """
    scene, tables = job.scene, job.tables
    component = scene.component_of(plate)
    component_table = dict(tables["component"][component])
    interfaces = [j.interface for j in scene.hinges().values()
            if isinstance(j, Fixed) and j.body == plate and j.against is None]  # fmt: skip
    if not interfaces or None in interfaces:
        raise InputError(f"{job.path}: body.{plate}: no joint of kind 'fixed' holds it on the ground at an interface")
    component_table["supports"] = [scene.component[component].interface[str(name)].surface for name in interfaces]
    component_table["interface"] = {hub: component_table["interface"][hub]}
    component_table["modes"] = {"reduction": "row-craig-bampton", "normal_count": 0, "fixed_count": 0}
    body_table = {
        key: value for key, value in tables["body"][plate].items() if key in ("component", "gauges", "orientation")
    }
    load = {"kind": "wrench", "body": plate, "interface": hub, "force": [0.0, 0.0, 1.0], "moment": [0.0, 0.0, 0.0],
            "expression": "1"}  # fmt: skip
    alone = {"component": {component: component_table}, "body": {plate: body_table}, "force": {"wrench": load},
             "run": {"duration": 1e-3, "gravity": list(scene.run.gravity)}}  # fmt: skip
    still = contact_job(job.place(name=f"{job.name}-{plate}", tables=alone, out=job.out / "plate", overrides=()))
    gauges = tuple(f"gauge.{plate}.{name}" for name in scene.body[plate].gauges)
    table = analyse(still, Asked(static=True), progress).static
    assert table is not None
    rows = dict(zip(table.places, table.values, strict=True))
    strains, C = np.array([rows[name] for name in gauges]), np.array([rows[f"force.wrench[{n}]"] for n in range(1, 7)])
    mass, gravity_strains = static_inertia(still, "force.wrench", gauges)
    return Alone(strains, C, mass=np.linalg.solve(C, np.linalg.solve(C, mass).T), own=gravity_strains)


def moved_job(job: Job, arm: Arm, series: Series, duration: float, rate: float) -> Job:
    """Return the job of an arm without contacts whose joints follow a series."""
    times = np.linspace(0.0, duration, int(KNOTS * duration) + 1)
    angles = np.round(series.at(times)[0], DIGITS) + 0.0
    tables: dict[str, Any] = {
        key: value for key, value in job.tables.items() if key not in ("contact", "plot", "report")
    }
    joints = dict(tables["joint"])
    by_joint = {drive.joint: n for n, drive in enumerate(arm.drives)}
    for name, table in job.tables["joint"].items():
        if table.get("kind") == "driven" and table["joint"] in by_joint:
            values = np.column_stack([times, angles[:, by_joint[table["joint"]]]]).tolist()
            joints[name] = {"kind": "driven", "joint": table["joint"], "values": values}
    probes: Mapping[str, Any] = tables.get("probe", {})
    free_probes = {name: p for name, p in probes.items() if not str(p.get("of", "")).startswith("contact.")}
    count = round(duration * rate)
    frames = max(2, count // 20)
    run = tables["run"] | {"duration": duration, "samples": frames * 20, "frames": frames}
    tables |= {"joint": joints, "run": run} | ({"probe": free_probes} if probes else {})
    return contact_job(job.place(name=f"{job.name}-excited", tables=tables, out=job.out / "excited", overrides=()))


def run_of(job: Job, progress: Progress) -> Trajectory:
    """Return the record of a run, computed unless the database has it."""
    report = solve_records(job, "solve", progress)
    if report.reason is not None:
        raise InputError(f"{job.path}: the run ended early: {report.reason}")
    return job.store.get(job.trajectory().key, "trajectory")


def robot_like(robot: Robot, job: Job) -> Robot:
    """Return the arm on its base with the joints' motion of another job."""
    arm = replace(robot.arm, drives=arm_of(job.scene).drives)
    return replace(robot, base=replace(robot.base, arm=arm))


def robot_along(robot: Robot, angles: Any) -> Robot:
    """Return the arm on its base whose joints move as a spline of times."""
    return replace(robot, base=replace(robot.base, arm=Measured(**vars(robot.arm), spline=angles)))


@dataclass(frozen=True)
class Measured(Arm):
    """An arm whose joints' angles were measured."""

    spline: Any

    def angles(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return joint angles, rates and second rates of the spline, (t, n) each."""
        return self.spline(times), self.spline(times, 1), self.spline(times, 2)
