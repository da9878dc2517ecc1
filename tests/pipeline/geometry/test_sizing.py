"""Meshes of CAD parts by what is there: a budget of nodes, blends of any radius, and elements where something acts."""

import logging
from pathlib import Path
from typing import Any

import gmsh
import numpy as np
import pytest

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.drafts.faces import look_at
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry.cad.part import Places
from gudgeon.pipeline.geometry.mesh_estimate import NODES
from gudgeon.pipeline.report.budget.budget import _resized
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.keys.products import mesh_product
from gudgeon.pipeline.stages.mesh import build_mesh
from tests.pipeline.geometry.cad_files import part, write_cad

WITHIN = 1.6
"""Ratio of estimated and made nodes."""
PICTURED = 40_000
"""Triangles of a picture of the faces."""
SHANK = 60.0
"""Length of the rod's filleted edges at least [mm]."""


def box_of(dimension: int, tag: int) -> np.ndarray:
    """Extents of an entity."""
    low, high = np.reshape(gmsh.model.getBoundingBox(dimension, tag), (2, 3))
    return np.asarray(high - low)


def filleted(occ: Any, body: int, edges: list[int], radius: float) -> None:
    occ.fillet([body], edges, [radius])


def rod(occ: Any, radius: float) -> None:
    """Draw a connecting rod along x whose shank has fillets, in mm."""
    eyes = [(3, occ.addCylinder(0, 0, -12, 0, 0, 24, 30)), (3, occ.addCylinder(150, 0, -10, 0, 0, 20, 18))]
    body, _ = occ.fuse(eyes[:1], [eyes[1], (3, occ.addBox(20, -9, -6, 120, 18, 12))])
    body, _ = occ.cut(
        body, [(3, occ.addCylinder(0, 0, -20, 0, 0, 40, 22)), (3, occ.addCylinder(150, 0, -20, 0, 0, 40, 11))]
    )
    occ.synchronize()
    filleted(occ, body[0][1], [tag for _, tag in gmsh.model.getEntities(1) if box_of(1, tag)[0] > SHANK], radius)


def crankshaft(occ: Any) -> None:
    """Draw a crankshaft of two throws along x, whose journals and pins run into the webs with a radius of 1 mm."""
    pieces, x = [], 0.0
    for throw in (30.0, -30.0):
        for length, y, radius in ((24, 0.0, 20), (12, None, 0), (22, throw, 18), (12, None, 0)):
            if y is None:
                pieces += [
                    (3, occ.addCylinder(x, 0, 0, length, 0, 0, 32)),
                    (3, occ.addCylinder(x, throw, 0, length, 0, 0, 28)),
                ]
            else:
                pieces.append((3, occ.addCylinder(x, y, 0, length, 0, 0, radius)))
            x += length
    body, _ = occ.fuse(pieces[:1], [*pieces[1:], (3, occ.addCylinder(x, 0, 0, 24, 0, 0, 20))])
    occ.synchronize()
    circles = [tag for _, tag in gmsh.model.getEntities(1) if gmsh.model.getType(1, tag) == "Circle"]
    rims = [tag for tag in circles if box_of(1, tag)[0] < 1e-3 and box_of(1, tag).max() < 42]
    filleted(occ, body[0][1], rims, 1.0)


def housing(occ: Any) -> None:
    """Draw an open box with walls of 6 mm, bosses with holes, ribs and a bore; its upright edges are rounded."""
    body, _ = occ.cut([(3, occ.addBox(0, 0, 0, 160, 120, 80))], [(3, occ.addBox(6, 6, 6, 148, 108, 80))])
    corners = [(x, y) for x in (12, 148) for y in (12, 108)]
    added = [(3, occ.addCylinder(x, y, 0, 0, 0, 80, 9)) for x, y in corners]
    added += [(3, occ.addBox(x, 6, 6, 4, 108, 20)) for x in (40, 80, 116)]
    body, _ = occ.fuse(body, [*added, (3, occ.addCylinder(-6, 60, 40, 18, 0, 0, 28))])
    holes = [(3, occ.addCylinder(x, y, 40, 0, 0, 50, 3)) for x, y in corners]
    body, _ = occ.cut(body, [*holes, (3, occ.addCylinder(-10, 60, 40, 40, 0, 0, 18))])
    occ.synchronize()
    upright = [tag for _, tag in gmsh.model.getEntities(1)
               if gmsh.model.getType(1, tag) == "Line" and box_of(1, tag)[2] > 40]  # fmt: skip
    filleted(occ, body[0][1], upright, 1.5)


@pytest.mark.parametrize("radius", [0.5, 1.0, 2.0])
def test_small_fillets_have_few_nodes(radius: float, tmp_path: Path) -> None:
    """By curvature alone the rod has 177 809 nodes with fillets of 2 mm, and 1 154 441 with 1 mm."""
    path = write_cad(tmp_path / "rod.step", lambda occ: rod(occ, radius))
    mesh = part(path).build(0.0053, acted_on=Places(("face9",)))
    _, estimate = part(path).size_within(0.0053, acted_on=Places(("face9",)))
    assert len(mesh.nodes) < NODES / 2
    assert 1 / WITHIN < estimate / len(mesh.nodes) < WITHIN
    look = look_at(str(path), None, (), None)
    assert mass_properties(mesh, 1.0).mass == pytest.approx(look.volume, rel=1e-3)
    assert len(look.triangles) < PICTURED


