"""A scene file of bodies in contact."""

from pydantic import Field

from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.report import Plot, Report
from gudgeon.pipeline.scenes.robustness import Robustness
from gudgeon.solver.numbers import Name
from gudgeon.solver.scene.scene import Scene


class SceneFile(Scene):
    """A whole scene file."""

    component: dict[Name, Component] = Field(description="Parts, by name; a part may be placed as several bodies")
    report: Report = Report()
    plot: Plot = Plot()
    robustness: Robustness = Robustness()

    def rubbed_of(self, component: str) -> list[str]:
        """Return the interfaces of an elastic component on which a contact of one of its bodies has friction, sorted.

        They need tangential rows. A rigid component needs none: its rigid motion is known everywhere.
        """
        if self.component[component].modes.reduction == "rigid":
            return []
        rubbed = self.rubbed()
        return sorted({name for body in self.body if self.component_of(body) == component for name in rubbed[body]})
