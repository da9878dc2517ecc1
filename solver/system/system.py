"""A compiled scene: the arrays of the time loop, limited to what the scene needs."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.blocks import Blocks
from gudgeon.solver.contact.bores import ElasticBore
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.contact.windows import impact_window
from gudgeon.solver.errors import SolverError
from gudgeon.solver.methods import METHODS
from gudgeon.solver.obstacles.plane import Plane
from gudgeon.solver.result import Result
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.fields.reading import Fields
from gudgeon.solver.system.loads import Driving
from gudgeon.solver.system.probes import Probes
from gudgeon.solver.system.springs import Springs
from gudgeon.solver.system.terms.term import Term
from gudgeon.solver.vectors import unit

DEPENDENT = 1e-11
"""Pivot relative to the diagonal of the compliance below which a contact point depends on others.

Of twins of 64 points round-off leaves 8e-14 to 3e-13; of the points of `data/skirt`, `piston/coarse` and `stack` the
least is 0.4. A force at such a pivot would be known to 1e-5 at best.
"""
SAME_PLACE = 1e-9
"""Relative difference of two gaps of a point below which its obstacles are at one place."""
RINGS = 2.5
"""Default window over the shortest kept period where forces jump: of rods with 60 modes or more, 0.6 % of the force is
left of the ringing at residual flexibility."""


@dataclass(frozen=True, eq=False)
class System:
    """All bodies and contacts as arrays. Shapes: m coordinates, c contact rows, F functions of traction spaces."""

    scene: Scene
    bodies: dict[str, FlexibleBody]
    contacts: list[ContactRows]
    stiffness: np.ndarray
    """ω² [rad²/s²], (m,)."""
    damping: np.ndarray
    """c of q̈ + c q̇ + ω² q = f [1/s], (m,)."""
    rigid: np.ndarray
    """Numbers of the rigid coordinates."""
    rows: Blocks
    """∂g/∂q [kg^-½], (c, m)."""
    gap: np.ndarray
    """Gaps at q = 0 [m], (c,)."""
    sag: np.ndarray
    """Share of the gaps due to gravity on coordinates that a nested system leaves out [m], (c,)."""
    residual: Blocks
    """R [m/N], (c, c)."""
    layer: np.ndarray
    """Compliance of the surface layer [m/N], (c,)."""
    dashpot: np.ndarray
    """[N s/m], (c,)."""
    functions: Blocks
    """Inward displacement of traction spaces, ∂e/∂q, (F, m)."""
    function_residual: Blocks
    """R of the traction spaces [m/N], (F, F)."""
    restitution: np.ndarray
    """Of rigid contact; −1 where contact is compliant, (c,)."""
    law: np.ndarray
    """K, n, χ, c of the law at each row, (c, 4)."""
    tangents: Blocks
    """Displacement along the line of friction, (c, m)."""
    friction: np.ndarray
    """Static and kinetic coefficient, (c, 2)."""
    belt: np.ndarray
    """Velocity of the obstacle along the line [m/s], (c,)."""
    springs: Springs
    probes: Probes
    gauges: list[str]
    """`body.gauge` of each gauge value."""
    gauge_rows: np.ndarray
    """(G, m)"""
    gauge_residual: np.ndarray
    """Quasi-static value per contact force, (G, c)."""
    gauge_weights: np.ndarray
    """Value under gravity that the coordinates lack, (G,)."""
    gauge_rates: np.ndarray
    """Value per rate of a coordinate, (G, m)."""
    driving: Driving
    loads: np.ndarray
    """Loads and joint forces at the start, (L,)."""
    position: np.ndarray
    """Initial coordinates [m kg^½], (m,)."""
    start_forces: np.ndarray
    """Contact forces of the static equilibrium at the start [N], (c,)."""
    start_pulls: np.ndarray
    """Forces of the springs' rows along their elongations at the start [N], (b,)."""
    start_friction: np.ndarray
    """Forces along the tangents at the start, with friction in equilibrium [N], (c, 2)."""
    start_stretch: np.ndarray
    """Displacement of the tangents at the start from where they stick [m], (c, 2)."""
    overlaps: np.ndarray
    """Points that loads at the start press into what they meet while their body is free to move out of it, (c,): no
    start until an equilibrium with friction, or on all contacts, holds it there."""
    velocity: np.ndarray
    """Initial velocities [m kg^½/s], (m,)."""
    fields: Fields
    bores: dict[str, ElasticBore]
    """Of elastic bearings, by joint."""
    terms: list[Term]
    impact_windows: Mapping[str, float] = field(default_factory=dict)
    """Windows of forces that follow the impacts that were found, by contact [s]."""

    @property
    def start_contact_energy(self) -> float:
        """Energy in R, surface layers and laws at the start [J]."""
        forces, smooth = self.start_forces, (self.law[:, 0] > 0) & (self.layer == 0)
        (K, n), law_forces = self.law[smooth, :2].T, forces[smooth]
        return 0.5 * float(forces @ (self.compliance @ forces)) + float(
            (law_forces * (law_forces / K) ** (1 / n) / (n + 1)).sum()
        )

    @property
    def flexibility(self) -> np.ndarray:
        """Λ⁻¹ of the elastic coordinates, zero of the rigid ones [s²/rad²], (m,)."""
        elastic, flexibilities = self.stiffness > 0, np.zeros(len(self.stiffness))
        flexibilities[elastic] = 1 / self.stiffness[elastic]
        return flexibilities

    @property
    def offsets(self) -> dict[str, int]:
        """First coordinate of each body."""
        return {name: body.first for name, body in self.bodies.items()}

    @property
    def elastic_spans(self) -> np.ndarray:
        """First and last + 1 elastic coordinate of each body, (b, 2)."""
        return np.array([(body.elastic.start, body.elastic.stop) for body in self.bodies.values()], np.int64)

    @property
    def contact_of(self) -> np.ndarray:
        """Number of each row's contact, (c,)."""
        return np.repeat(np.arange(len(self.contacts)), [len(item.points) for item in self.contacts])

    @property
    def first_rows(self) -> list[int]:
        """First row of each contact."""
        return [item.rows.start for item in self.contacts]

    @cached_property
    def rubbing(self) -> frozenset[str]:
        """Contacts whose runs keep the friction of their points."""
        if self.scene.loop != "small":
            return frozenset()
        return frozenset(name for name, contact in self.scene.contact.items() if contact.friction is not None)

    @property
    def directions(self) -> np.ndarray:
        """Direction of each row's force on its body, (c, 3)."""
        return np.concatenate([np.empty((0, 3)), *(item.directions for item in self.contacts)])

    @property
    def friction_lines(self) -> np.ndarray:
        """Unit vector of each row's friction, zero without friction, (c, 3)."""
        lines = np.zeros((len(self.gap), 3))
        for item in self.contacts:
            friction = self.scene.contact[item.name].friction
            if friction is not None and friction.direction is not None:
                lines[item.rows] = unit(friction.direction)
        return lines

    @property
    def shortest_period(self) -> float:
        """Period of the highest kept frequency of all bodies [s]; 0 where nothing is elastic."""
        return _period(self.stiffness)

    @property
    def resolution(self) -> float:
        """Time that the model resolves [s]: the longest of the shortest periods of the elastic bodies in contact.

        A force over a shorter time contains frequencies that one of them lacks. 0 where none is elastic; that of all
        bodies where there are no contacts.
        """
        sides = [(contact.body, *(side.body for side in (contact.other, contact.master) if side is not None))
                 for contact in self.contacts]  # fmt: skip
        names = {name for side in sides for name in side} or set(self.bodies)
        return max(_period(self.bodies[name].stiffness) for name in names)

    @property
    def separation(self) -> float:
        """Time below which impacts are not told apart [s], over which the modes resolve a force; 0 where all are.

        A force jumps where a wave front arrives, and a truncated series rings there for some periods of its cut-off; a
        nonlinear law, which begins at no stiffness, limits the bandwidth of its force.
        """
        if (window := self.scene.run.window) is not None:
            return window
        periods = 1.0 if all(c.smooth_law for c in self.scene.contact.values()) else RINGS
        return min(periods * self.resolution, self.scene.run.duration)

    @property
    def windows(self) -> np.ndarray:
        """Time over which forces of each contact are averaged [s], (k,); 0 where they are not."""
        return np.array([self.impact_windows.get(c.name, self.separation) for c in self.contacts])

    def windowed(self, impacts: Mapping[str, np.ndarray]) -> "System":
        """Return the system with windows that follow the impacts of each contact, (b, 9), of a run; itself if equal."""
        # Without residual flexibility or a law, modes have no force over less than their periods.
        contacts = {n: c for n, c in self.scene.contact.items() if METHODS[c.method].flexible or c.smooth_law}
        windows = {name: impact_window(impacts[name], self.separation) for name in contacts if name in impacts}
        shorter = {name: window for name, window in windows.items() if window < self.separation}
        stays = self.scene.run.window is not None or shorter == self.impact_windows
        return self if stays else replace(self, impact_windows=shorter)

    def gauged(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return what gauges show of coordinates and their rates, (t, m) each, and of gravity, (t, G)."""
        return position @ self.gauge_rows.T + velocity @ self.gauge_rates.T + self.gauge_weights

    def of_records(self, states: np.ndarray) -> np.ndarray:
        """Return states, (f, m), of those over the coordinates of the bodies' records, (f, n)."""
        bodies = list(self.bodies.values())
        body_states = np.split(states, np.cumsum([body.record_count for body in bodies])[:-1], axis=1)
        bases = [body.basis for body in bodies]
        return np.hstack([s if b is None else s @ b for b, s in zip(bases, body_states, strict=True)])

    def moved_gaps(self, position: np.ndarray) -> np.ndarray:
        """Return the change of the gaps by coordinates, (m,), with points over traction spaces slid by them [m], (c,).

        It is ∞ for points beside their space.
        """
        change, inward = self.rows @ position, self.functions @ position
        for contact in self.contacts:
            if (master := contact.master) is not None:
                change[contact.rows] += master.at_points(self.slid(contact, position), inward[contact.functions])
        return change

    def slid(self, contact: ContactRows, position: np.ndarray) -> float:
        """Return how far a contact's points have slid over their traction space by coordinates, (m,) [m]."""
        assert contact.master is not None
        body_name, master = (self.bodies[name] for name in (contact.body, contact.master.body))
        moved = [body.centre_motion(position[body.rigid])[:3] for body in (body_name, master)]
        return float(contact.master.direction @ (moved[0] - moved[1]))

    @property
    def beside(self) -> np.ndarray:
        """Which points start beside the face with edges that they may meet, (c,)."""
        on_edge = np.zeros(len(self.gap), np.bool_)
        for contact in self.contacts:
            face = self.scene.contact[contact.name].against
            if isinstance(face, Plane) and face.edges:
                on_edge[contact.rows] = face.beside(contact.points + np.asarray(self.scene.body[contact.body].position))
        return on_edge

    @property
    def distinct(self) -> np.ndarray:
        """Which rows are not of a point that an earlier contact has along the same line at another place, (c,).

        Obstacles at different places cannot press the same point along the same line at once, such as the top of a
        plate and the bottom of a hole in it, or faces with edges beside each other. Two at one place can: how they
        share the force is not determined.
        """
        distinct_rows = np.ones(len(self.gap), np.bool_)
        seen: dict[tuple[str, str, int, tuple[float, ...]], float] = {}
        for contact in self.contacts:
            if contact.other is not None or contact.master is not None:
                continue
            for k, line in enumerate(contact.directions):
                row = contact.rows.start + k
                key = contact.body, contact.interface, k, tuple(np.round(line, 6).tolist())
                gap = float(self.gap[row])
                if key in seen:
                    gap_difference = abs(gap - seen[key])
                    distinct_rows[row] = not self.edged(contact) and gap_difference <= SAME_PLACE * max(
                        abs(gap), abs(seen[key])
                    )
                seen.setdefault(key, gap)
        return distinct_rows

    def edged(self, contact: ContactRows) -> bool:
        """Whether the points of a contact meet a face with edges."""
        face = self.scene.contact[contact.name].against
        return isinstance(face, Plane) and bool(face.edges)

    def beyond(self, contact: ContactRows, positions: np.ndarray) -> np.ndarray:
        """Return by how much gaps to a solid exceed those to one face of it [m], (f, c), at coordinates (f, m)."""
        body, face = self.bodies[contact.body], self.scene.contact[contact.name].against
        assert isinstance(face, Plane)
        placed = contact.points + np.asarray(self.scene.body[contact.body].position)
        rows = [body.rigid_rows(contact.points, np.tile(axis, (len(contact.points), 1))) for axis in np.eye(3)]
        moved = np.stack([positions[:, body.rigid] @ row.T for row in rows], axis=-1)
        return np.maximum(0.0, -np.array([face.leads(placed + m).min(axis=1) for m in moved]))

    def opened(self) -> "System":
        """Return the system with the points open that start beside the face that they may meet."""
        beside = self.beside
        if not beside.any():
            return self
        gap = self.gap.copy()
        far = max(float(np.abs(contact.points).max()) for contact in self.contacts)
        gap[beside] = np.maximum(gap[beside], far)
        return replace(self, gap=gap)

    @property
    def rigid_contact(self) -> np.ndarray:
        """Which rows have no compliance at all, (c,)."""
        return self.restitution >= 0

    @property
    def compliance(self) -> Blocks:
        """R + surface layer [m/N], (c, c)."""
        return self.residual.with_diagonal(self.layer)

    @property
    def coupled(self) -> bool:
        """Whether R couples the gap of one point with the contact force of another."""
        return bool(self.residual.beside_diagonal().any())

    def yielding(self) -> np.ndarray:
        """Return the compliance of each nonlinear law at the largest indentation that the start can cause [m/N], (c,).

        Its energy is the kinetic energy of a row's effective mass at its largest possible speed, and the work of
        gravity until closing.
        """
        compliances = np.zeros(len(self.gap))
        for row in np.flatnonzero((self.law[:, 0] > 0) & (self.layer == 0)):
            (stiffness, exponent), contact_row = self.law[row, :2], self.rows[row]
            square = float(contact_row @ contact_row)
            speed = float(np.linalg.norm(self.velocity)) * np.sqrt(square)
            fall = 2 * float(np.abs(contact_row) @ np.abs(self.driving.gravity)) * max(float(self.gap[row]), 0.0)
            energy = 0.5 * (speed**2 + fall) / square
            deepest = ((exponent + 1) * energy / stiffness) ** (1 / (exponent + 1))
            compliances[row] = 1 / (exponent * stiffness * deepest ** (exponent - 1)) if deepest > 0 else np.inf
        return compliances

    def critical_frequency(self) -> float:
        """Return ω_c [rad/s]: ω_c² = λmax(Λ + rowsᵀ C⁻¹ rows), all contacts closed, other bodies' surfaces rigid.

        Raises:
            SolverError: C is singular.
        """
        springs = self.springs
        if len(self.gap) == 1 and not len(springs.stiffness) and not self.rigid_contact[0]:
            return _single(self.stiffness, self.rows[0], self.compliance[0][0] + self.yielding()[0])
        matrix = np.diag(self.stiffness) + springs.rows.T @ springs.softened() @ springs.rows
        yielding = self.yielding()
        soft = np.flatnonzero(~self.rigid_contact & np.isfinite(yielding) & self.distinct)
        if len(soft):
            rows = self.rows[soft]
            compliance = self.compliance.among(soft, soft) + np.diag(yielding[soft])
            if self.coupled:
                try:
                    matrix = matrix + rows.T @ linalg.cho_solve((_factored(compliance), True), rows)
                except linalg.LinAlgError:
                    raise SolverError(
                        f"contact {', '.join(self.scene.contact)}: {Result.DEPENDENT_ROWS.value}"
                    ) from None
            else:
                matrix = matrix + rows.T @ (rows / compliance.diagonal()[:, None])
        top = len(matrix) - 1
        return float(np.sqrt(linalg.eigvalsh(matrix, subset_by_index=[top, top])[0]))


def _period(stiffness: np.ndarray) -> float:
    """Return the period of the highest of some frequencies, given by their squares [rad²/s²], 0 where all are zero."""
    top = float(stiffness.max(initial=0.0))
    return 2 * np.pi / np.sqrt(top) if top > 0 else 0.0


def _factored(compliance: np.ndarray) -> np.ndarray:
    """Return the lower Cholesky factor of C; a LinAlgError where a pivot is zero, negative or round-off."""
    lower = linalg.cholesky(compliance, lower=True)
    if (np.diag(lower) ** 2 < DEPENDENT * np.diag(compliance)).any():
        raise linalg.LinAlgError("pivots are round-off")
    return lower


def _single(stiffness: np.ndarray, row: np.ndarray, compliance: float) -> float:
    """Return the root of the largest eigenvalue of Λ + row rowᵀ/C by its secular equation 1 = Σ rowᵢ²/C/(x − λᵢ).

    Newton's method on the inverse of the sum converges from above without overshoot.
    """
    if not compliance > 0:
        raise SolverError(f"contact: {Result.DEPENDENT_ROWS.value}")
    weight = row**2 / compliance
    weight, poles, still = weight[weight > 0], stiffness[weight > 0], float(stiffness.max(initial=0.0))
    if not len(weight):
        return float(np.sqrt(still))
    # A contact that is soft beside the body adds less than a float can tell from the highest pole.
    minimum = float(np.nextafter(poles.max(), np.inf))
    x = max(float(poles.max() + weight.sum()), minimum)
    for _ in range(100):
        pole_distance = x - poles
        total, slope = float((weight / pole_distance).sum()), float((weight / pole_distance**2).sum())
        step = total * (total - 1) / slope
        x = max(x + step, minimum)
        if abs(step) <= 1e-15 * x:
            break
    return float(np.sqrt(max(x, still)))
