"""A scene compiled against its records: the arrays of the time loop, and nothing that the scene does not need."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from modaldb.store import Store
from solver.body import FlexibleBody, load_body
from solver.errors import SceneError, SolverError
from solver.result import Result
from solver.scene import Contact, Scene
from solver.terms import Term, fields_read, scene_terms

FACING = 0.99
"""Cosine between a surface's normal and the line to its obstacle, below which rows along the normal mislead."""
STEP_FACTOR = 0.2
"""Largest dt·ω_c: at 0.2 the energy drift of the skirt is 1e-4, at 2 energy grows without bound."""


@dataclass(frozen=True)
class ContactRows:
    """One contact's rows in the system."""

    name: str
    body: str
    interface: str
    rows: slice
    points: np.ndarray
    """[m], (c, 3), in the body's design position."""
    directions: np.ndarray
    """Direction of the force on the body, (c, 3)."""
    areas: np.ndarray | None
    edge: np.ndarray


@dataclass(frozen=True)
class System:
    """All coordinates of all bodies, all rows of all contacts. Shapes: m coordinates, c rows."""

    scene: Scene
    bodies: dict[str, FlexibleBody]
    offsets: dict[str, int]
    contacts: list[ContactRows]
    stiffness: np.ndarray
    """ω² [rad²/s²], (m,)."""
    rigid: np.ndarray
    """Numbers of the rigid coordinates."""
    rows: np.ndarray
    """∂g/∂q [kg^-½], (c, m)."""
    gap: np.ndarray
    """Gaps at the start [m], (c,)."""
    compliance: np.ndarray
    """R + surface layer [m/N], (c, c)."""
    dashpot: np.ndarray
    """[N s/m], (c,)."""
    velocity: np.ndarray
    """Initial velocities [m kg^½/s], (m,)."""
    terms: list[Term]

    @property
    def coupled(self) -> bool:
        """Whether a contact force at one point closes or opens another through R."""
        return bool(np.any(self.compliance - np.diag(self.compliance.diagonal())))

    def critical_frequency(self) -> float:
        """Return ω_c [rad/s]: ω_c² = λmax(Λ + rowsᵀ C⁻¹ rows), all contacts closed.

        Raises:
            SolverError: C is singular.
        """
        matrix = np.diag(self.stiffness)
        if len(self.gap):
            if self.coupled:
                try:
                    matrix = matrix + self.rows.T @ linalg.cho_solve(linalg.cho_factor(self.compliance), self.rows)
                except linalg.LinAlgError:
                    raise SolverError(
                        f"contact {', '.join(self.scene.contact)}: {Result.DEPENDENT_ROWS.value}"
                    ) from None
            else:
                matrix = matrix + self.rows.T @ (self.rows / self.compliance.diagonal()[:, None])
        top = len(matrix) - 1
        return float(np.sqrt(linalg.eigvalsh(matrix, subset_by_index=[top, top])[0]))


def compile_system(store: Store, scene: Scene, morphs: Mapping[str, str]) -> System:
    """Read what the scene needs and build its system.

    Args:
        morphs: Key of each component's MorphRecord.

    Raises:
        SceneError: an interface or the residual flexibility is missing, or an obstacle does not face its surface.
    """
    terms = scene_terms(scene)
    bodies, offsets, size = {}, {}, 0
    for name in scene.body:
        key = morphs[scene.component_of(name)]
        bodies[name] = load_body(store, name, key, fields_read(terms, name, "morph"), fields_read(terms, name, "modes"))
        offsets[name] = size
        size += len(bodies[name].stiffness)
    blocks = [_contact_rows(scene, name, bodies[contact.body]) for name, contact in scene.contact.items()]
    counts = np.cumsum([0, *(len(block.gap) for block in blocks)])
    rows, compliance = np.zeros((counts[-1], size)), np.zeros((counts[-1], counts[-1]))
    contacts = []
    for block, start, stop in zip(blocks, counts, counts[1:], strict=False):
        here, first = slice(int(start), int(stop)), offsets[block.body]
        rows[here, first : first + block.rows.shape[1]] = block.rows
        compliance[here, here] = block.compliance
        contacts.append(
            ContactRows(
                block.name, block.body, block.interface, here, block.points, block.directions, block.areas, block.edge
            )
        )
    _couple(scene, bodies, contacts, compliance)
    velocity, rigid = np.zeros(size), []
    for name, body in bodies.items():
        start = scene.body[name]
        columns = offsets[name] + np.arange(body.rigid_count)
        velocity[columns] = body.rigid_velocity(np.asarray(start.velocity), np.asarray(start.angular_velocity))
        rigid.append(columns)
    return System(
        scene,
        bodies,
        offsets,
        contacts,
        np.concatenate([body.stiffness for body in bodies.values()]),
        np.concatenate(rigid),
        rows,
        np.concatenate([np.empty(0), *(block.gap for block in blocks)]),
        compliance,
        np.concatenate([np.empty(0), *(block.dashpot for block in blocks)]),
        velocity,
        terms,
    )


