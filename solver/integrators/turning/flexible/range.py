"""Where bodies that turn leave the range of their deformation, which is of second order.

Modes are mass-orthonormal, so the root mean square of the deflection over the mass is |q|/√m. Over the radius of
gyration, a uniform cantilever whose end deflects by w has 1.7 w/L, and 0.15 to 0.2 w/L beside its mean axis.
"""

import numpy as np

from gudgeon.solver.system.system import System


def deformed_text(system: System, times: np.ndarray, q: np.ndarray) -> str:
    """Return the sentence of the first sample in which a body is deformed beyond its range; an empty one where none is.

    Args:
        times: [s], (s,).
        q: Coordinates, (s, m).
    """
    limit, sample = system.scene.run.limits.deflection, len(times)
    text = ""
    for name, body in system.bodies.items():
        if not len(body.modal.angular_frequencies):
            continue
        deflections = np.sqrt((q[:, body.elastic] ** 2).sum(axis=1) / body.morph.mass)
        beyond = np.flatnonzero(deflections > limit * body.gyration)
        if len(beyond) and beyond[0] < sample:
            sample = int(beyond[0])
            text = (
                f"body '{name}' deformed by {deflections[sample]:.3g} m (root mean square) at {times[sample]:.6g} s,"
                f" {deflections[sample] / body.gyration:.3g} of its radius of gyration {body.gyration:.3g} m, beyond"
                f" run.limits.deflection = {limit:g}: the deformation of bodies that turn is of second order; check the"
                " material and the loads, shorten run.duration, or raise run.limits.deflection"
            )
    return text
