"""The scene under test of `gudgeon robustness`, with its results without any change."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.robustness.evidence import Evidence, FirstContact, Refusal
from gudgeon.pipeline.robustness.trial import Trial
from gudgeon.solver.scene.scene import Scene

NO_CONTACT = "no contact occurs in the scene"
ALL_RIGID = "all bodies are rigid"
AUTOMATIC = {"integrator": "auto", "step": "unset", "accuracy": "unset"}
"""Changes of `run` by which the program chooses integrator and steps."""


class DoesNotApply(Exception):
    """A case does not apply to a scene; the text is the reason."""


def require(condition: object, reason: str) -> None:
    """Raise DoesNotApply with a reason unless a condition of a case holds."""
    if not condition:
        raise DoesNotApply(reason)


@dataclass(frozen=True)
class Subject:
    """The scene under test, with its results without any change."""

    job: Any
    """Its job, of any kind, with the duration of the cases."""
    meshes: Mapping[str, MeshRecord]
    """Mesh of each component in use, before any change."""
    run: Callable[[Trial, Path], Evidence | Refusal]
    """Runs a trial with a folder for temporary files."""
    changed: Callable[[Mapping[str, Any]], Any]
    """Returns the job of the scene changed by nested tables."""
    known: dict[str, Any] = field(default_factory=dict)
    """Values that cases share: numbers of points and coordinates, integrator and step."""
    base: Evidence = field(default_factory=Evidence)
    """Evidence of the unchanged scene."""
    folder: Path = Path()
    """Folder for the files of a case."""
    operations: Mapping[str, Callable[["Subject", Any], Trial]] = field(default_factory=dict)
    """What operations of cases do to this kind of scene, where it is not what they do to bodies."""

    @property
    def scene(self) -> Any:
        return self.job.scene

    @property
    def contacts(self) -> dict[str, Any]:
        """Its contacts; a wheel has none."""
        return getattr(self.scene, "contact", {})

    @property
    def bodies(self) -> dict[str, Any]:
        """Its bodies; a wheel is one."""
        return getattr(self.scene, "body", {"wheel": None})

    @property
    def turns(self) -> bool:
        """Whether its bodies turn by any angle."""
        scene = self.scene
        return isinstance(scene, Scene) and bool(scene.carriers()) and scene.capabilities.turns

    @property
    def joints(self) -> dict[str, Any]:
        """Its joints; a wheel has none."""
        return getattr(self.scene, "joint", {})

    @property
    def first_body(self) -> str:
        """Name of the body of its first contact."""
        return next(iter(self.contacts.values())).body

    def elastic(self) -> list[str]:
        """Return the components in use that deform."""
        components = self.scene.component
        return [
            n for n in self.meshes if components[n].material is not None and components[n].modes.reduction != "rigid"
        ]

    def contact(self) -> FirstContact:
        """Return the first contact of the unchanged scene.

        Raises:
            DoesNotApply: there is none.
        """
        if self.base.contact is None:
            raise DoesNotApply(NO_CONTACT)
        return self.base.contact
