"""A scene compiled against its records: the arrays of the time loop, and nothing that the scene does not need."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from modaldb.store import Store
from solver.body import FlexibleBody, load_body
from solver.contacts import ContactRows, contact_block, sliding_block
from solver.driving import Driving, compile_driving
from solver.errors import SceneError, SolverError
from solver.fittings import Springs, compile_gauges, compile_springs, sides_of
from solver.result import Result
from solver.scene import Scene, carriers
from solver.terms import Stock, Term, fields_read, scene_terms

DEPENDENT = 1e-13
"""Pivot of a point's compliance, relative to it, at which the point depends on others."""
FEW_POINTS = 8
"""Contact points up to which `auto` takes located events where it can."""
STEP_FACTOR = 0.2
"""Largest dt·ω_c: at 0.2 the energy drift of the skirt is 1e-4, at 2 energy grows without bound."""


@dataclass(frozen=True)
class System:
    """All coordinates of all bodies, all rows of all contacts. Shapes: m coordinates, c rows, F functions."""

    scene: Scene
    bodies: dict[str, FlexibleBody]
    offsets: dict[str, int]
    contacts: list[ContactRows]
    stiffness: np.ndarray
    """ω² [rad²/s²], (m,)."""
    damping: np.ndarray
    """β of each coordinate's body [s], (m,)."""
    rigid: np.ndarray
    """Numbers of the rigid coordinates."""
    rows: np.ndarray
    """∂g/∂q [kg^-½], (c, m)."""
    gap: np.ndarray
    """Gaps at q = 0 [m], (c,)."""
    residual: np.ndarray
    """R [m/N], (c, c)."""
    layer: np.ndarray
    """Compliance of the surface layer [m/N], (c,)."""
    dashpot: np.ndarray
    """[N s/m], (c,)."""
    functions: np.ndarray
    """Inward displacement of traction spaces, ∂e/∂q, (F, m)."""
    function_residual: np.ndarray
    """R of the traction spaces [m/N], (F, F)."""
    restitution: np.ndarray
    """Of rigid contact; −1 where contact is compliant, (c,)."""
    law: np.ndarray
    """K, n, χ, c of the law at each row, (c, 4)."""
    tangents: np.ndarray
    """Displacement along the line of friction, (c, m)."""
    friction: np.ndarray
    """Static and kinetic coefficient, (c, 2)."""
    belt: np.ndarray
    """Velocity of the obstacle along the line [m/s], (c,)."""
    springs: Springs
    gauges: list[str]
    """`body.gauge` of each gauge value."""
    gauge_rows: np.ndarray
    """(G, m)"""
    gauge_residual: np.ndarray
    """Quasi-static value per contact force, (G, c)."""
    driving: Driving
    loads: np.ndarray
    """Loads and joint forces at the start, (L,)."""
    position: np.ndarray
    """Initial coordinates [m kg^½], (m,)."""
    velocity: np.ndarray
    """Initial velocities [m kg^½/s], (m,)."""
    terms: list[Term]

    @property
    def resolution(self) -> float:
        """Period of the highest kept frequency [s]; 0 where nothing is elastic."""
        top = float(self.stiffness.max(initial=0.0))
        return 2 * np.pi / np.sqrt(top) if top > 0 else 0.0

    @property
    def rigid_contact(self) -> np.ndarray:
        """Which rows have no compliance at all, (c,)."""
        return self.restitution >= 0

    @property
    def compliance(self) -> np.ndarray:
        """R + surface layer [m/N], (c, c)."""
        return self.residual + np.diag(self.layer)

    @property
    def coupled(self) -> bool:
        """Whether a contact force at one point closes or opens another through R."""
        return bool(np.any(self.residual - np.diag(self.residual.diagonal())))

    def _yielding(self) -> np.ndarray:
        """Return the compliance of each nonlinear law at the deepest that its start's energy can press it [m/N], (c,).

        Gravity aside: the kinetic energy of a mass that a row sees, at the greatest speed that it can have.
        """
        found = np.zeros(len(self.gap))
        for row in np.flatnonzero((self.law[:, 0] > 0) & (self.layer == 0)):
            stiffness, exponent = self.law[row, :2]
            square = float(self.rows[row] @ self.rows[row])
            speed = float(np.linalg.norm(self.velocity)) * np.sqrt(square)
            fall = 2 * float(np.abs(self.rows[row]) @ np.abs(self.driving.gravity)) * max(float(self.gap[row]), 0.0)
            energy = 0.5 * (speed**2 + fall) / square
            deepest = ((exponent + 1) * energy / stiffness) ** (1 / (exponent + 1))
            found[row] = 1 / (exponent * stiffness * deepest ** (exponent - 1)) if deepest > 0 else np.inf
        return found

    def critical_frequency(self) -> float:
        """Return ω_c [rad/s]: ω_c² = λmax(Λ + rowsᵀ C⁻¹ rows), all contacts closed, other bodies' surfaces rigid.

        Raises:
            SolverError: C is singular.
        """
        springs = self.springs
        if len(self.gap) == 1 and not len(springs.stiffness):
            return _single(self.stiffness, self.rows[0], self.compliance[0, 0] + self._yielding()[0])
        matrix = np.diag(self.stiffness) + springs.rows.T @ (springs.rows * springs.stiffness[:, None])
        if len(self.gap):
            compliance = self.compliance
            if self.coupled:
                try:
                    matrix = matrix + self.rows.T @ linalg.cho_solve((_factored(compliance), True), self.rows)
                except linalg.LinAlgError:
                    raise SolverError(
                        f"contact {', '.join(self.scene.contact)}: {Result.DEPENDENT_ROWS.value}"
                    ) from None
            else:
                matrix = matrix + self.rows.T @ (self.rows / (compliance.diagonal() + self._yielding())[:, None])
        top = len(matrix) - 1
        return float(np.sqrt(linalg.eigvalsh(matrix, subset_by_index=[top, top])[0]))


