"""State and working arrays of the loop over ports at the start of a run."""

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.contact.compliance import Compliance, coupled
from gudgeon.solver.contact.lcp import empty_set
from gudgeon.solver.forces.fields.co_energy import basis_shape
from gudgeon.solver.integrators.small.arrays import SLIPS, Constants, Problem, State
from gudgeon.solver.integrators.small.slides import Slides
from gudgeon.solver.ports.members import contact_ports, function_ports, start_unknowns, surface_weights
from gudgeon.solver.ports.table import Kind, Ports
from gudgeon.solver.system.fields.reading import evaluated
from gudgeon.solver.system.system import System


def state_of(system: System, ports: Ports, constants: Constants) -> State:
    p, m, contacts, joints = len(ports.offset), len(system.velocity), len(system.contacts), len(system.driving.joints)
    paths = len(constants.parts) + len(system.bodies)
    sides, R = len(constants.residual.values), constants.residual.values
    unknown, weights = start_unknowns(system, ports), surface_weights(system, ports, system.position)
    unknown = unknown if weights is None else weights.T @ unknown
    f = np.tile(unknown, (sides, 1)) if sides else np.zeros((0, p))
    response = sum((ports.pairs.matrix(table) @ force for table, force in zip(R, f, strict=True)), np.zeros(p))
    displacement = ports.offset + ports.rows @ system.position + response
    displacement = displacement if weights is None else weights @ displacement
    anchor = displacement.copy()
    for item in system.contacts:
        if system.scene.contact[item.name].friction is not None:
            for b in (1, 2):
                anchor[contact_ports(ports, item) + b] -= system.start_stretch[item.rows, b - 1]
    energies = np.zeros(5)
    stored = 0.5 * float(unknown @ response)
    field, poses = _fields(system, constants, displacement)
    pulled = [displacement[ports.of(f"force.{name}")] for name in system.scene.springs()]
    energies[:3] = (
        0.5 * float(system.velocity @ system.velocity),
        0.5 * float(system.stiffness @ system.position**2) + stored
        + system.springs.energy(np.concatenate([np.empty(0), *pulled])) - float(field[:, 0].sum()),
        system.start_contact_energy - 0.5 * float(system.start_forces @ (system.residual @ system.start_forces)),
    )  # fmt: skip
    pin = system.driving.crank(np.zeros(1))[0]
    listed, forced_ports = np.zeros(p + 1, np.int64), np.flatnonzero(unknown) if sides else np.empty(0, np.int64)
    listed[0], listed[1 : len(forced_ports) + 1] = len(forced_ports), forced_ports
    pushes = np.where((constants.share < 1.0) & (ports.kind != Kind.GIVEN), 0.5 * unknown, 0.0)
    presses = (constants.contact >= 0) | (ports.kind == Kind.SURFACE)
    half = np.stack([np.where(presses, pushes, 0.0), np.where(presses, 0.0, pushes)]) @ ports.rows
    zeros = {name: np.zeros(p) for name in _ZERO_AT_START}
    return State(
        slides=_slides(system, ports), apart=np.zeros(p, np.bool_), beside=_beside(constants, system),
        inside=np.zeros(2),
        q=system.position.copy(), v=system.velocity.copy(), before=np.zeros((2, m)), force=np.zeros(m),
        field=field, field_pose=poses, field_basis=np.zeros(basis_shape(system.fields.energies)),
        field_energy=np.array([-float(field[:, 0].sum()), 0.0]),
        pressed=np.zeros(m), unknown=unknown, held=f, known=np.zeros((sides, p)), half=half, rest=np.zeros((2, m)),
        listed=listed, forced=np.zeros(p + 1, np.int64),
        listed_known=np.zeros(p + 1, np.int64), displacement=np.stack([displacement, displacement]),
        response=np.stack([response, response]), anchor=anchor, sliding=np.zeros(p, np.bool_),
        closed=np.zeros(p, np.bool_), turning=np.full(1, -1), since=np.full(p, -np.inf),
        sudden_impulses=np.zeros((2, p)), kept=np.zeros(p + 1),
        ends=np.zeros((2, m)), loads=np.zeros((2, len(constants.given))),
        fastest=np.zeros(1), average=np.zeros(1), wanted=np.zeros(len(constants.drives)),
        rod=np.zeros((joints, 3)), pin=pin.reshape(joints, 4), travel=np.zeros(paths),
        ahead=np.zeros(paths), lead=np.zeros((2, paths)), clearance=np.zeros(1),
        acting=np.zeros(contacts), struck=np.zeros(contacts, np.bool_), peak=np.zeros((contacts, 2)),
        slips=np.zeros((SLIPS + 1 if contacts else 1, 3)), closing=np.full(p, -1.0),
        stored=np.array([stored]), work=np.zeros(len(system.rigid) + 1), parts=energies,
        rubbed=np.zeros(contacts),
        extreme=np.array([energies.sum(), 0.0, 0.0, 0.0]), counts=np.zeros(6, np.int64), **zeros,
    )  # fmt: skip


def _beside(constants: Constants, system: System) -> np.ndarray:
    """Return which ports are the first of a point beside its face at the start, (p,)."""
    edges, flags = constants.edges, np.zeros(len(constants.offset), np.bool_)
    flags[edges.ports[edges.offset + edges.rows @ system.position < 0]] = True
    return flags


