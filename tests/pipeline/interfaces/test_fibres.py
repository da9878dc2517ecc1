"""Section forces and stress of beams under their own weight, by closed forms, with any number of coordinates."""

from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.solver.bodies.placing import turned_modes

LENGTH, SIZE, PULL = 0.8, 0.1, np.array([0.0, 0.0, -9.81])
RHO, AREA, MODULUS = 2700.0, 1.2e-4, 0.02 * 0.006**2 / 6
WEIGHT = RHO * AREA * 9.81
"""Of a length [N/m]."""
BEAM: dict[str, Any] = {
    "kind": "beam", "length": LENGTH, "section": {"kind": "rectangle", "width": 0.02, "height": 0.006},
    "stations": {"inner": 0.3, "outer": 0.7},
}  # fmt: skip
KINDS = [{"theory": "euler-bernoulli"}, {"theory": "timoshenko"}, {"motion": "space"}]
PLACES = {"left": 0.0, "inner": 0.3, "outer": 0.7, "right": 0.8}


def part(kind: dict[str, Any], supports: list[Any], normal_count: int, reduction: str = "macneal") -> Component:
    return Component.model_validate(
        {
            "geometry": BEAM | kind,
            "material": {"E": 70e9, "nu": 0.33, "rho": RHO},
            "mesh": {"size": SIZE},
            "supports": supports,
            "interface": {"tip": {"surface": "right-bottom"}, "root": {"surface": "left-bottom"}},
            "gauge": {
                f"{place}-{name}": {"station": place} | own
                for place in PLACES
                for name, own in (
                    ("shear", {"quantity": "shear-force"}),
                    ("moment", {"quantity": "bending-moment"}),
                    ("top", {"fibre": "top"}),
                )
            },
            "modes": {"reduction": reduction, "normal_count": normal_count},
        }
    )


def readings(item: Component, forces: dict[str, float], gravity: np.ndarray, Q: np.ndarray | None = None) -> Any:
    """Return the values of all gauges in the equilibrium with gravity and forces up at contact points."""
    along = tuple(np.round(gravity / np.linalg.norm(gravity), 12).tolist())
    pulled = [] if not item.supports else [along]
    record = reduce_component(item.geometry.build(SIZE), "ab" * 32, item, "beam", pulled=pulled)
    if Q is not None:
        record, gravity = turned_modes(record, Q), Q @ gravity
    q, pressed = np.zeros(len(record.angular_frequencies)), np.zeros(record.row_count)
    if record.participation is not None:
        q += gravity @ record.participation
    for name, force in forces.items():  # Rows are along the outward normal, down.
        q -= force * record.interfaces[name].rows[0]
        pressed[record.interface_rows[name][0]] = -force
    q /= record.angular_frequencies**2
    found = {}
    for name, gauge in record.gauges.items():
        value = gauge.rows @ q + (gauge.residual @ pressed if gauge.residual.any() else 0.0)
        found[name] = float((value + (0.0 if gauge.weights is None else gauge.weights @ gravity))[0])
    return found


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("count", [1, 5, 10])
@pytest.mark.parametrize("reduction", ["macneal", "craig-bampton"])
def test_a_cantilever_under_its_weight(kind: dict[str, Any], count: int, reduction: str) -> None:
    """V = −q (L − x), M = −q (L − x)²/2 and σ(top) = −M/W at ends and between elements of 0.1 m."""
    found = readings(part(kind, ["left"], count, reduction), {}, PULL)
    for place, x in PLACES.items():
        shear, moment = -WEIGHT * (LENGTH - x), -0.5 * WEIGHT * (LENGTH - x) ** 2
        assert found[f"{place}-shear"] == pytest.approx(shear, rel=1e-6, abs=1e-7 * WEIGHT)
        assert found[f"{place}-moment"] == pytest.approx(moment, rel=1e-6, abs=1e-7 * WEIGHT)
        assert found[f"{place}-top"] == pytest.approx(-moment / MODULUS, rel=1e-6, abs=1e-7 * WEIGHT / MODULUS)


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("count", [2, 8])
def test_a_free_beam_on_two_points(kind: dict[str, Any], count: int) -> None:
    """Half its weight acts up at each end: gravity and the inertia of forces cancel, and the body force is its weight.

    The modes know no gravity, which does not deform a free body: forces bend it against their own inertia.
    """
    half = 0.5 * WEIGHT * LENGTH
    found = readings(part(kind, [], count), {"root": half, "tip": half}, PULL)
    for place in ("inner", "outer"):
        x = PLACES[place]
        moment = 0.5 * WEIGHT * x * (LENGTH - x)
        assert found[f"{place}-moment"] == pytest.approx(moment, rel=1e-6)
        assert found[f"{place}-shear"] == pytest.approx(-WEIGHT * (0.5 * LENGTH - x), rel=1e-6)
        assert found[f"{place}-top"] == pytest.approx(-moment / MODULUS, rel=1e-6)


def test_axial_stress_of_a_hanging_beam() -> None:
    """Weight along its axis stretches it: σ = q (L − x)/A at all fibres, in any placing of the part."""
    Q = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    Q *= np.sign(np.linalg.det(Q))
    item = part({"motion": "space"}, ["left"], 3)
    for turned in (None, Q):
        found = readings(item, {}, np.array([9.81, 0.0, 0.0]), turned)
        for place, x in PLACES.items():
            assert found[f"{place}-top"] == pytest.approx(WEIGHT * (LENGTH - x) / AREA, rel=1e-6, abs=1e-3)
