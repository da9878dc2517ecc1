"""What colours a deformed body, and the texts of its pictures."""

from typing import NamedTuple

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


def hardest_text(drawing: Drawing, body: str, missing: str) -> str:
    """Return the subtitle of a body at its largest contact force, with what its colours leave out."""
    text = style.moment_text(drawing.hardest(body), drawing.trajectory)
    return f"{drawing.scene_name}  ·  body {body}: {text}  ·  {missing or style.CAPPED}"
