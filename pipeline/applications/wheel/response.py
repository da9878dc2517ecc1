"""The records of a wheel: modes of every harmonic, and the response of the tuned and the mistuned wheel."""

from time import process_time

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.cyclic import CyclicRecord, WheelRecord
from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.applications.wheel.case import Case, Modes
from gudgeon.pipeline.applications.wheel.cyclic.forced import (
    direct_response,
    engine_order_response,
    modal_compliance,
)
from gudgeon.pipeline.applications.wheel.cyclic.harmonic import harmonic_modes, tuned_frequencies
from gudgeon.pipeline.applications.wheel.cyclic.hermitian import lowest_pairs
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector, cyclic_sector
from gudgeon.pipeline.applications.wheel.cyclic.static import static_response
from gudgeon.pipeline.applications.wheel.cyclic.synthesis import InterfaceChoice, SectorParts, synthesise
from gudgeon.pipeline.applications.wheel.cyclic.whole_wheel import (
    part_stiffness,
    wheel_motion,
    wheel_problem,
)
from gudgeon.pipeline.applications.wheel.estimates import truncation_estimates, with_mesh_errors
from gudgeon.pipeline.applications.wheel.scene import KeptInterface, Wheel, blade_radius, reduction
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.cells import cell_centres, cell_of
from gudgeon.pipeline.interfaces.points import surface_weights
from gudgeon.pipeline.interfaces.tie import refuse_rigid
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver.vectors import length_across, unit


def sector_of(mesh: MeshRecord, component: Component, wheel: Wheel, name: str) -> Sector:
    """Assemble a sector and couple its faces.

    Raises:
        InputError: see `build_model` and `cyclic_sector`; or the sector is not a solid.
    """
    key = f"component.{wheel.component}"
    if not cell_of(mesh).solid:
        raise InputError(f"{key}.geometry: '{component.geometry.kind}' given; a wheel needs a solid sector")
    refuse_rigid(component.interface, mesh, key, "a wheel")
    if has := [*mesh.attachments, *mesh.relations]:
        raise InputError(f"{key}.geometry: its deck has {', '.join(has)}, a wheel has no point masses and springs;"
                         " geometry.leave_out leaves them out")  # fmt: skip
    model = build_model(mesh, component.material, component.supports, key, component.geometry)
    return cyclic_sector(model, wheel, f"wheel.{name}")


def case_of(mesh: MeshRecord, component: Component, wheel: Wheel, name: str, changes: np.ndarray) -> Case:
    """Return a wheel ready to be solved.

    Raises:
        InputError: see `sector_of`; or no cell or every cell is a blade's, or the surface of the force does not exist.
    """
    sector, key = sector_of(mesh, component, wheel, name), f"wheel.{name}"
    arms = cell_centres(mesh) - np.array(wheel.origin)
    radii = length_across(arms, unit(wheel.axis))
    limit = blade_radius(wheel, component)
    assert limit is not None
    assert component.material is not None
    if not radii.min() < limit < radii.max():
        raise InputError(
            f"{key}.blade_radius: {limit:g} m given; it must separate the cells, whose centres are {radii.min():.4g}"
            f" to {radii.max():.4g} m from the axis"
        )
    surface = wheel.response.surface
    if surface not in mesh.surfaces:
        raise InputError(f"{key}.response.surface: the mesh has no surface '{surface}'; it has {_names(mesh)}")
    nodes, shares, _ = surface_weights(mesh, mesh.surfaces[surface])
    along = unit(wheel.response.direction)
    weights = np.zeros((1, 3 * len(mesh.nodes)))
    weights[0, (3 * nodes[:, None] + np.arange(3)).ravel()] = np.outer(shares / shares.sum(), along).ravel()
    row = sector.model.on_dofs(sparse.csr_matrix(weights)).toarray().ravel()
    K_blade = part_stiffness(sector.model, component.material, radii > limit)
    return Case(name, wheel, sector, K_blade, row, np.asarray(changes))


