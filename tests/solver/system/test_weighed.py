"""The weighed system: the static response of each body is kept, and a part of its R has a mass."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gudgeon.solver.checks.weighed import ABOVE, MOST, weighed
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System
from tests.solver.system.test_nested import close, static, whole
from tests.solver.systems import (
    block_records,
    block_scene,
    build,
    build_all,
    driven_pair_records,
    driven_pair_scene,
    rod_records,
    rod_scene,
    with_tangential_rows,
)


def ones(system: System) -> dict[str, np.ndarray]:
    return {contact.name: np.ones(len(contact.points)) for contact in system.contacts}


@pytest.mark.parametrize("contact", [{}, {"friction": {"static": 0.2}}])
def test_the_static_response_is_kept_and_the_coordinate_is_above_the_others(
    tmp_path: Path, contact: dict[str, Any]
) -> None:
    modal, morph = block_records(6)
    system = build(tmp_path, (with_tangential_rows(modal, "face"), morph), block_scene(checks=True, **contact))
    found = weighed(system, ones(system))
    assert found is not None
    assert len(found.velocity) == len(system.velocity) + 1
    assert close(whole(found.residual, found.rows, found), whole(system.residual, system.rows, system))
    assert np.sqrt(found.stiffness[-1]) == pytest.approx(ABOVE * modal.angular_frequencies.max())
    assert np.linalg.eigvalsh(found.residual.dense())[0] > -1e-12 * found.residual.largest().max()
    given = float(found.rows.dense()[:, -1].sum() ** 2 / found.stiffness[-1])
    all_of_it = float(system.residual.dense().sum())
    assert 0 < given <= MOST * all_of_it * (1 + 1e-12)


def test_it_has_the_compliance_of_the_octave_below(tmp_path: Path) -> None:
    """Of a rod's 12 modes those from 7 on, Σ 1/k² of what they have in common, R having the sum over all above 12."""
    system = build(tmp_path, rod_records(12), rod_scene(checks=True))
    found = weighed(system, ones(system))
    assert found is not None
    share = system.rows[0] ** 2 / np.where(system.stiffness > 0, system.stiffness, np.inf)
    octave = share[system.stiffness > system.stiffness[-1] / 4].sum()
    residual = float(system.residual[0][0])
    given = float(found.rows[0][-1] ** 2 / found.stiffness[-1])
    assert given == pytest.approx(min(octave, MOST * residual), rel=1e-9)
    assert float(found.residual[0][0]) == pytest.approx(residual - given, rel=1e-9)


def test_both_bodies_and_joints_and_loads_keep_theirs(tmp_path: Path) -> None:
    system = build_all(tmp_path, driven_pair_records(6), driven_pair_scene())
    found = weighed(system, ones(system))
    assert found is not None
    assert close(whole(found.residual, found.rows, found), whole(system.residual, system.rows, system))
    driving = (system.driving.rows, found.driving.rows)
    assert close(
        found.driving.residual + static(driving[1], found), system.driving.residual + static(driving[0], system)
    )


@pytest.mark.parametrize("case", ["no R", "no force"])
def test_what_has_nothing_to_weigh_is_left(case: str, tmp_path: Path) -> None:
    settings = {"method": "penalty", "surface_stiffness": 1e13} if case == "no R" else {}
    system = build(tmp_path, block_records(3), block_scene(checks=True, **settings))
    forces = {name: 0 * one for name, one in ones(system).items()} if case == "no force" else ones(system)
    assert weighed(system, forces) is None


def test_a_load_that_deforms_nothing_has_nothing_to_weigh(tmp_path: Path) -> None:
    """As a moment about the normal of a face has none where Poisson's ratio is 0 and the modes do not twist it."""
    records = driven_pair_records(6)
    rigid = {
        name: (
            replace(
                modal,
                residual_flexibility=None if modal.residual_flexibility is None else 0 * modal.residual_flexibility,
                loads={load: replace(item, rows=0 * item.rows) for load, item in modal.loads.items()},
            ),
            morph,
        )
        for name, (modal, morph) in records.items()
    }
    assert weighed(build_all(tmp_path / "soft", records, driven_pair_scene()), {}) is not None
    assert weighed(build_all(tmp_path / "stiff", rigid, driven_pair_scene()), {}) is None


def test_ratios_that_end_before_its_frequency_leave_the_other_estimates(tmp_path: Path) -> None:
    """The run needs no ratio that the scene does not give."""
    scene = rod_scene(checks=True)
    (body,) = scene["body"].values()
    body["damping"] = {"ratios": [0.01] * 12}
    found = simulate(build(tmp_path, rod_records(12), scene))
    assert found.estimates["basis.impulse"] < 0.1
