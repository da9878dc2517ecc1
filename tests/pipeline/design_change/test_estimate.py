"""Estimates of what a design change does to kept modes, against modes and static responses of the moved mesh."""

from pathlib import Path

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.design_change.estimate import Estimate, estimated, sensitivity_of
from gudgeon.pipeline.design_change.morph import Movement, move_nodes, moved_mesh
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.geometry.profile import ProfileTable
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.mesh import build_mesh

FACTOR = 1.5
"""Largest ratio of an estimate and the true change, either way: a first derivative of a small change."""
NOTICED = 0.2
"""Share of the largest change below which an estimate is not compared: its second order may be as large."""
ALUMINIUM = {"E": 72e9, "nu": 0.33, "rho": 2700.0}
SKIRT = {
    "geometry": {"kind": "skirt", "outer_radius": 0.04296, "wall": 0.004, "height": 0.06, "crown": 0.008},
    "material": ALUMINIUM,
    "mesh": {"size": 0.012},
    "interface": {"thrust": {"surface": "skirt", "sector_deg": [-45, 45]}},
    "modes": {"normal_count": 12},
}
LINER = {
    "geometry": {
        "kind": "liner", "bore_radius": 0.043, "wall": 0.006, "length": 0.1, "flange_height": 0.008,
        "flange_width": 0.005,
    },
    "material": {"E": 120e9, "nu": 0.26, "rho": 7200.0},
    "mesh": {"size": 0.016},
    "supports": ["flange"],
    "interface": {"thrust": {"surface": "bore", "sector_deg": [-48.0, 48.0]}},
    "modes": {"normal_count": 8},
}  # fmt: skip


def barrel() -> ProfileTable:
    heights = np.linspace(0, 0.06, 7)
    angles = np.radians([-180.0, -90.0, 0.0, 90.0, 180.0])
    return ProfileTable(heights, angles, np.tile((-20e-6 * ((heights - 0.03) / 0.03) ** 2)[:, None], 5), "barrel")


def ovality(waves: int) -> ProfileTable:
    angles = np.radians(np.arange(-180, 181, 15.0))
    return ProfileTable(np.array([0, 0.06]), angles, np.tile(50e-6 * np.cos(waves * angles), (2, 1)), "oval")


def largest_change(before: np.ndarray, after: np.ndarray) -> float:
    """Return the relative change of a compliance (k, k) under the pressures for which it is largest."""
    values = np.linalg.eigvals(np.linalg.solve(before, after - before)).real
    return float(values[np.abs(values).argmax()])


def compared(
    tables: dict[str, object], surface: str, deviation: ProfileTable | float
) -> tuple[Estimate, ModalRecord, ModalRecord, float]:
    """Return estimate, original and recomputed record, and the true change of compliance under the same loads."""
    component = Component.model_validate(tables)
    mesh, movement = build_mesh(component, Path(), "part"), Movement(surface, deviation, "here")
    before = reduce_component(mesh, "", component, "part")
    moved = moved_mesh(mesh, movement)
    after = reduce_component(moved, "", component, "part")
    original = build_model(mesh, component.material, component.supports)
    changed = Flexibility(build_model(moved, component.material, component.supports))
    one = before.static_responses
    assert one is not None
    Y = one.shapes.reshape(len(original.held), -1)
    # The nodal forces of the record: K Y, and what inertia balances.
    moment = one.resultant[:, 3:] - np.cross(original.properties.centre, one.resultant[:, :3])
    pushed = original.rigid_twists @ np.column_stack([one.resultant[:, :3], moment]).T
    forces = original.K @ Y + original.M @ original.rigid_modes @ pushed
    forces[original.held] = 0.0
    np.testing.assert_allclose(Y.T @ forces, one.compliance, rtol=1e-6, atol=1e-6 * one.compliance.max())
    true = largest_change(one.compliance, forces.T @ changed.solve(forces))
    changed.free()
    assert component.material is not None
    estimate = estimated(sensitivity_of(mesh, component.material, before), move_nodes(mesh, movement) - mesh.nodes)
    return estimate, before, after, true


