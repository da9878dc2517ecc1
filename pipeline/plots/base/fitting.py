"""Texts of a figure within its border: broken into lines, then smaller, down to the smallest letters of pictures."""

import textwrap

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox

BORDER, FITS = 0.006, 12
"""Least distance of texts from the border, of the figure's width, and how often they are fitted to it."""
LEAST_TEXT = 9.0
"""Size of the smallest text [pt] in a figure 8 in wide: at least 9 pt where a screen of 96 dots per inch shows it
1280 pixels wide."""

LEAST_LINE = 24
"""Characters of a line below which a text is not broken."""


def fit(figure: Figure) -> None:
    """Break texts into lines that would be cut off at the figure's border, except labels of ticks, and make those
    smaller, down to `LEAST_TEXT`, that have nothing to break."""
    canvas = FigureCanvasAgg(figure)
    for _ in range(FITS):
        canvas.draw()
        fitted = []
        for artist, texts in written(figure):
            box = artist.get_window_extent(canvas.get_renderer())
            if (factor := _fitting(figure, box)) < 1:
                breaks = len(texts) == 1 and _too_wide(figure, box)
                fitted += [_fit_text(text, factor, breaks) for text in texts]
        if not any(fitted):
            return


def _too_wide(figure: Figure, box: Bbox) -> bool:
    """Return whether a box [px] is beyond the left or the right border of a figure."""
    width = figure.get_size_inches()[0] * figure.dpi
    return box.x0 < BORDER * width or box.x1 > (1 - BORDER) * width


def _fit_text(text: Text, factor: float, breaks: bool) -> bool:
    """Shorten a text's lines by a factor, or make it smaller, and return whether that was possible.

    Args:
        breaks: Whether its lines may be broken; else it is only made smaller.
    """
    lines = text.get_text().splitlines()
    words = " ".join(lines).replace("  ·  ", "\xa0\xa0·  ")
    length = int(factor * max(map(len, lines)))
    broken = textwrap.wrap(words, max(length, LEAST_LINE), break_long_words=False, drop_whitespace=True)
    if breaks and len(broken) > len(lines) and text.get_rotation() == 0:
        text.set_text("\n".join(line.strip().replace("\xa0\xa0·", "  ·") for line in broken))
        return True
    size = max(float(text.get_fontsize()) * factor, LEAST_TEXT)
    smaller = size < float(text.get_fontsize())
    if smaller:
        text.set_fontsize(size)
    return smaller


def written(figure: Figure) -> list[tuple[Legend | Text, list[Text]]]:
    """Return the legends and the other texts that are seen, but no labels of ticks, with the texts of each."""
    groups: list[tuple[Legend | Text, list[Text]]] = [
        (legend, legend.get_texts()) for legend in figure.findobj(Legend) if isinstance(legend, Legend)
    ]
    grouped = {text for _, texts in groups for text in texts}
    # Labels of ticks, also of those beyond the limits, which are not drawn.
    grouped |= {text for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for text in axis.get_ticklabels()}
    groups += [(text, [text]) for text in figure.findobj(Text) if isinstance(text, Text) and text not in grouped]
    return [group for group in groups if group[0].get_visible() and any(text.get_text().strip() for text in group[1])]


def _fitting(figure: Figure, box: Bbox) -> float:
    """Return the factor at which a box [px] is within the figure's border; 1 if it is there."""
    width, height = figure.get_size_inches() * figure.dpi
    edge = BORDER * width
    outside = max(edge - box.x0, box.x1 - width + edge, edge - box.y0, box.y1 - height + edge)
    return 1.0 if outside <= 0 else max(0.5, 1 - (outside + 1) / max(box.width, box.height))