def _factored(compliance: np.ndarray) -> np.ndarray:
    """Return the Cholesky factor of C, lower.

    Raises:
        LinAlgError: C is singular, or so near to it that its pivots are round-off.
    """
    lower = linalg.cholesky(compliance, lower=True)
    if (np.diag(lower) ** 2 < DEPENDENT * np.diag(compliance)).any():
        raise linalg.LinAlgError("pivots are round-off")
    return lower


def _single(stiffness: np.ndarray, row: np.ndarray, compliance: float) -> float:
    """Return the root of the largest eigenvalue of Λ + row rowᵀ/C by its secular equation 1 = Σ rowᵢ²/C/(x − λᵢ).

    Newton on the inverse of the sum converges from above without overshoot.

    Raises:
        SolverError: C is not positive.
    """
    if not compliance > 0:
        raise SolverError(f"contact: {Result.DEPENDENT_ROWS.value}")
    weight = row**2 / compliance
    weight, poles, still = weight[weight > 0], stiffness[weight > 0], float(stiffness.max(initial=0.0))
    if not len(weight):
        return float(np.sqrt(still))
    x = float(poles.max() + weight.sum())
    for _ in range(100):
        apart = x - poles
        total, slope = float((weight / apart).sum()), float((weight / apart**2).sum())
        step = total * (total - 1) / slope
        x += step
        if abs(step) <= 1e-15 * x:
            break
    return float(np.sqrt(max(x, still)))


