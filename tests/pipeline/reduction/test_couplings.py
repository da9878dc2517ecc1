"""Tensors of the floating frame: beams against closed forms, solids against beams."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component

LENGTH, WIDTH, HEIGHT = 0.2, 0.012, 0.008
STEEL = {"E": 2.1e11, "nu": 0.0, "rho": 7850.0}
LINE_MASS = 7850.0 * WIDTH * HEIGHT
BEAM = {
    "kind": "beam", "theory": "euler-bernoulli", "length": LENGTH, "motion": "space",
    "section": {"kind": "rectangle", "width": WIDTH, "height": HEIGHT},
}  # fmt: skip
BOX = {"kind": "box", "lx": LENGTH, "ly": WIDTH, "lz": HEIGHT}


def record(geometry: dict[str, Any], end: str, size: float, count: int = 6, **more: Any) -> ModalRecord:
    """Return the free modes of a rod along x with a tie at its end at x = LENGTH."""
    component = Component.model_validate(
        {"geometry": geometry, "material": STEEL, "mesh": {"size": size}, "modes": {"normal_count": count},
         "interface": {"end": {"surface": end, "kind": "tie", "tie": "rbe3"}}} | more
    )  # fmt: skip
    return reduce_component(component.geometry.build(size), "mesh", component, "rod", turns=True)


@cache
def beam() -> ModalRecord:
    return record(BEAM, "right", LENGTH / 40)


def test_moments_are_those_of_the_mass_matrix() -> None:
    """Φᵀ M Φ = 1 but for the share of torsion, and free modes have no momentum."""
    found = beam().inertia_couplings
    assert found is not None
    assert found.position_moments is not None
    assert found.shape_moments is not None
    own = np.einsum("iikl->kl", found.shape_moments)
    np.testing.assert_allclose(own - np.diag(own.diagonal()), 0.0, atol=1e-8)
    twists = own.diagonal() < 0.5
    np.testing.assert_allclose(own.diagonal()[~twists], 1.0, atol=1e-8)
    reach = np.sqrt(beam().mass)
    np.testing.assert_allclose(found.translation, 0.0, atol=1e-8 * reach)
    np.testing.assert_allclose(found.rotation, 0.0, atol=1e-8 * reach * LENGTH)


def test_stiffness_by_rotation_is_that_of_the_axial_force() -> None:
    """N = ρ A (L²/4 − x²) of the load 2 ρ x along x; ∫ N w′² dx with the exact first mode of a free beam."""
    K = beam().inertia_couplings.centrifugal_stiffness  # type: ignore[union-attr]
    assert K is not None
    beta = 4.730040744862704 / LENGTH
    x = np.linspace(0.0, LENGTH, 4001)
    sigma = (np.cosh(beta * LENGTH) - np.cos(beta * LENGTH)) / (np.sinh(beta * LENGTH) - np.sin(beta * LENGTH))
    w = np.cosh(beta * x) + np.cos(beta * x) - sigma * (np.sinh(beta * x) + np.sin(beta * x))
    slope = np.gradient(w, x, edge_order=2)
    force = LINE_MASS * (LENGTH**2 / 4 - (x - LENGTH / 2) ** 2)
    wanted = np.trapezoid(force * slope**2, x) / np.trapezoid(LINE_MASS * w**2, x)
    assert K[0, 0, 0, 0] == pytest.approx(wanted, rel=1e-3)
    # A rigid rotation about z: ∫ N dx, the second moment of the rod.
    assert K[0, 0, -1, -1] == pytest.approx(LINE_MASS * LENGTH**3 / 6, rel=1e-3)
    np.testing.assert_allclose(K, K.transpose(1, 0, 2, 3), atol=0)


def test_stiffness_by_a_pull_falls_along_the_rod() -> None:
    """A unit force at the end, balanced by inertia: N = x/L, of the rigid rotation ∫ N dx = L/2."""
    K = beam().loads["end"].stress_stiffness
    assert K is not None
    assert K[0, -1, -1] == pytest.approx(LENGTH / 2, rel=1e-2)
    assert K[0, -2, -2] == pytest.approx(LENGTH / 2, rel=1e-2)


def test_a_solid_has_the_tensors_of_its_beam() -> None:
    solid = record(BOX, "right", 0.008, count=1)
    own, line = (one.inertia_couplings for one in (solid, beam()))
    # The first mode bends towards z; the beam has no rotary inertia.
    for name, i in (("centrifugal_stiffness", 0), ("shape_moments", 2)):
        tensor, wanted = getattr(own, name), getattr(line, name)
        assert tensor[i, i, 0, 0] == pytest.approx(wanted[i, i, 0, 0], rel=2e-2)
    pulled, wanted = (one.loads["end"].stress_stiffness for one in (solid, beam()))
    assert pulled is not None
    assert wanted is not None
    assert pulled[0, 0, 0] == pytest.approx(wanted[0, 0, 0], rel=3e-2)


def test_a_beam_in_space_carries_no_point_mass() -> None:
    with pytest.raises(InputError, match="a beam of motion 'space' has none"):
        record(BEAM, "right", LENGTH / 4, point_mass={"tip": {"surface": "right", "mass": 0.1}})