@dataclass(frozen=True)
class _Block:
    name: str
    body: str
    interface: str
    rows: np.ndarray
    gap: np.ndarray
    compliance: np.ndarray
    dashpot: np.ndarray
    points: np.ndarray
    directions: np.ndarray
    areas: np.ndarray | None
    edge: np.ndarray


def _contact_rows(scene: Scene, name: str, body: FlexibleBody) -> _Block:
    contact = scene.contact[name]
    if contact.interface not in body.modal.interface_rows:
        have = ", ".join(sorted(body.modal.interface_rows)) or "none"
        raise SceneError(f"contact.{name}.interface: body '{body.name}' has no '{contact.interface}', it has {have}")
    interface = body.modal.interfaces[contact.interface]
    points = body.morph.points[contact.interface]
    placed = points + np.asarray(scene.body[body.name].position)
    directions = contact.against.direction(placed)
    if np.einsum("ci,ci->c", directions, -interface.normals).min() < FACING:
        raise SceneError(f"contact.{name}.against: the obstacle does not face interface '{contact.interface}'")
    gap = contact.against.gap(placed)
    if gap.min() < 0:
        raise SceneError(
            f"contact.{name}: {int((gap < 0).sum())} of {len(gap)} points start inside the obstacle, the worst by"
            f" {-gap.min():.3g} m; move body.{body.name}.position or widen contact.{name}.against"
        )
    rows = np.column_stack([body.rigid_rows(points, directions), -interface.rows])
    areas = interface.areas if contact.surface_stiffness is not None else None
    compliance = _compliance(contact, name, body, areas, len(gap))
    return _Block(
        name, body.name, contact.interface, rows, gap, compliance,
        _dashpot(contact, name, body, compliance), points, directions, areas, interface.edge,
    )  # fmt: skip


def _compliance(contact: Contact, name: str, body: FlexibleBody, areas: np.ndarray | None, count: int) -> np.ndarray:
    compliance = np.zeros((count, count))
    if contact.method == "residual":
        if body.modal.residual_flexibility is None:
            raise SceneError(
                f"contact.{name}.method: 'residual' needs a recipe that stores R, component"
                f" '{body.name}' was reduced by '{body.modal.recipe}'"
            )
        compliance += body.residual_block(contact.interface)
    if contact.surface_stiffness is not None and areas is not None:
        compliance += np.diag(1.0 / (contact.surface_stiffness * areas))
    return compliance


def _dashpot(contact: Contact, name: str, body: FlexibleBody, compliance: np.ndarray) -> np.ndarray:
    """Impedance of the truncated waves: d = (2/π)/(R ω_N), which is ρcA on a uniform bar."""
    if contact.dashpot == "none":
        return np.zeros(len(compliance))
    if len(compliance) > 1:
        raise SceneError(f"contact.{name}.dashpot: 'wave-guide' is for single-point contacts on bars, not surfaces")
    return np.array([2 / np.pi / (compliance[0, 0] * body.modal.angular_frequencies.max())])


def _couple(scene: Scene, bodies: dict[str, FlexibleBody], contacts: list[ContactRows], compliance: np.ndarray) -> None:
    """Fill in R between two interfaces of one body."""
    for one in contacts:
        for other in contacts:
            both = {scene.contact[one.name].method, scene.contact[other.name].method}
            if one is other or one.body != other.body or both != {"residual"}:
                continue
            modal = bodies[one.body].modal
            assert modal.residual_flexibility is not None
            here, there = slice(*modal.interface_rows[one.interface]), slice(*modal.interface_rows[other.interface])
            compliance[one.rows, other.rows] = modal.residual_flexibility[here, there]