def compile_system(store: Store, scene: Scene, morphs: Mapping[str, str]) -> System:
    """Read what the scene needs and build its system.

    Args:
        morphs: Key of each component's MorphRecord.

    Raises:
        SceneError: an interface or the residual flexibility is missing, or an obstacle does not face its surface.
    """
    keys = {name: morphs[scene.component_of(name)] for name in scene.body}
    asked = scene_terms(scene)  # Of a design that is the same whatever its modes hold.
    designs = {name: store.get(key, "morph", only=fields_read(asked, name, "morph")) for name, key in keys.items()}
    terms = scene_terms(scene, {name: _stock(store, morph.modes_key) for name, morph in designs.items()})
    bodies, offsets, size = {}, {}, 0
    for name, settings in scene.body.items():
        fields = fields_read(terms, name, "modes")
        bodies[name] = load_body(store, name, settings, keys[name], designs[name], fields)
        offsets[name] = size
        size += len(bodies[name].stiffness)
    if not size:
        raise SceneError("body: no body can move, supports and freedom hold all of them; leave a motion free")
    contacts, arrays = _contacts(scene, bodies, offsets, size)
    scene = _settled(scene, len(arrays["gap"]))
    stiffness = np.concatenate([body.stiffness for body in bodies.values()])
    damping = np.concatenate([np.full(len(body.stiffness), body.stiffness_factor) for body in bodies.values()])
    rigid = np.concatenate([offsets[name] + np.arange(body.rigid_count) for name, body in bodies.items()])
    driving = compile_driving(scene, bodies, offsets, contacts, size)
    position, velocity = _start(scene, bodies, offsets, size)
    loads = driving.begin(bodies, offsets, position, velocity)
    _check_travel(contacts, driving)
    return System(
        scene=scene, bodies=bodies, offsets=offsets, contacts=contacts, stiffness=stiffness, damping=damping,
        rigid=rigid.astype(int), driving=driving, springs=compile_springs(scene, bodies, offsets, size),
        loads=loads, position=position, velocity=velocity, terms=terms, **arrays,
        **compile_gauges(bodies, offsets, contacts, size),
    )  # fmt: skip


def _stock(store: Store, modes_key: str) -> Stock:
    """Return what the modes of a component hold; of their arrays the sizes alone are looked at."""
    # Where there are none, reading them says what is wrong.
    return Stock.of(store.sizes(modes_key)) if store.has(modes_key) else Stock()


def _settled(scene: Scene, points: int) -> Scene:
    """Return a scene whose automatic integrator suits its number of contact points.

    Exact motion between located events is the better one while they are few.
    """
    implicit = scene.run.integrator == "auto" and scene.integrator == "trapezoid"
    if implicit and points <= FEW_POINTS and "event" in carriers(scene):
        return scene.model_copy(update={"run": scene.run.model_copy(update={"integrator": "event"})})
    return scene


def _check_travel(contacts: list[ContactRows], driving: Driving) -> None:
    """Refuse a crank that carries points beyond the traction space that they slide over."""
    for contact in contacts:
        held = next((item for item in driving.joints if item.body == contact.body), None)
        if held is None or (over := contact.master) is None:
            continue
        turn = np.linspace(0.0, 2 * np.pi / held.joint.rate, 721)
        along, _ = held.joint.axes
        way = (held.joint.piston_pin(turn, held.anchor[0])[:, 0] - held.anchor[1]) * float(over.direction @ along)
        low, high = over.height.min() + way.min(), over.height.max() + way.max()
        start, end = over.chart[0], over.chart[0] + over.chart[1] * (over.counts[1] - 3)
        if low < start - 1e-9 or high > end + 1e-9:
            raise SceneError(
                f"contact.{contact.name}: its points travel from {low:.4g} to {high:.4g} m along '{over.interface}',"
                f" which reaches from {start:.4g} to {end:.4g} m; give a longer surface or a shorter stroke"
            )


def _start(
    scene: Scene, bodies: dict[str, FlexibleBody], offsets: dict[str, int], size: int
) -> tuple[np.ndarray, np.ndarray]:
    velocity = np.zeros(size)
    for name, body in bodies.items():
        start = scene.body[name]
        columns = offsets[name] + np.arange(body.rigid_count)
        wanted = np.array([*start.velocity, *start.angular_velocity])
        velocity[columns] = body.rigid_velocity(wanted[:3], wanted[3:])
        lacking = np.abs(body.centre_motion(velocity[columns]) - wanted).reshape(2, 3).max(axis=1)
        for key, missed, part in zip(("velocity", "angular_velocity"), lacking, wanted.reshape(2, 3), strict=True):
            if missed > 1e-6 * np.abs(part).max():
                raise SceneError(
                    f"body.{name}.{key}: {part.tolist()} given, its freedom, supports or inertia do not let it move so"
                )
    return np.zeros(size), velocity


