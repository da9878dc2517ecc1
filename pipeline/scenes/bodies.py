"""A scene file of bodies in contact."""

from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.report import Plot, Report
from gudgeon.pipeline.scenes.robustness import Robustness
from gudgeon.solver.numbers import Name
from gudgeon.solver.scene.scene import Scene


class SceneFile(Scene):
    """A whole scene file."""

    component: dict[Name, Component]
    report: Report = Report()
    plot: Plot = Plot()
    robustness: Robustness = Robustness()
