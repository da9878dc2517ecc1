"""Short beams in space and frames bend and vibrate with shear by default."""

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.sparse.linalg import spsolve

from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry import Geometry
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.supports import Support

LENGTH, WIDTH, HEIGHT, FORCE = 0.1, 0.03, 0.05, 1000.0
TABLE = {"E": 210e9, "nu": 0.3, "rho": 7850.0}
STEEL = Material.model_validate(TABLE)
SECTION = {"kind": "rectangle", "width": WIDTH, "height": HEIGHT}
BEAM: dict[str, Any] = {"kind": "beam", "length": LENGTH, "motion": "space", "section": SECTION}
FRAME: dict[str, Any] = {
    "kind": "frame", "section": SECTION, "nodes": {"left": [0, 0, 0], "right": [LENGTH, 0, 0]},
    "members": {"ab": {"start": "left", "end": "right"}},
}  # fmt: skip


def model_of(geometry: dict[str, Any], *supports: str | Support, size: float = 0.01) -> FEModel:
    shape = TypeAdapter(Geometry).validate_python(geometry)
    return build_model(shape.build(size), STEEL, supports, geometry=shape)


@pytest.mark.parametrize("geometry", [BEAM, FRAME], ids=["beam", "frame"])
@pytest.mark.parametrize(("dof", "thick", "wide"), [(2, HEIGHT, WIDTH), (1, WIDTH, HEIGHT)], ids=["z", "y"])
@pytest.mark.parametrize("size", [LENGTH, 0.01])
def test_a_short_cantilever_has_shear(
    geometry: dict[str, Any], dof: int, thick: float, wide: float, size: float
) -> None:
    """F L³ / (3 E I) + F L / (κ G A) with κ = 5/6, exact on each mesh."""
    model = model_of(geometry, "left", size=size)
    free, force = ~model.held, np.zeros(model.K.shape[0])
    tip = 6 * int(np.abs(model.nodes[:, 0] - LENGTH).argmin()) + dof
    force[tip], u = FORCE, np.zeros(model.K.shape[0])
    u[free] = spsolve(model.K[free][:, free].tocsc(), force[free])
    G = 210e9 / 2.6
    exact = FORCE * LENGTH**3 / (3 * 210e9 * wide * thick**3 / 12) + FORCE * LENGTH / (5 / 6 * G * wide * thick)
    assert u[tip] == pytest.approx(exact, rel=1e-9)
    slender = model_of(geometry | {"theory": "euler-bernoulli"}, "left", size=size)
    u[free] = spsolve(slender.K[free][:, free].tocsc(), force[free])
    assert u[tip] == pytest.approx(FORCE * LENGTH**3 / (3 * 210e9 * wide * thick**3 / 12), rel=1e-9)


def test_frequencies_of_short_beams_are_those_of_the_plane() -> None:
    """Timoshenko's plane beam of three-node elements has them; in space there are other modes."""
    plane = normal_modes(model_of(BEAM | {"motion": "plane"}, "left", size=0.002), 4).angular_frequencies
    held = Support(surface="left", hold=("x", "y", "z", "rx", "ry", "rz"))
    space = normal_modes(model_of(BEAM, held, size=0.002), 24).angular_frequencies
    for omega in plane[:3]:
        assert np.abs(space / omega - 1).min() < 1e-3  # Elements of 2 mm.
    slender = normal_modes(model_of(BEAM | {"motion": "plane", "theory": "euler-bernoulli"}, "left"), 1)
    assert slender.angular_frequencies[0] > 1.05 * plane[0]


def test_free_modes_of_short_beams_have_no_momentum() -> None:
    """Sections that turn in bending have a part in it; Φᵀ M Φ = 1."""
    component = Component.model_validate(
        {"geometry": BEAM, "material": TABLE, "mesh": {"size": 0.005}, "modes": {"normal_count": 8},
         "interface": {"end": {"surface": "right", "kind": "tie", "tie": "rbe2"}}}
    )  # fmt: skip
    record = reduce_component(component.geometry.build(0.005), "mesh", component, "rod", turns=True)
    couplings, reach = record.inertia_couplings, np.sqrt(record.mass)
    assert couplings is not None
    np.testing.assert_allclose(couplings.translation, 0.0, atol=1e-8 * reach)
    np.testing.assert_allclose(couplings.rotation, 0.0, atol=1e-8 * reach * LENGTH)
