"""Inertia and own weight of a held body of a scene at a port, by the coordinates of its records."""

from collections.abc import Sequence

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.errors import SceneError
from gudgeon.solver.linear.load_stiffness import with_load_stiffness
from gudgeon.solver.linear.state import linearised, places


def static_inertia(job: Job, force: str, at: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return Yᵀ M Y of the static answers Y to unit forces, and what places read under gravity.

    Exact where the coordinates contain these answers: Yᵀ M Y = Σ b bᵀ/ω⁴ over mass-orthonormal modes with rows b.

    Args:
        job: Of a scene whose records are in the database.
        force: Port of k rows.
        at: Places of one row each.

    Returns:
        (k, k) and (len(at),).

    Raises:
        InputError: there is no such port or place.
    """
    with named(job.path, InputError, SceneError):
        linear = linearised(with_load_stiffness(system_of(job)))
        soft = 1 / linear.system.stiffness
        answers = soft * np.array([port.row for port in places(linear, force, "--force")])
        felt = np.reshape([places(linear, name, "--at")[0].row for name in at], (len(at), len(soft)))
    mass = answers @ answers.T
    return 0.5 * (mass + mass.T), felt @ (soft * linear.system.driving.gravity)