def _fields(system: System, constants: Constants, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what fields do at the start, (f, OUT), and the poses there, (f, 6)."""
    poses = constants.field_start.copy()
    for i, k in np.argwhere(constants.field_loads[:, 0] >= 0):
        near_row, far_row = constants.field_loads[i, :, k]
        poses[i, k] += displacement[constants.given[near_row]]
        poses[i, k] -= displacement[constants.given[far_row]] if far_row >= 0 else 0.0
    return evaluated(system.fields.names, system.fields.energies, poses), poses


_ZERO_AT_START = (
    "last", "mean", "extra", "gap", "measure", "approach", "margin", "sudden", "rate", "shift", "foreseen", "impulses",
    "total", "begun", "swift", "way",
)  # fmt: skip


def problem_of(constants: Constants, slides: Slides) -> Problem:
    p = len(constants.offset)
    window = core.Small.WINDOW
    closes = constants.plain or constants.paired  # Without cones and laws, `active` holds the factor.
    many = 0 if closes else candidates(constants)
    points = p if constants.plain else len(constants.touching) if constants.paired else 0
    return Problem(
        awake=np.full((2, p), constants.divides), ports=np.zeros(p, np.int64),
        candidates=np.zeros(p, np.int64), acting=np.zeros(p, np.bool_), gathered=np.full(p, -1),
        altered=np.zeros(p, np.int64), size=np.zeros(5, np.int64),
        columns=np.zeros((many, many)), active=empty_set(points), runs=np.zeros((p, 2), np.int64),
        matrix=_pairs(constants, slides) if constants.paired else _constant(constants),
        free=np.zeros(p), x=np.zeros(p),
        y=np.zeros(p), start=np.zeros(p),
        weight=np.zeros(p), stiff=np.zeros(p), pushed=np.zeros(p),
        pushing=np.zeros(p), span=np.zeros(2, np.int64), slipped=np.zeros(p, np.bool_),
        derivative=np.zeros((many, many)), correction=np.zeros(p),
        past=np.zeros((3, p)), changes=np.zeros((3, window, p)), products=np.zeros((window, window)),
        gram=np.zeros((window, window + 1)),
    )  # fmt: skip


def _constant(constants: Constants) -> Compliance:
    matrix = coupled(constants.pattern, constants.columns)
    return matrix._replace(candidate=np.ones(len(constants.offset), np.bool_))


def _pairs(constants: Constants, slides: Slides) -> Compliance:
    """Return the compliance of points over traction spaces, no row of which is known."""
    p, first, contact = len(constants.offset), constants.touching, constants.contact[constants.touching]
    numbers, begin, count = np.unique(contact, return_index=True, return_counts=True)
    space, columns = np.zeros((len(numbers), 3), np.int64), constants.columns.reshape(p, p)
    for span, surface in zip(slides.ports, slides.surface, strict=True):
        space[constants.contact[span[0]]] = surface
    return coupled(constants.pattern, np.zeros(p * p))._replace(
        base=columns, master=columns, block=np.stack([first[begin], first[begin] + count], axis=1),
        candidate=np.ones(len(numbers), np.bool_), known=np.ones(len(numbers), np.bool_), space=space,
        across=slides.across, window=np.zeros((len(numbers), 2), np.int64), scratch=np.zeros(p), stamp=np.full(p, -1),
    )  # fmt: skip


def candidates(constants: Constants) -> int:
    """Return the largest number of ports that respond in a step."""
    firsts = np.concatenate([constants.touching, constants.always])
    return int(constants.size[firsts].sum())


def _slides(system: System, ports: Ports) -> Slides:
    """Return what slides over traction spaces, at the start."""
    p, moving = len(ports.offset), [item for item in system.contacts if item.master is not None]
    g, m = len(moving), len(system.velocity)
    slides = Slides(
        ports=np.zeros((g, 2), np.int64), surface=np.zeros((g, 3), np.int64), window=np.zeros((g, 2), np.int64),
        functions=np.flatnonzero(ports.kind == Kind.SURFACE),
        row=np.zeros((g, m)), chart=np.zeros((g, 2)), sigma=np.full((3, g), np.inf), drag=np.zeros(g),
        drag_impulse=np.zeros(g), over=np.zeros(p, np.bool_), width=np.zeros(p, np.int64), height=np.zeros(p),
        start=np.full(p, -1), across=np.zeros((p, 4)), corner=np.full((2, p), -1), along=np.zeros((2, 4, p)),
        free=np.zeros(p), inward=np.zeros((2, p)), left=np.zeros(1, np.int64),
    )  # fmt: skip
    for i, item in enumerate(moving):
        span, normals, functions, surface = (
            ports.of(f"contact.{item.name}"), contact_ports(ports, item), function_ports(ports, item), item.master
        )  # fmt: skip
        assert surface is not None
        width = len(functions) * surface.counts[0]
        slides.ports[i] = span.start, span.stop
        slides.surface[i] = functions[0, 0], width, surface.counts[1]
        slides.chart[i], slides.width[span], slides.over[span] = surface.chart, width, True
        for axis, function_row in enumerate(functions):
            slides.height[normals + axis], slides.across[normals + axis] = surface.height, surface.across
            slides.start[normals + axis] = np.where(surface.place >= 0, function_row[0] + surface.place, -1)
        for name, sign in ((item.body, 1.0), (surface.body, -1.0)):
            body, start = system.bodies[name], system.offsets[name]
            centre = body.morph.centre[None]
            along = sign * body.rigid_rows(centre, surface.direction[None])[0]
            slides.row[i, start : start + body.rigid_count] += along
        slides.sigma[:2, i] = slides.row[i] @ system.position
        core.weigh(
            slides.height[span], float(slides.sigma[0, i]), slides.start[span],
            np.array([*surface.chart, surface.counts[1] - 4.0]), width, slides.corner[0, span],
            [slides.along[0, b, span] for b in range(4)],
        )  # fmt: skip
    slides.corner[1], slides.along[1] = slides.corner[0], slides.along[0]
    return slides
