"""The registry defines every quantity that a run can give, and docs/quantities.md is generated from it."""

from pathlib import Path
from typing import Any

import pytest

from docs.tools.quantities import PAGE, page
from gudgeon.solver.registry import REGISTRY, definition
from gudgeon.solver.simulate import simulate
from tests.solver.systems import (
    block_records,
    block_scene,
    build,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    pair_scene,
    plate_records,
    rigid_records,
    rod_records,
    rod_scene,
)

STEPPING = {"small": 2e-7}
LAW = {"method": "penalty", "law": {"kind": "linear", "stiffness": 2e8}}
FLOOR = {"shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}


def owners(quantities: dict[str, Any], scene: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """Return the kind of owner and the name of each quantity."""
    kinds = {"contact": "contact", "body": "body", "force": "force"}
    found = {}
    for name in quantities:
        owner, _, rest = name.partition(".")
        found[name] = next(kind for key, kind in kinds.items() if owner in scene.get(key, {})), rest
    return found


def check(quantities: dict[str, Any], scene: dict[str, Any]) -> None:
    assert quantities
    for name, (kind, rest) in owners(quantities, scene).items():
        known = definition(rest, [kind])
        assert known is not None, name
        assert known.unit == quantities[name]["unit"], name


@pytest.mark.parametrize("integrator", ["event", "small"])
def test_quantities_of_every_integrator_are_defined(tmp_path: Path, integrator: str) -> None:
    method = LAW if integrator == "event" else {}
    scene = rod_scene(6e-4, **method)
    scene["run"] |= {"integrator": integrator, "frames": 4, "samples": 100}
    scene["run"] |= {"step": STEPPING[integrator]} if integrator in STEPPING else {}
    check(simulate(build(tmp_path, rod_records(8), scene)).quantities, scene)


def test_quantities_of_points_pressures_friction_and_drives_are_defined(tmp_path: Path) -> None:
    scene = block_scene(2e-4, surface_stiffness=1e14)
    found = simulate(build(tmp_path / "block", block_records(5), scene)).quantities
    assert {"wall.edge_share", "wall.pressure_peak"} <= set(found)
    check(found, scene)
    scene = pair_scene(duration=2e-4, step=2e-7)
    check(
        simulate(build_all(tmp_path / "pair", {"part": block_records(5), "plate": plate_records()}, scene)).quantities,
        scene,
    )
    scene = driven_pair_scene(duration=2e-4, step=1e-6)
    check(simulate(build_all(tmp_path / "drive", driven_pair_records(4), scene)).quantities, scene)
    friction = {"static": 0.3, "direction": [1, 0, 0]}
    contact = {"body": "part", "interface": "foot", "against": FLOOR, "method": "constraint", "friction": friction}
    scene = {
        "body": {"part": {"velocity": [0.3, 0, 0]}},
        "contact": {"floor": contact},
        "run": {"duration": 0.5, "gravity": [0, 0, -9.81]},
    }
    foot = rigid_records(1.0, {"foot": ([0, 0, 0], [0, 0, -1])}, axes=(0, 2))
    found = simulate(build(tmp_path / "slide", foot, scene)).quantities
    assert "floor.stick1" in found
    check(found, scene)
    tool = {"kind": "moving", "body": "part", "interface": "top", "force": 10.0, "at": [0.01, 0.0], "speed": 1.0}
    scene = {"body": {"part": {}}, "force": {"tool": tool}, "run": {"duration": 1e-4}}
    found = simulate(build(tmp_path / "tool", plate_records(), scene)).quantities
    assert "tool.deflection_peak" in found
    check(found, scene)


def test_names_are_unique_and_complete() -> None:
    assert len({(one.owner, one.name) for one in REGISTRY}) == len(REGISTRY)
    for one in REGISTRY:
        assert all(part.strip() for part in one), one.name
    assert definition("impact12.start", ["contact"]) is definition("impactN.start", ["contact"])
    for old in ("first_peak", "largest_force", "first_duration", "first_impulse", "impact0.start", "impact1.force"):
        assert definition(old, ["contact"]) is None


def test_the_page_is_that_of_the_registry() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run python -m docs.tools.quantities"
    for one in REGISTRY:
        assert f"| `{one.name}` | {one.unit} |" in page()
