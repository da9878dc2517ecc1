"""Cyclic symmetry: one sector against the whole wheel, meshed and assembled by itself; mistuning; reduced wheels.

The exact case, F5 of the reference set, stands in `tests/validation/test_cyclic_chain.py`.
"""

from dataclasses import replace
from importlib import import_module
from itertools import permutations, product
from typing import Any

import numpy as np
import pytest
from scipy import linalg, sparse
from scipy.spatial import cKDTree

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.applications.wheel.cyclic import hermitian
from gudgeon.pipeline.applications.wheel.cyclic.forced import direct_response, engine_order_response, modal_compliance
from gudgeon.pipeline.applications.wheel.cyclic.harmonic import harmonic_modes, tuned_frequencies
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector, cyclic_sector
from gudgeon.pipeline.applications.wheel.cyclic.static import static_response
from gudgeon.pipeline.applications.wheel.cyclic.synthesis import InterfaceChoice, sector_parts, synthesise
from gudgeon.pipeline.applications.wheel.cyclic.whole_wheel import (
    Mistuning,
    part_stiffness,
    wheel_motion,
    wheel_problem,
    wheel_rigid,
)
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.symmetry import CyclicSymmetry
from gudgeon.pipeline.scenes.material import Material
from tests.validation.cyclic_chain import chain, tuned_modes, wheel_frequencies

STEEL = Material(E=2.1e11, nu=0.3, rho=7800.0)
WHOLE = 1e-8
"""The issue's: tuned by cyclic symmetry equals the whole wheel."""
SECTORS, COUNT = 6, 6
RNG = np.random.default_rng(5)
FACTORS = 1 + 0.05 * RNG.uniform(-1, 1, SECTORS)


def bladed_sector(sectors: int) -> tuple[MeshRecord, np.ndarray]:
    """A sector of a disk with a blade on its rim, tet10 of a regular grid, and which cells are the blade's."""
    angle = 2 * np.pi / sectors
    radii = np.array([0.03, 0.05, 0.07, 0.09, 0.115, 0.14])
    cells, blade = [], []
    for r, a, z in product(range(5), range(3), range(1)):
        if r >= 3 and a != 1:
            continue
        for order in permutations(range(3)):
            path = [2 * np.array([r, a, z])]
            for axis in order:
                path.append(path[-1] + 2 * np.eye(3, dtype=int)[axis])
            if np.linalg.det(np.diff(path, axis=0)) < 0:
                path[1], path[2] = path[2], path[1]
            cells.append(path + [(path[i] + path[j]) // 2 for i, j in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))])
            blade.append(r >= 3)
    grid, numbers = np.unique(np.array(cells).reshape(-1, 3), axis=0, return_inverse=True)
    radius = np.interp(grid[:, 0], np.arange(11), np.interp(np.arange(11) / 2, np.arange(6), radii))
    turn = angle * (grid[:, 1] / 6 + 0.02 * np.where(grid[:, 0] > 6, grid[:, 2], 0))
    nodes = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), 0.008 * grid[:, 2]])
    places = {"low": grid[:, 1] == 0, "high": grid[:, 1] == 6, "bore": grid[:, 0] == 0, "rim": grid[:, 0] == 6}
    surfaces = {name: Surface(np.flatnonzero(at)[:, None], {}) for name, at in places.items()}
    mesh = MeshRecord(nodes=nodes, cells=numbers.reshape(-1, 10), cell_type="tetra10", surfaces=surfaces)
    return mesh, np.array(blade)


def bladed(*supports: str, sectors: int = SECTORS) -> tuple[Sector, Mistuning]:
    mesh, blade = bladed_sector(sectors)
    model = build_model(mesh, STEEL, supports)
    sector = cyclic_sector(model, CyclicSymmetry(sectors=sectors))
    return sector, Mistuning(part_stiffness(model, STEEL, blade), np.resize(FACTORS, sectors))