@pytest.mark.validation
@pytest.mark.parametrize("draw", [lambda occ: rod(occ, 1.0), crankshaft, housing], ids=["rod", "crankshaft", "housing"])
def test_the_budget_holds_by_default(draw: Any, tmp_path: Path) -> None:
    mesh = part(write_cad(tmp_path / "part.step", draw)).build(None, acted_on=Places(("face1",)))
    assert NODES / 2 < len(mesh.nodes) <= NODES


@pytest.fixture(scope="module")
def stepped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A block with a fillet of 1 mm along each of its upright edges."""

    def draw(occ: Any) -> None:
        body = occ.addBox(0, 0, 0, 40, 30, 20)
        occ.synchronize()
        filleted(occ, body, [tag for _, tag in gmsh.model.getEntities(1) if box_of(1, tag)[2] > 10], 1.0)

    return write_cad(tmp_path_factory.mktemp("cad") / "block.step", draw)


def facets(mesh: MeshRecord, face: str) -> int:
    return len(mesh.surfaces[face].facets)


def blends_of(mesh: MeshRecord) -> list[str]:
    return [name for name, surface in mesh.surfaces.items() if surface.shape.get("kind") == "cylinder"]


def test_blends_are_fine_where_something_acts(stepped: Path) -> None:
    """The fillet of an interface, or next to a gauge, has elements by its curvature; the others have few."""
    coarse = part(stepped).build(0.008, acted_on=Places(()))
    blend, distant = blends_of(coarse)[:2]
    fine = part(stepped).build(0.008, acted_on=Places((blend,)))
    assert facets(fine, blend) > 8 * facets(coarse, blend)
    assert facets(fine, distant) < 3 * facets(coarse, distant)
    centre = coarse.nodes[coarse.surfaces[blend].facets].mean(axis=(0, 1))
    gauged = part(stepped).build(0.008, acted_on=Places((), (tuple(centre.tolist()),)))
    assert facets(gauged, blend) == facets(fine, blend)


def test_a_budget_chooses_the_size_and_a_stated_size_precedes_it(
    stepped: Path, caplog: pytest.LogCaptureFixture
) -> None:
    lines: list[str] = []
    mesh = part(stepped).build(None, 6000, Places(()), lines.append)
    assert 3000 < len(mesh.nodes) <= 6000
    assert lines[0].startswith("about ")
    assert lines[0].endswith(" s")
    assert not caplog.records
    with caplog.at_level(logging.WARNING):
        stated = part(stepped).build(0.0025, 6000, Places(()))
    assert len(stated.nodes) > 6000
    assert "mesh.size: 0.0025 m gives about" in caplog.text
    assert "more nodes than mesh.nodes, 6,000" in caplog.text


def component(path: Path, **tables: Any) -> Component:
    defaults = {"geometry": {"kind": "cad", "path": path.name}, "material": {"E": 2e11, "nu": 0.3, "rho": 7800.0}}
    return Component.model_validate(defaults | tables)


def test_keys_follow_the_places_where_something_acts_and_the_budget(stepped: Path) -> None:
    def key(**tables: Any) -> str:
        return mesh_product("part", component(stepped, **tables), stepped.parent).key

    acted = {"interface": {"foot": {"surface": "face5"}}}
    assert key() != key(**acted) == key(supports=["face5"])
    assert key(**acted) == key(**acted, gauge={"all": {"surface": "skin"}})
    assert key(gauge={"spot": {"point": [0.0, 0.01, 0.01]}}) != key()
    assert key(mesh={"nodes": 9000}) != key()
    assert key(mesh={"size": 0.01, "nodes": 9000}) == key(mesh={"size": 0.01})


def test_the_mesh_stage_needs_no_size_of_a_cad_part(stepped: Path) -> None:
    stages: list[str] = []
    meshed = component(stepped, mesh={"nodes": 9000}, interface={"foot": {"surface": "face5"}})
    mesh = build_mesh(meshed, stepped.parent, "part", tell=lambda stage, fraction: stages.append(stage))
    assert len(mesh.nodes) <= 9000
    assert stages == [next(iter(stages))]
    assert stages[0].startswith("mesh (part: about ")


def test_another_mesh_of_a_report_has_other_curves_and_named_surfaces() -> None:
    geometry = {"kind": "cad", "path": "part.step", "around": 12, "sizes": {"bore": 0.002}}
    material = {"E": 2e11, "nu": 0.3, "rho": 7800.0}
    tables = {"geometry": geometry, "material": material}
    by_nodes = _resized(Component.model_validate(tables), 0.5)
    assert by_nodes == {"mesh": {"nodes": 8 * NODES}, "geometry": {"around": 24, "sizes": {"bore": 0.001}}}
    sized = _resized(Component.model_validate(tables | {"mesh": {"size": 0.004}}), 2.0)
    assert sized == {"mesh": {"size": 0.008}, "geometry": {"around": 6, "sizes": {"bore": 0.004}}}
