"""What notes are written of: the parts of a scene, and a scene of bodies with its run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.result import Result

FIELDS = ("angular_frequencies", "residuals", "algebraic_errors", "discretisation_errors", "quality")
"""Fields of a modal record that are read."""


@dataclass(frozen=True)
class Parts:
    """The meshed components of a scene of any kind."""

    store: Store
    components: Mapping[str, Component]
    meshes: Mapping[str, str]
    """Key of the mesh of each."""


@dataclass(frozen=True)
class Facts(Parts):
    """What is known of a scene of bodies."""

    job: Job
    summary: Mapping[str, Any] = field(default_factory=dict)
    """Of its run: result, quantities, counts, estimates and energy drift; empty before it ran."""

    @property
    def scene(self) -> SceneFile:
        """The checked scene."""
        return self.job.scene

    @property
    def finished(self) -> bool:
        """Whether its run reached the end."""
        return self.summary["result"] == Result.FINISHED.name

    @cached_property
    def modes(self) -> dict[str, ModalRecord]:
        """Frequencies and errors of the modes of each component whose record exists."""
        keys = {name: steps["modes"].key for name, steps in self.job.components().items()}
        return {name: self.store.get(key, "modes", only=FIELDS) for name, key in keys.items() if self.store.has(key)}

    def last_force(self, contact: str) -> float:
        """Return the size of a contact's force in the last sample of the run over that of its largest one."""
        record = self.store.get(self.job.trajectory().key, "trajectory", only=[f"contacts/{contact}/force"])
        sizes = np.linalg.norm(record.contacts[contact].force, axis=1)
        return float(sizes[-1] / sizes.max()) if sizes.any() else 0.0


def facts_of(job: Job, summary: Mapping[str, Any] | None = None) -> Facts:
    """Return what is known of a job, with the summary of its run if there is one."""
    meshes = {name: steps["mesh"].key for name, steps in job.components().items()}
    return Facts(job.store, job.used(), meshes, job, summary or {})
