"""Tables and pictures of surfaces of contacts that wear over cycles."""

from typing import Any

import numpy as np

from gudgeon.pipeline.applications.wear.cycles import History
from gudgeon.pipeline.applications.wear.shapes import Shapes
from gudgeon.pipeline.applications.wear.surfaces import AGAINST, Rubbed, Surfaces
from gudgeon.pipeline.files import csv_text, write_text

DIGITS = 9
PICTURE = "wear-{}.png"
SPACE = "wear-{}-against.csv"


def against_depth(rubbed: Rubbed, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the depth of a traction space [m], (a, h), at angles [rad], (a,), and heights [m], (h,), of its knots.

    On a plane angles are coordinates across [m].
    """
    space = rubbed.space
    across, along = (int(count) for count in space.counts)
    values = coefficients.reshape(across, along)
    for _ in range(2):  # Cubic B-splines are (1, 4, 1)/6 at their knots.
        values = ((values[:-2] + 4 * values[1:-1] + values[2:]) / 6).T
    u, v = (space.start[i] + space.spacing[i] * np.arange(space.counts[i] - 2) for i in range(2))
    if space.chart["kind"] == "cylinder":
        u = u / space.chart["radius"] + space.chart["middle"]
    return values, u, v


def surface_sizes(scene: Surfaces, shapes: Shapes) -> dict[str, Any]:
    """Return volume [m³], largest depth [m] and its angle [rad] and height [m] of each surface, by contact and side."""
    sizes: dict[str, Any] = {}
    for name, surface in scene.rubbed.items():
        depths = shapes[name][0, 0]
        worst = int(depths.argmax())
        angle, height = surface.places[worst]
        sizes[name] = {"own": {"volume": float(depths @ surface.areas), "depth": float(depths.max()),
                               "angle": float(angle), "height": float(height)}}  # fmt: skip
        if surface.space is not None:
            coefficients = shapes[name + AGAINST][0, 0]
            map_, angles, heights = against_depth(surface, coefficients)
            i, j = np.unravel_index(int(map_.argmax()), map_.shape)
            sizes[name]["against"] = {"volume": float(coefficients.sum()) * surface.cell, "depth": float(map_.max()),
                                      "angle": float(angles[i]), "height": float(heights[j])}  # fmt: skip
    return sizes


def surface_rows(scene: Surfaces, marks: dict[float, Shapes]) -> list[list[str]]:
    """Return the table of depths: place, area and depths of each contact point, a row for each."""
    columns: list[tuple[str, np.ndarray]] = []
    for name, surface in scene.rubbed.items():
        columns += [(f"{name}.{axis} [m]", surface.points[:, n]) for n, axis in enumerate("xyz")]
        columns.append((f"{name}.area [m^2]", surface.areas))
        columns += [(f"{name} after {cycles:.{DIGITS}g} cycles [m]", shapes[name][0, 0])
                    for cycles, shapes in sorted(marks.items())]  # fmt: skip
    longest = max(len(values) for _, values in columns)
    texts = [[head, *(f"{x:.{DIGITS}g}" for x in values)] + [""] * (longest - len(values)) for head, values in columns]
    return [list(row) for row in zip(*texts, strict=True)]


def surface_words(scene: Surfaces) -> dict[str, Any]:
    """Return what changes of the geometry cost and neglect, by component."""
    return {
        "components": {
            name: {"surface": profile.surface, "recomputed": scene.recomputed,
                   "estimate": scene.estimates.get(name, 0.0), "mismatch": profile.mismatch}
            for name, profile in scene.profiles.items()
        }
    }  # fmt: skip


def surface_pictures(scene: Surfaces, history: History) -> list[str]:
    """Draw a picture for each contact, and write profile tables of the worn bodies and depths of traction spaces."""
    if not history.updates:
        return []
    from gudgeon.pipeline.applications.wear.picture import WornSurface, draw_surface

    update, names = history.updates[-1], []
    for component, profile in scene.profiles.items():
        depths_of = {name: update.shapes[name][0, 0] for name, s in scene.rubbed.items() if s.component == component}
        if any(depths.any() for depths in depths_of.values()):
            path = profile.write(depths_of, scene.job.out, f"{component}.csv")
            names.append(path.relative_to(scene.job.out).as_posix())
    for name, surface in scene.rubbed.items():
        course = [(each.cycles, float(each.shapes[name].max()), each.difference) for each in history.updates]
        against = None
        if surface.space is not None and surface.wear.against_coefficient:
            against = against_depth(surface, update.shapes[name + AGAINST][0, 0])
            names.append(SPACE.format(name))
            rows = [["height [m]", *(f"{angle:.{DIGITS}g}" for angle in against[1])]]
            rows += [[f"{z:.{DIGITS}g}", *(f"{x:.{DIGITS}g}" for x in row)]
                     for z, row in zip(against[2], against[0].T, strict=True)]  # fmt: skip
            write_text(scene.job.out / names[-1], csv_text(rows))
        names.append(PICTURE.format(name))
        shown = WornSurface(scene.job.name, name, surface.places, update.shapes[name][0, 0], against, course)
        draw_surface(scene.job.out / names[-1], shown)
    return names