def cyclic_record(
    sector: Sector, mesh_key: str, component: Component, wheel: Wheel, name: str, tell: Progress
) -> CyclicRecord:
    """Compute the modes of every harmonic, each with its residual, the estimated error of the mesh, and a check by
    inertia that none is missed.

    Raises:
        InputError: there are fewer modes.
        StageError: a mode was missed, or is not exact enough.
    """
    modes, harmonics = {}, sector.symmetry.harmonics()
    elastic_count = sector.own.shape[1] - sector.model.rigid_modes.shape[1]
    if wheel.mode_count > elastic_count:
        raise InputError(
            f"wheel.{name}.mode_count: {wheel.mode_count} given; a harmonic has {elastic_count} elastic modes"
        )
    for harmonic in harmonics:
        tell("modes", harmonic / len(harmonics))
        try:
            modes[str(harmonic)] = with_mesh_errors(
                harmonic_modes(sector, harmonic, wheel.mode_count), sector, component
            )
        except StageError as error:
            raise StageError(f"wheel.{name}: harmonic {harmonic}: {error}") from error
    dof_count, face = sector.own.shape[1], len(sector.face)
    quality = {"sector_dofs": dof_count, "face_dofs": face, "wheel_dofs": wheel.sectors * dof_count}
    return CyclicRecord(mesh_key, wheel.sectors, unit(wheel.axis), np.array(wheel.origin), modes, quality)


def kept_dofs(sector: Sector, choice: KeptInterface, key: str) -> InterfaceChoice:
    """Return a choice of kept interface, with key `key` in the scene, as dofs of the sector's low face.

    Raises:
        InputError: a surface does not exist or has no node on the low face, or there are fewer interface modes.
    """
    if choice.kept == "all":
        return InterfaceChoice(np.ones(len(sector.face), bool), 0)
    mesh, nodes = sector.model.mesh, sector.face_dofs // len(sector.model.directions)
    on_surfaces = np.zeros(len(nodes), bool)
    for surface in choice.kept:
        if surface not in mesh.surfaces:
            raise InputError(f"{key}.kept: the mesh has no surface '{surface}'; it has {_names(mesh)}")
        on = np.isin(nodes, mesh.surfaces[surface].facets)
        if not on.any():
            raise InputError(f"{key}.kept: '{surface}' has no free node on '{sector.symmetry.low}'")
        on_surfaces |= on
    remaining = len(on_surfaces) - int(on_surfaces.sum())
    if choice.interface_count is not None and choice.interface_count > remaining:
        raise InputError(
            f"{key}.interface_count: {choice.interface_count} given; a face has {remaining} dofs that are not kept"
        )
    return InterfaceChoice(on_surfaces, choice.interface_count)


def full_modes(case: Case, mistuned: bool) -> Modes:
    """Return the lowest modes of the whole wheel with all its dofs.

    Raises:
        StageError: there are fewer modes, one was missed, or one is not exact enough.
    """
    start = process_time()
    problem = wheel_problem(case.sector, case.mistuning(mistuned))
    pairs = lowest_pairs(problem, case.wheel.count)
    counts = {
        "coordinates": problem.K.shape[0], "kept": len(case.sector.face), "interface_modes": 0,
        "cpu_modes": process_time() - start,
    }  # fmt: skip
    return Modes(np.sqrt(pairs.values), wheel_motion(case.sector, case.row[None]) @ pairs.vectors, counts)


def reduced_modes(case: Case, reduced_sector: SectorParts, choice: InterfaceChoice, mistuned: bool) -> Modes:
    """Return the lowest modes of the reduced wheel; their CPU time does not include the sector's own reduction.

    Raises:
        InputError, StageError: see `synthesise`.
    """
    synthesis = synthesise(reduced_sector, choice, case.wheel.count, case.mistuning(mistuned), f"wheel.{case.name}")
    blades = np.einsum("c,ncm->nm", case.row @ reduced_sector.basis, synthesis.motion)
    counts = {
        "coordinates": synthesis.size, "kept": synthesis.kept, "interface_modes": synthesis.interface_modes,
        "cpu_modes": synthesis.cpu_seconds,
    }  # fmt: skip
    return Modes(synthesis.angular_frequencies, blades, counts)


def reduction_error(tuned: CyclicRecord, frequencies: np.ndarray) -> float:
    """Return the largest relative difference of a tuned wheel's lowest frequencies [rad/s], (count,), from those of the
    harmonics, up to the highest frequency that all harmonics reach."""
    exact = tuned_frequencies(list(tuned.harmonics.values()))
    count = min(len(exact), len(frequencies))
    return float(np.abs(frequencies[:count] / exact[:count] - 1).max())