def _contacts(
    scene: Scene, bodies: dict[str, FlexibleBody], offsets: dict[str, int], size: int
) -> tuple[list[ContactRows], dict[str, np.ndarray]]:
    """Put all contacts' blocks into arrays over all coordinates."""
    masters, others = scene.masters(), scene.others()
    blocks = [
        contact_block(scene, name, bodies[contact.body], bodies[others[name].body] if name in others else None)
        for name, contact in scene.contact.items()
    ]
    slides = [
        sliding_block(scene, b.name, b, bodies[masters[b.name].body]) if b.name in masters else None for b in blocks
    ]
    ends = np.cumsum([0, *(len(block.gap) for block in blocks)])
    ends_f = np.cumsum([0, *(len(slide.rows) if slide else 0 for slide in slides)])
    rows, residual = np.zeros((ends[-1], size)), np.zeros((ends[-1], ends[-1]))
    tangents = np.zeros((ends[-1], size))
    functions, function_residual = np.zeros((ends_f[-1], size)), np.zeros((ends_f[-1], ends_f[-1]))
    contacts = []
    for number, (block, slide) in enumerate(zip(blocks, slides, strict=True)):
        here, there = (
            slice(int(ends[number]), int(ends[number + 1])),
            slice(int(ends_f[number]), int(ends_f[number + 1])),
        )
        _put(rows, here, offsets[block.body], block.rows)
        _put(tangents, here, offsets[block.body], block.surface.tangents)
        if (other := block.other) is not None:
            _put(rows, here, offsets[other.body], other.rows)
            _put(tangents, here, offsets[other.body], other.tangents)
        residual[here, here] = block.residual
        if slide is not None:
            _put(functions, there, offsets[slide.body], slide.rows)
            function_residual[there, there] = slide.residual
        contacts.append(
            ContactRows(
                block.name, block.body, block.interface, here, block.points, block.directions, block.areas, block.edge,
                slide, block.other, there,
            )
        )  # fmt: skip
    _couple(scene, bodies, contacts, residual, function_residual)
    joined = {name: np.concatenate([np.empty(0), *(getattr(block, name) for block in blocks)]) for name in _PER_ROW}
    for name, empty in _PER_SURFACE.items():
        joined[name] = np.concatenate([empty, *(getattr(block.surface, name) for block in blocks)])
    return contacts, joined | {
        "rows": rows, "residual": residual, "functions": functions, "function_residual": function_residual,
        "tangents": tangents,
    }  # fmt: skip


_PER_ROW = ("gap", "layer", "dashpot")
_PER_SURFACE = {"restitution": np.empty(0), "law": np.empty((0, 4)), "friction": np.empty((0, 2)), "belt": np.empty(0)}


def _put(target: np.ndarray, rows: slice, first: int, block: np.ndarray) -> None:
    target[rows, first : first + block.shape[1]] = block


def _couple(
    scene: Scene,
    bodies: dict[str, FlexibleBody],
    contacts: list[ContactRows],
    residual: np.ndarray,
    function_residual: np.ndarray,
) -> None:
    """Fill in R between two interfaces of one body."""
    for one in contacts:
        for other in contacts:
            both = {scene.contact[one.name].method, scene.contact[other.name].method}
            if one is other or both != {"residual"}:
                continue
            for body, interface, order in sides_of(one):
                for same, at, places in sides_of(other):
                    if body == same:
                        block = bodies[body].residual(interface, at)
                        residual[one.rows, other.rows] += block[np.ix_(order, places)]
            if one.master is not None and other.master is not None and one.master.body == other.master.body:
                block = bodies[one.master.body].residual(one.master.interface, other.master.interface)
                ordered = block[np.ix_(one.master.order, other.master.order)]
                function_residual[one.functions, other.functions] = ordered