def whole_wheel(*supports: str) -> FEModel:
    """The wheel as one mesh: the sector copied, coinciding nodes made one."""
    mesh, _ = bladed_sector(SECTORS)
    R = CyclicSymmetry(sectors=SECTORS).rotation
    copies = np.concatenate([mesh.nodes @ np.linalg.matrix_power(R, j).T for j in range(SECTORS)])
    first = np.array([min(near) for near in cKDTree(copies).query_ball_point(copies, 1e-9)])
    kept, number = np.unique(first, return_inverse=True)
    cells = np.concatenate([mesh.cells + j * len(mesh.nodes) for j in range(SECTORS)])
    bore = np.unique(number[(mesh.surfaces["bore"].facets + np.arange(SECTORS) * len(mesh.nodes)).ravel()])
    whole = MeshRecord(nodes=copies[kept], cells=number[cells], cell_type="tetra10",
                       surfaces={"bore": Surface(bore[:, None], {})})  # fmt: skip
    return build_model(whole, STEEL, supports)


def tip_row(sector: Sector) -> np.ndarray:
    """The axial displacement of the outermost node."""
    row = np.zeros(len(sector.model.held))
    row[3 * int(np.linalg.norm(sector.model.nodes[:, :2], axis=1).argmax()) + 2] = 1.0
    return row


@pytest.fixture(scope="module", params=[(), ("bore",)], ids=["free", "held"])
def wheel(request: pytest.FixtureRequest) -> tuple[Sector, Mistuning, tuple[str, ...]]:
    return *bladed(*request.param), request.param


def test_tuned_wheel_equals_the_mesh_of_the_whole(wheel: tuple[Sector, Mistuning, tuple[str, ...]]) -> None:
    sector, _, supports = wheel
    modes = tuned_modes(sector, COUNT)
    ours = tuned_frequencies(modes)
    model = whole_wheel(*supports)
    K, M = model.free_matrices()
    problem = hermitian.Problem(K, M, model.rigid_modes[model.free])
    theirs = np.sqrt(hermitian.lowest_pairs(problem, len(ours)).values)
    assert len(ours) > 3 * COUNT
    np.testing.assert_allclose(ours, theirs, rtol=WHOLE)
    assert sum(one.rigid * one.multiplicity for one in modes) == len(model.rigid_twists)
    assert len(model.free) == sector.own.shape[1] * SECTORS


def test_assembled_wheel_equals_the_mesh_of_the_whole(wheel: tuple[Sector, Mistuning, tuple[str, ...]]) -> None:
    sector, _, _ = wheel
    ours = tuned_frequencies(tuned_modes(sector, COUNT))
    np.testing.assert_allclose(wheel_frequencies(sector, len(ours)), ours, rtol=WHOLE)