def wheel_record(
    case: Case, modes_key: str, interface: KeptInterface | None, pair: tuple[Modes, Modes], cpu_sector: float
) -> WheelRecord:
    """Return the response of the tuned and the mistuned wheel from the `pair` of their modes.

    `interface` is None for the full wheel; `cpu_sector` is the CPU time of the sector's own reduction [s].

    Raises:
        InputError: the highest mode is below the end of the band.
    """
    wheel, response, mistuned_modes = case.wheel, case.wheel.response, pair[1]
    highest = min(m.angular_frequencies[-1] for m in pair) / (2 * np.pi)
    if response.band[1] > highest:
        raise InputError(
            f"wheel.{case.name}.count: {wheel.count} given; the highest of these modes is at {highest:.6g} Hz, below"
            f" the end of response.band, {response.band[1]:g} Hz; increase count"
        )
    static = static_response(case.sector, case.row, response.engine_order)
    lacking = [static - modal_compliance(m.blades, m.angular_frequencies, response.engine_order) for m in pair]
    (tuned, _), (mistuned, seconds) = (_respond(case, m, lacking[0]) for m in pair)
    point, blade = np.unravel_index(int(np.abs(mistuned).argmax()), mistuned.shape)
    low, high = (float(np.abs(m).max()) for m in (tuned, mistuned))
    quantities = {
        "magnification": (high / low, "1"),
        "amplitude.tuned": (low, "m/N"),
        "amplitude.mistuned": (high, "m/N"),
        "amplitude.mistuned.at": (float(response.excitation[point] / (2 * np.pi)), "Hz"),
        "amplitude.mistuned.blade": (float(blade), "1"),
    }
    return WheelRecord(
        modes_key=modes_key,
        model={} if interface is None else reduction(wheel, interface),
        engine_order=response.engine_order,
        loss_factor=response.loss_factor,
        stiffness_changes=case.changes,
        tuned_frequencies=pair[0].angular_frequencies,
        mistuned_frequencies=mistuned_modes.angular_frequencies,
        blades=mistuned_modes.blades,
        excitation=response.excitation,
        tuned=_parts(tuned),
        mistuned=_parts(mistuned),
        quantities={key: {"value": value, "unit": unit} for key, (value, unit) in quantities.items()},
        counts=mistuned_modes.counts
        | {"cpu_sector": cpu_sector, "cpu_response": seconds}
        | {"estimates": truncation_estimates(case, pair, (tuned, mistuned), lacking[0])},
    )


def truncation_error(case: Case, record: WheelRecord) -> float:
    """Return the relative error of the blades' amplitudes at the largest of them, against a direct solution."""
    blades, response = amplitudes(record.mistuned), case.wheel.response
    point = int(np.abs(blades).max(axis=1).argmax())
    problem, rows = wheel_problem(case.sector, case.mistuning(True)), wheel_motion(case.sector, case.row[None])
    sectors = case.wheel.sectors
    load = rows.T @ np.exp(2j * np.pi * response.engine_order * np.arange(sectors) / sectors)
    exact = rows @ direct_response(problem, load, response.loss_factor, float(response.excitation[point]))
    return float(np.abs(blades[point] - exact).max() / np.abs(exact).max())


def amplitudes(values: np.ndarray) -> np.ndarray:
    """Return the complex numbers (…) of a record's real and imaginary parts (…, 2)."""
    return values[..., 0] + 1j * values[..., 1]


def _respond(case: Case, modes: Modes, lacking: float) -> tuple[np.ndarray, float]:
    """Return the blades' complex amplitudes [m/N], (points, N), with the static displacement that modes lack [m/N], and
    the CPU time for them [s]."""
    start, response = process_time(), case.wheel.response
    amplitudes_ = engine_order_response(
        (modes.blades, modes.angular_frequencies), response.engine_order, response.loss_factor, response.excitation,
        lacking,
    )  # fmt: skip
    return amplitudes_, process_time() - start


def _parts(values: np.ndarray) -> np.ndarray:
    return np.stack([np.real(values), np.imag(values)], axis=-1)


def _names(mesh: MeshRecord) -> str:
    return ", ".join(sorted(mesh.surfaces)) or "none"
