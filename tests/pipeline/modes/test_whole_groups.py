"""Groups of equal frequencies: a count that parts one is named with the count that does not."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.pipeline.modes.problem import whole_groups
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.mesh import build_mesh
from gudgeon.pipeline.stages.notes.frequencies import parted
from tests.pipeline.facts import of_modes

ROUND = {"kind": "circle", "radius": 0.01}
FLAT = {"kind": "rectangle", "width": 0.02, "height": 0.03}


def notes(section: dict[str, Any], modes: dict[str, Any], mesh: float = 0.05) -> list[str]:
    """Return the notes on a free beam that is tied at its ends and amidst."""
    component = Component.model_validate(
        {
            "geometry": {
                "kind": "beam",
                "theory": "euler-bernoulli",
                "length": 0.6,
                "motion": "space",
                "section": section,
                "stations": {"mid": 0.3},
            },
            "material": {"E": 2e11, "nu": 0.3, "rho": 8000.0},
            "mesh": {"size": mesh},
            "modes": modes,
            "interface": {name: {"surface": name, "kind": "tie", "tie": "rbe2"} for name in ("left", "mid", "right")},
        }
    )
    record = reduce_component(build_mesh(component, Path(), "rod"), "mesh", component, "rod")
    return [*parted(of_modes({"rod": record}, {"rod": component}))]


row_wise = partial(dict, reduction="row-craig-bampton", normal_count=0)
by_parts = partial(dict, reduction="craig-bampton", normal_count=0)


@pytest.mark.parametrize(
    ("modes", "whole"),
    [
        ({"normal_count": 3}, 4),
        ({"normal_count": 4}, None),
        (row_wise(fixed_count=6), 8),
        (row_wise(fixed_count=5), 7),
        (row_wise(fixed_count=8), None),
        (by_parts(fixed_count=6), 8),
        (by_parts(fixed_count=4), None),
        ({"reduction": "fixed-reference", "reference": "left", "normal_count": 5}, 6),
    ],
)
@pytest.mark.parametrize("mesh", [0.05, 0.004])  # Dense matrices, and Lanczos.
def test_a_count_that_parts_a_group_is_named(modes: dict[str, Any], whole: int | None, mesh: float) -> None:
    key = "fixed_count" if "fixed_count" in modes else "normal_count"
    expected = [] if whole is None else [
        f"component.rod.modes.{key}: {modes[key]} modes part a group of equal frequencies: which of its modes are kept"
        f" is left to round-off, and results with it; {whole} keep the group whole"
    ]  # fmt: skip
    assert notes(ROUND, modes, mesh) == expected


def test_frequencies_that_differ_are_no_group() -> None:
    assert notes(FLAT, {"normal_count": 3}) == notes(FLAT, row_wise(fixed_count=6)) == []


def test_groups_are_those_of_equal_values() -> None:
    values = np.array([1.0, 2.0, 2.0 * (1 + 1e-9), 2.0 * (1 + 1e-4), 5.0, 5.0])
    assert [whole_groups(values, count) for count in range(1, 7)] == [1, 3, 3, 4, 6, 6]
    assert whole_groups(np.empty(0), 0) == 0
