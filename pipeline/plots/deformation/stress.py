"""`stress.png` of a solid body: the equivalent stress after von Mises on the surfaces that its gauges read, at the
strongest contact, on the deformed body."""

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.run import Drawing
from gudgeon.pipeline.plots.deformation.equivalent import equivalent_stress, reads_stress
from gudgeon.pipeline.plots.deformation.solid import TRIANGLES, Coloured, drawable, picture, strongest_moment

TITLE = "Stress after von Mises, deformation × {scale:g}"


def draw_stress(drawing: Drawing) -> None:
    """Draw one picture for each solid body that was touched and has a gauge of stress on a surface."""
    found = [(name, body) for name, body in drawable(drawing) if reads_stress(drawing, body)]
    for name, body in found:
        stress = equivalent_stress(drawing, body, drawing.strongest_frame(name))
        moment = strongest_moment(drawing, body, TRIANGLES, {"stress": stress})
        coloured = Coloured(moment.skin.take("stress"), "Pa", "von Mises stress", TITLE)
        style.draw(drawing.file("stress.png", name, len(found)), picture, drawing, moment, coloured)