@pytest.mark.parametrize("sectors", [2, 3, 5, 6])
def test_pairs_of_a_wheel(sectors: int) -> None:
    """2 (N/2 − 1) of each family in pairs for an even N, N − 1 for an odd one."""
    sector, _ = bladed("bore", sectors=sectors)
    modes = tuned_modes(sector, 2)
    single = [one.harmonic for one in modes if one.multiplicity == 1]
    assert single == ([0, sectors // 2] if sectors % 2 == 0 else [0])
    assert sum(one.multiplicity for one in modes) == sectors
    ours = tuned_frequencies(modes)
    np.testing.assert_allclose(ours, wheel_frequencies(sector, len(ours)), rtol=WHOLE)


def test_shapes_fulfil_the_condition_between_sectors(wheel: tuple[Sector, Mistuning, tuple[str, ...]]) -> None:
    sector = wheel[0]
    R, model = sector.symmetry.rotation, sector.model
    low = model.mesh.surfaces["low"].facets.ravel()
    high = cKDTree(model.nodes).query(model.nodes[low] @ R.T)[1]
    for harmonic in sector.symmetry.harmonics():
        modes = harmonic_modes(sector, harmonic, 3)
        u = modes.real if modes.imaginary is None else modes.real + 1j * modes.imaginary
        turned = np.exp(2j * np.pi * harmonic / SECTORS) * np.einsum("ij,njk->nik", R, u[low])
        np.testing.assert_allclose(u[high], turned, atol=1e-12 * np.abs(u).max())
        assert np.iscomplexobj(u) == (modes.multiplicity == 2)


def test_dense_and_lanczos_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    sector, _ = bladed()
    lanczos = [harmonic_modes(sector, harmonic, 5) for harmonic in range(3)]
    monkeypatch.setattr(hermitian, "DENSE", 10_000)
    for one in lanczos:
        dense = harmonic_modes(sector, one.harmonic, 5)
        np.testing.assert_allclose(one.angular_frequencies, dense.angular_frequencies, rtol=1e-9)
        assert one.rigid == dense.rigid == (2 if one.harmonic < 2 else 0)


@pytest.mark.parametrize("supports", [(), ("bore",)], ids=["free", "held"])
def test_blocks_and_single_columns_agree(supports: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every harmonic, real and complex: the method of large sectors finds what that of small ones does."""
    sector, _ = bladed(*supports)
    single = [harmonic_modes(sector, h, COUNT).angular_frequencies for h in range(SECTORS // 2 + 1)]
    taken: list[int] = []
    lanczos = hermitian.block_lanczos

    def counted(*arguments: Any) -> Any:
        taken.append(arguments[3])
        return lanczos(*arguments)

    monkeypatch.setattr(hermitian, "block_lanczos", counted)
    monkeypatch.setattr(hermitian, "LEAST_DOFS", 0)
    blocks = [harmonic_modes(sector, h, COUNT).angular_frequencies for h in range(SECTORS // 2 + 1)]
    assert len(taken) == SECTORS // 2 + 1
    for one, other in zip(single, blocks, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_missed_mode_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    sector, _ = bladed("bore")
    whole = hermitian._lanczos
    monkeypatch.setattr(hermitian, "_lanczos", lambda problem, count: whole(problem, count + 1)[:, 1:])
    with pytest.raises(StageError, match="the inertia count finds"):
        harmonic_modes(sector, 1, 4)


def test_synthesis_with_all_kept_is_craig_bampton(wheel: tuple[Sector, Mistuning, tuple[str, ...]]) -> None:
    """Keeping all, and reducing all by all modes, are the same space; frequencies come from above."""
    sector, mistuning, _ = wheel
    parts, k = sector_parts(sector, 12), len(sector.face)
    full = wheel_frequencies(sector, 12, mistuning)
    kept = synthesise(parts, InterfaceChoice(np.ones(k, bool), 0), 12, mistuning)
    reduced = synthesise(parts, InterfaceChoice(np.zeros(k, bool), None), 12, mistuning)
    assert kept.size == reduced.size == SECTORS * (k + 12)
    np.testing.assert_allclose(reduced.angular_frequencies, kept.angular_frequencies, rtol=1e-9)
    assert np.all(kept.angular_frequencies >= full * (1 - 1e-9))
    np.testing.assert_allclose(kept.angular_frequencies, full, rtol=5e-3)


def test_all_fixed_modes_give_the_full_wheel(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tuned basis is complete then, so that it holds every mistuned wheel."""
    monkeypatch.setattr(import_module("gudgeon.pipeline.reduction.methods.craig_bampton"), "DENSE", 10_000)
    sector, mistuning = bladed("bore", sectors=3)
    inside = len(sector.model.free) - 2 * len(sector.face)
    one = synthesise(sector_parts(sector, inside), InterfaceChoice(np.ones(len(sector.face), bool), 0), 8, mistuning)
    np.testing.assert_allclose(one.angular_frequencies, wheel_frequencies(sector, 8, mistuning), rtol=WHOLE)


def test_choices_of_kept_interface(wheel: tuple[Sector, Mistuning, tuple[str, ...]]) -> None:
    """Interface modes shrink the wheel at hardly any loss; more of them, or more kept dofs, are never worse."""
    sector, mistuning, _ = wheel
    parts, k = sector_parts(sector, 12), len(sector.face)
    rim = np.isin(sector.face_dofs // 3, sector.model.mesh.surfaces["rim"].facets)
    none, all_dofs = np.zeros(k, bool), np.ones(k, bool)
    choices = {
        "none, 2": InterfaceChoice(none, 2),
        "none, 6": InterfaceChoice(none, 6),
        "rim, 0": InterfaceChoice(rim, 0),
        "rim, 4": InterfaceChoice(rim, 4),
        "all": InterfaceChoice(all_dofs, 0),
    }
    full = wheel_frequencies(sector, 12, mistuning)
    table = {name: synthesise(parts, choice, 12, mistuning) for name, choice in choices.items()}
    error = {name: np.abs(one.angular_frequencies / full - 1).max() for name, one in table.items()}
    assert error["all"] <= error["none, 6"] * (1 + 1e-6) <= error["none, 2"] * (1 + 2e-6)
    assert error["rim, 4"] <= error["rim, 0"] * (1 + 1e-6)
    assert error["all"] < 5e-4
    assert error["none, 6"] < 1e-3
    assert error["rim, 4"] < 5e-3
    rigid = wheel_rigid(sector).shape[1]
    assert table["none, 2"].size == SECTORS * (2 + 12) + rigid
    assert table["rim, 4"].size == SECTORS * (rim.sum() + 4 + 12)


def test_mistuning_splits_pairs() -> None:
    sector, mistuning = bladed("bore")
    tuned, mistuned = wheel_frequencies(sector, 6), wheel_frequencies(sector, 6, mistuning)
    gaps = [np.diff(values) / values[1:] for values in (tuned, mistuned)]
    assert np.sort(gaps[0])[:2].max() < 1e-10
    assert gaps[1].min() > 1e-5


def test_rigid_motions_of_the_wheel() -> None:
    problem = wheel_problem(bladed()[0])
    assert problem.rigid.shape[1] == 6
    assert np.abs(problem.K @ problem.rigid).max() < 1e-9 * abs(problem.K).max() * np.abs(problem.rigid).max()
    np.testing.assert_allclose(problem.rigid.T @ (problem.M @ problem.rigid), np.eye(6), atol=1e-12)


def moved(mesh: MeshRecord, **change: Any) -> FEModel:
    return build_model(replace(mesh, **change), STEEL)


def test_faces_that_do_not_match_are_refused() -> None:
    mesh, _ = bladed_sector(SECTORS)
    model, symmetry = build_model(mesh, STEEL), CyclicSymmetry(sectors=SECTORS)
    nodes = mesh.nodes.copy()
    nodes[mesh.surfaces["high"].facets[3, 0]] *= 1 + 1e-5
    cases = {
        r"cyclic: node \d+ of 'low', turned by 2π/6 to \(.*\), is .* away from the nearest": (
            moved(mesh, nodes=nodes), symmetry),
        r"cyclic: node \d+ of 'low', turned by 2π/7": (model, CyclicSymmetry(sectors=7)),
        r"cyclic: 'low' has 21 nodes, 'high' 20; the faces must be meshed alike": (
            moved(mesh, surfaces=mesh.surfaces | {"high": Surface(mesh.surfaces["high"].facets[1:], {})}), symmetry),
        r"cyclic: node \d+ lies on 'low' and 'high'; a sector that reaches the axis": (
            moved(mesh, surfaces=mesh.surfaces | {"high": mesh.surfaces["low"]}), symmetry),
        r"cyclic.high: the mesh has no surface 'top', it has bore": (
            model, CyclicSymmetry(sectors=SECTORS, high="top")),
        r"cyclic: the supports of 'low', rotated, are not those of 'high'": (
            build_model(mesh, STEEL, ["low"]), symmetry),
        r"cyclic: the rotated directions of a node's dofs are not": (
            replace(model, directions=np.diag([1.0, 0, 0])), symmetry),
    }  # fmt: skip
    for message, (wrong, how) in cases.items():
        with pytest.raises(InputError, match=message):
            cyclic_sector(wrong, how)
    nodes = mesh.nodes.copy()
    nodes[mesh.surfaces["high"].facets[3, 0]] += 1e-9
    cyclic_sector(moved(mesh, nodes=nodes), symmetry)


def test_what_there_is_not_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    sector, mistuning = chain()
    with pytest.raises(InputError, match=r"cyclic\.harmonic: 7 given, 12 sectors have 0 to 6"):
        harmonic_modes(sector, 7, 1)
    with pytest.raises(StageError, match="3 requested, there are 2 elastic ones"):
        harmonic_modes(sector, 0, 3)
    with pytest.raises(InputError, match=r"mistuning\.factors: 3 given, the wheel has 12 blades"):
        wheel_problem(sector, replace(mistuning, factors=np.ones(3)))
    with pytest.raises(InputError, match=r"mistuning\.factors: 0 given, a blade's stiffness must be above 0"):
        wheel_problem(sector, replace(mistuning, factors=np.zeros(12)))
    parts = sector_parts(sector, 0)
    with pytest.raises(InputError, match=r"cyclic\.count: 24 given, the reduced wheel has 12 elastic coordinates"):
        synthesise(parts, InterfaceChoice(np.array([True]), 0), 24, mistuning)
    with pytest.raises(
        InputError, match=r"cyclic\.interface_count: 2 given, a face has 1 dofs in addition to those kept"
    ):
        synthesise(parts, InterfaceChoice(np.array([False]), 2), 4, mistuning)
    monkeypatch.setattr("gudgeon.pipeline.applications.wheel.cyclic.synthesis.LARGEST_SIZE", 11)
    with pytest.raises(InputError, match="cyclic: 12 coordinates, at most 11; keep fewer of a face's 1 dofs"):
        synthesise(parts, InterfaceChoice(np.array([False]), 1), 4, mistuning)
    monkeypatch.setattr("gudgeon.pipeline.applications.wheel.cyclic.synthesis.LARGEST_FACE", 0)
    with pytest.raises(InputError, match="cyclic: a face has 1 dofs, at most 0; coarsen the mesh"):
        sector_parts(sector, 0)


def test_hermitian_pairs_of_a_random_matrix() -> None:
    """The doubled factor's inertia and the complex Lanczos against dense eigenvalues."""
    size = 450
    rows = sparse.random(size, size, 0.02, random_state=1) + 1j * sparse.random(size, size, 0.02, random_state=2)
    K = sparse.csr_matrix(rows + rows.conj().T + 20 * sparse.diags(np.arange(1.0, size + 1)))
    M = sparse.csr_matrix(sparse.diags(np.linspace(1.0, 2.0, size)))
    pairs = hermitian.lowest_pairs(hermitian.Problem(K, M, np.empty((size, 0))), 8)
    expected = linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:8]
    np.testing.assert_allclose(pairs.values, expected, rtol=1e-10)


def test_engine_order_of_f5_against_a_direct_solution() -> None:
    sector, mistuning = chain()
    problem, N, order, loss = wheel_problem(sector, mistuning), 12, 3, 1e-3
    pairs = hermitian.lowest_pairs(problem, 24)
    row = np.array([0.0, 1, 0])
    at = 2 * np.pi * np.array([100.0, 450.2, 616.3, 700.0])
    ours = engine_order_response(
        (wheel_motion(sector, row[None]) @ pairs.vectors, np.sqrt(pairs.values)), order, loss, at
    )
    K, M = problem.K.toarray(), problem.M.toarray()
    blade = np.arange(N) * 2 + 1
    load = np.zeros(2 * N, complex)
    load[blade] = np.exp(2j * np.pi * order * np.arange(N) / N)
    for one, omega in zip(ours, at, strict=True):
        exact = np.linalg.solve(K * (1 + 1j * loss) - omega**2 * M, load)
        np.testing.assert_allclose(one, exact[blade], rtol=1e-9)
        np.testing.assert_allclose(direct_response(problem, load, loss, omega), exact, rtol=1e-9)


@pytest.mark.parametrize("supports", [("bore",), ()])
@pytest.mark.parametrize("order", [0, 1, 2, SECTORS + 1])
def test_few_modes_with_what_they_lack_at_rest_are_the_whole_wheel(supports: tuple[str, ...], order: int) -> None:
    """Below the first modes, whatever the engine order; a free wheel moves by its elastic part alone."""
    sector, _ = bladed(*supports)
    problem, row, loss = wheel_problem(sector), tip_row(sector), 1e-2
    rows = wheel_motion(sector, row[None])
    load = rows.T @ np.exp(2j * np.pi * order * np.arange(SECTORS) / SECTORS)
    few, many = (hermitian.lowest_pairs(problem, count) for count in (6, 24))
    at = 0.05 * np.sqrt(few.values[:1])
    kept = rows @ few.vectors, np.sqrt(few.values)
    lacking = static_response(sector, row, order) - modal_compliance(*kept, order)
    assert lacking > 0
    elastic = load - problem.M @ (problem.rigid @ (problem.rigid.conj().T @ load))
    exact = direct_response(problem, elastic, loss, float(at[0]))
    exact = rows @ (exact - problem.rigid @ (problem.rigid.conj().T @ (problem.M @ exact)))
    found = engine_order_response(kept, order, loss, at, lacking)[0]
    np.testing.assert_allclose(found, exact, rtol=1e-3)
    more = rows @ many.vectors, np.sqrt(many.values)
    assert modal_compliance(*kept, order) < modal_compliance(*more, order) < static_response(sector, row, order)


def test_a_tuned_wheel_answers_an_engine_order_with_one_harmonic() -> None:
    """All blades move alike then, and only the frequencies of that harmonic resonate."""
    sector, _ = bladed("bore")
    pairs = hermitian.lowest_pairs(wheel_problem(sector), 12)
    row = tip_row(sector)
    own = harmonic_modes(sector, 2, 1).angular_frequencies[0]
    at = own * np.array([0.98, 1.0, 1.02])
    response = engine_order_response(
        (wheel_motion(sector, row[None]) @ pairs.vectors, np.sqrt(pairs.values)), 2, 1e-3, at
    )
    np.testing.assert_allclose(np.abs(response), np.abs(response[:, :1]) * np.ones(SECTORS), rtol=1e-6)
    assert np.abs(response[1]).max() > 5 * np.abs(response[[0, 2]]).max()


def test_magnification_by_synthesis() -> None:
    """Partial interface modes give the full wheel's magnification; it is above 1 and below a generous Whitehead."""
    sector, mistuning = bladed("bore")
    row, loss = tip_row(sector), 2e-3
    own = harmonic_modes(sector, 2, 1).angular_frequencies[0]
    at = own * np.linspace(0.95, 1.05, 401)
    parts = sector_parts(sector, 12)
    rim = np.isin(sector.face_dofs // 3, sector.model.mesh.surfaces["rim"].facets)
    factors = {"full": [], "reduced": []}
    for blades in (mistuning, None):
        pairs = hermitian.lowest_pairs(wheel_problem(sector, blades), 18)
        one = synthesise(parts, InterfaceChoice(rim, 6), 18, blades)
        sides = {
            "full": (wheel_motion(sector, row[None]) @ pairs.vectors, np.sqrt(pairs.values)),
            "reduced": (np.einsum("c,ncm->nm", row @ parts.basis, one.motion), one.angular_frequencies),
        }
        for name, (motion, frequencies) in sides.items():
            factors[name].append(engine_order_response((motion, frequencies), 2, loss, at))
    full, reduced = (np.divide(*(np.abs(one).max() for one in factors[name])) for name in ("full", "reduced"))
    assert 1 < full < (1 + np.sqrt(SECTORS)) / 2 * 1.1
    np.testing.assert_allclose(reduced, full, rtol=1e-2)


def test_response_without_damping_is_refused() -> None:
    with pytest.raises(InputError, match=r"cyclic\.loss_factor: 0\.0 given, it must be above 0"):
        engine_order_response((np.ones((2, 1)), np.ones(1)), 1, 0.0, np.ones(1))