@pytest.mark.parametrize(
    ("tables", "surface", "deviation"),
    [
        (SKIRT, "skirt", barrel()),
        (SKIRT, "skirt", ovality(2)),
        (SKIRT, "skirt", ovality(4)),
        (SKIRT, "skirt", -50e-6),
        (SKIRT | {"supports": ["open_end"]}, "skirt", 30e-6),
        (LINER, "outer", -0.5e-3),
    ],
    ids=["barrel", "oval", "pairs split", "thinner", "held", "liner"],
)
def test_estimates_equal_true_changes(tables: dict[str, object], surface: str, deviation: ProfileTable | float) -> None:
    """Every mode and every compliance, in size and sign; pairs of equal frequencies split as they do in truth."""
    estimate, before, after, fixed_loads = compared(tables, surface, deviation)
    count = before.normal_count
    true = after.angular_frequencies[:count] / before.angular_frequencies[:count] - 1
    noticed = np.abs(true) > NOTICED * np.abs(true).max()
    ratio = estimate.frequencies[noticed] / true[noticed]
    assert (ratio.min() > 1 / FACTOR, ratio.max() < FACTOR) == (True, True), ratio
    assert 1 / FACTOR < estimate.compliances["thrust"] / fixed_loads < FACTOR


def test_liner_wall_half_a_millimetre_thinner_changes_much() -> None:
    estimate, *_ = compared(LINER, "outer", -0.5e-3)
    assert estimate.compliances["thrust"] > 0.1
    assert np.abs(estimate.frequencies).max() > 0.03


def test_compliance_of_the_barrel_is_that_of_recomputed_modes() -> None:
    """The interface of the moved mesh has slightly other areas and normals, which reuse does not follow."""
    estimate, before, after, _ = compared(SKIRT, "skirt", barrel())
    assert before.static_responses is not None
    assert after.static_responses is not None
    true = largest_change(before.static_responses.compliance, after.static_responses.compliance)
    assert 1 / FACTOR < estimate.compliances["thrust"] / true < FACTOR


@pytest.mark.parametrize("supports", [[], ["open_end"]], ids=["free", "held"])
def test_estimates_of_a_vanishing_change_are_its_derivatives(supports: list[str]) -> None:
    """They tend to the true changes: of a barrel of 0.2 µm they are these to 2 %, and not to the factor of above."""
    table = barrel()
    tables: dict[str, object] = {**SKIRT, "supports": supports}
    small = ProfileTable(table.heights, table.angles, table.deviations / 100, table.source)
    estimate, before, after, fixed_loads = compared(tables, "skirt", small)
    count = before.normal_count
    true = after.angular_frequencies[:count] / before.angular_frequencies[:count] - 1
    np.testing.assert_allclose(estimate.frequencies, true, rtol=0.02, atol=0.02 * np.abs(true).max())
    assert estimate.compliances["thrust"] == pytest.approx(fixed_loads, rel=0.02)


def sideways(lean: float) -> ProfileTable:
    """Return a shift of a wall by 0.2 µm across, growing with the height where it leans (1)."""
    heights, angles = np.linspace(0, 0.06, 7), np.radians(np.arange(-180, 181, 15.0))
    return ProfileTable(heights, angles, 2e-7 * (heights[:, None] / 0.06) ** lean * np.cos(angles), "across")


@pytest.mark.parametrize(
    ("interface", "lean"),
    [({"surface": "skirt", "sector_deg": [-45, 45]}, 0), ({"surface": "open_end"}, 1)],
    ids=["wall", "end"],
)
def test_inertia_that_balances_a_load_moves_with_the_mass(interface: dict[str, object], lean: float) -> None:
    """A free part turns under a load beside its centre: what moves across changes how, by 5 to 60 %."""
    tables: dict[str, object] = SKIRT | {"interface": {"thrust": interface}, "modes": {"normal_count": 4}}
    estimate, _, _, fixed_loads = compared(tables, "skirt", sideways(lean))
    assert estimate.compliances["thrust"] == pytest.approx(fixed_loads, rel=0.01)
