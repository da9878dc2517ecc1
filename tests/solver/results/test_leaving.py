"""When and where points come beside the surface over which they slide."""

import re
from pathlib import Path

import numpy as np

from gudgeon.solver.results.leaving import left_text
from tests.solver.features import store_of, system_of


def test_the_first_point_beside_its_surface_is_named_with_its_time(tmp_path: Path) -> None:
    system = system_of(store_of(tmp_path), ("sliding",))
    (contact,) = system.contacts
    over = contact.master
    assert over is not None
    # Along the line of sliding, at constant steps, until all points are beyond the end of the space.
    end = over.chart[0] + over.chart[1] * (over.counts[1] - 3)
    times, ways = np.linspace(0.0, 1e-3, 101)[1:], np.linspace(0.0, 2.0 * (end - over.height.min()), 101)[1:]
    body, along = system.bodies[contact.body], system.velocity * 0.0
    along[body.rigid] = body.twists[:, :3] @ over.direction
    unit = along / system.slid(contact, along)
    snapshots = (system.position + ways[:, None] * unit)[:, system.rigid]
    said = left_text(system, times, snapshots)
    first = times[np.argmax(ways > end - over.height.max())]
    assert f"left '{over.interface}' of {over.body} at {first:.4g} s (contact.{contact.name})" in said
    farthest = contact.points[int(over.height.argmax())]
    place = re.search(r"at \((.*)\) m of", said)
    assert place is not None
    np.testing.assert_allclose([float(x) for x in place[1].split(",")], farthest, rtol=1e-3, atol=1e-12)
    assert left_text(system, times[:1], snapshots[:1] * 0.0 + system.position[system.rigid]) == ""
