"""Texts of pictures of a deformed body."""

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.base.stress import left_out

Text = tuple[str, str, str, str]
"""Title, name and unit of the values that colour a deformed body, and what they lack, empty if nothing."""
DISPLACEMENT: Text = ("Elastic deformation", "elastic displacement", "m", "")


def stress_text(drawing: Drawing, body: BodyMotion) -> Text:
    """Return the text of a body coloured by its stress."""
    return "Von Mises stress, deformation", "von Mises stress", "Pa", left_out(drawing, body)


def hardest_text(drawing: Drawing, body: str, lacks: str) -> str:
    """Return the subtitle of a body at its largest contact force, with what its values lack."""
    text = style.moment_text(drawing.hardest(body), drawing.trajectory)
    return f"{drawing.scene_name}  ·  body {body}: {text}  ·  {lacks or style.CAPPED}"
