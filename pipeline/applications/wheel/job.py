"""The job of a scene of a wheel: its checked scene and its products."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gudgeon.pipeline.applications.wheel.scene import KeptInterface, Wheel, WheelFile, reduction, wrong_names
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import check_scene, merged, named, refuse
from gudgeon.pipeline.stages.base import Place, SceneJob
from gudgeon.pipeline.stages.keys.products import Product, component_products, plot_inputs, product

if TYPE_CHECKING:
    from gudgeon.pipeline.applications.wheel.response import Case

STAGES = ("mesh", "modes", "solve", "plot")
SYMMETRY = {"sectors", "low", "high", "axis", "origin"}
BLADES = {"count", "blade_radius", "response"}
"""Settings of a wheel that its modes depend on, and those that its response depends on besides."""
QUANTITIES = (
    "magnification", "amplitude.tuned", "amplitude.mistuned", "amplitude.mistuned.at", "amplitude.mistuned.blade",
    "reduction.frequency_error",
)  # fmt: skip
"""Names of the quantities of a run."""


@dataclass(frozen=True, kw_only=True)
class WheelJob(SceneJob):
    """A checked scene of a wheel, with the places where its products go."""

    kind: ClassVar[str] = "wheel"
    stages: ClassVar[tuple[str, ...]] = STAGES

    scene: WheelFile
    changes: tuple[float, ...]
    """Relative change of each blade's stiffness, (N,)."""

    @property
    def wheel(self) -> Wheel:
        """Its only wheel."""
        return self.scene.only[1]

    @property
    def component(self) -> Component:
        """The sector."""
        return self.scene.component[self.wheel.component]

    def quantities(self) -> Sequence[str]:
        """See `SceneJob`."""
        return QUANTITIES

    def mesh(self) -> Product:
        """Return the sector's mesh."""
        return self._sector()["base-mesh"]

    def modes(self) -> Product:
        """Return the modes of the tuned wheel."""
        inputs = self._sector()["modes"].inputs
        symmetry = self.wheel.model_dump(mode="json", include=SYMMETRY)
        parameters = {key: inputs[key] for key in ("mesh", "material", "supports")}
        parameters |= {"symmetry": symmetry, "mode_count": self.wheel.mode_count}
        return product("cyclic", self.scene.only[0], parameters)

    def response(self, interface: KeptInterface | None) -> Product:
        """Return the response of the wheel reduced by a choice of kept interface, or of the full wheel for None."""
        model = {} if interface is None else reduction(self.wheel, interface)
        mistuned = self.wheel.model_dump(mode="json", include=BLADES) | {"changes": list(self.changes)}
        return product("wheel", self.scene.only[0], {"modes": self.modes().key, "wheel": mistuned, "model": model})

    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        makers: dict[str, tuple[str, Callable[[], Product]]] = {
            "mesh": (f"{self.wheel.component}.mesh", self.mesh),
            "modes": (f"{self.scene.only[0]}.modes", self.modes),
            "solve": ("solve", lambda: self.response(self.wheel.interface)),
        }
        with named(self.path, InputError):
            return {place: make() for stage, (place, make) in makers.items() if stage in stages}

    def pictures(self) -> dict[str, Any]:
        return plot_inputs(self.response(self.wheel.interface).key, {})

    def case(self) -> "Case":
        """Return the wheel ready to be solved; its mesh must be in the database.

        Raises:
            InputError: the scene does not fit its mesh.
        """
        from gudgeon.pipeline.applications.wheel.response import case_of

        mesh = self.store.get(self.mesh().key, "mesh")
        return case_of(mesh, self.component, self.wheel, self.scene.only[0], np.array(self.changes))

    def tuned_frequencies(self) -> tuple[str, ...]:
        """Return the fields of the record of modes that hold the frequencies of each harmonic."""
        return tuple(f"harmonics/{n}/angular_frequencies" for n in self.wheel.harmonics())

    def changed(self, changes: Mapping[str, Any]) -> "WheelJob":
        """Return the job of the scene changed by nested tables; raises InputError as `wheel_job` does."""
        tables = merged(self.tables, changes)
        return wheel_job(Place(self.name, self.path, tables, self.store, self.out))

    def _sector(self) -> dict[str, Product]:
        return component_products(self.wheel.component, self.component, self.path.parent)


def wheel_job(place: Place) -> WheelJob:
    """Return the job of a scene of a wheel; raises InputError with every mistake of one kind listed."""
    scene = check_scene(place.path, place.tables, WheelFile)
    refuse(place.path, wrong_names(scene))
    name, wheel = scene.only
    with named(place.path, InputError):
        changes = wheel.mistuning.changes(wheel.sectors, place.path.parent, f"wheel.{name}.mistuning")
    return WheelJob(**vars(place), scene=scene, changes=changes)
