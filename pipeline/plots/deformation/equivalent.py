"""Texts of pictures of a deformed body."""

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing

DISPLACEMENT = ("Elastic deformation", "elastic displacement", "m")
STRESS = ("Von Mises stress, deformation", "von Mises stress", "Pa")
"""Title, name and unit of the values that colour a deformed body."""


def hardest_text(drawing: Drawing, body: str) -> str:
    """Return the subtitle of a body at its largest contact force."""
    text = style.moment_text(drawing.hardest(body), drawing.trajectory)
    return f"{drawing.scene_name}  ·  body {body}: {text}  ·  {style.CAPPED}"
