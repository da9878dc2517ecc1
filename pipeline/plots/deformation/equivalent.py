"""What colours a deformed body, and the texts of its pictures."""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.stress import left_out


class Colouring(NamedTuple):
    """Values that colour a deformed body."""

    title: str
    name: str
    unit: str
    missing: str
    """What they leave out, empty if nothing."""


DISPLACEMENT = Colouring("Elastic deformation", "elastic displacement", "m", "")


def stress_text(drawing: Drawing, body: BodyMotion) -> Colouring:
    """Return the texts of a body coloured by its stress."""
    return Colouring("Von Mises stress, deformation", "von Mises stress", "Pa", left_out(drawing, body))


def hardest_text(drawing: Drawing, body: BodyMotion, missing: str) -> str:
    """Return the subtitle of a body at the moment that pictures show, with what its colours leave out."""
    trajectory, strongest, frame = drawing.trajectory, drawing.hardest(body.name), drawing.shown_frame(body)
    if strongest is not None:
        text = style.moment_text(strongest, trajectory)
    else:
        factor, unit = style.time_unit(float(trajectory.frame_times[-1]))
        largest = style.quantity(float(np.linalg.norm(body.elastic(frame), axis=1).max()), "m")
        moment = f"{style.digits(float(trajectory.frame_times[frame]) * factor)} {unit}"
        text = f"largest elastic displacement, {largest}, at {moment}"
    return f"{drawing.scene_name}  ·  body {body.name}: {text}  ·  {missing or style.CAPPED}"
