"""A scene of a wheel with the places where its products go."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import check_scene, merge, named
from gudgeon.pipeline.stages.base import Place
from gudgeon.pipeline.stages.products import Product, component_products, cyclic_product, plot_inputs, wheel_product
from gudgeon.pipeline.wheel.scene import KeptInterface, Wheel, WheelFile, reduction, wrong_names

if TYPE_CHECKING:
    from gudgeon.pipeline.wheel.response import Case

STAGES = ("mesh", "modes", "solve", "plot")
SYMMETRY = {"sectors", "low", "high", "axis", "origin"}
BLADES = {"count", "blade_radius", "response"}
"""Settings of a wheel by what depends on them."""


@dataclass(frozen=True, kw_only=True)
class WheelJob(Place):
    """A scene of a wheel with the places where its products go."""

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

    def mesh(self) -> Product:
        """Return the sector's mesh."""
        return self._sector()["base-mesh"]

    def modes(self) -> Product:
        """Return the modes of the tuned wheel."""
        symmetry = self.wheel.model_dump(mode="json", include=SYMMETRY)
        return cyclic_product(self.scene.only[0], self._sector()["modes"].inputs, symmetry, self.wheel.mode_count)

    def response(self, interface: KeptInterface | None) -> Product:
        """Return the response of the wheel reduced by a choice of kept interface, or of the full one for None."""
        model = {} if interface is None else reduction(self.wheel, interface)
        mistuned = self.wheel.model_dump(mode="json", include=BLADES) | {"changes": list(self.changes)}
        return wheel_product(self.scene.only[0], self.modes().key, mistuned, model)

    def products(self, stages: Sequence[str]) -> dict[str, Product]:
        """Return what some of the stages make, by place."""
        makers: dict[str, tuple[str, Callable[[], Product]]] = {
            "mesh": (f"{self.wheel.component}.mesh", self.mesh),
            "modes": (f"{self.scene.only[0]}.modes", self.modes),
            "solve": ("solve", lambda: self.response(self.wheel.interface)),
        }
        with named(self.path, InputError):
            return {place: make() for stage, (place, make) in makers.items() if stage in stages}

    def pictures(self) -> dict[str, Any]:
        """Return everything that the pictures depend on."""
        return plot_inputs(self.response(self.wheel.interface).key, {})

    def case(self) -> "Case":
        """Return the wheel ready to be solved; its mesh must stand in the database.

        Raises:
            InputError: the scene does not fit its mesh.
        """
        from gudgeon.pipeline.wheel.response import case_of

        mesh = self.store.get(self.mesh().key, "mesh")
        return case_of(mesh, self.component, self.wheel, self.scene.only[0], np.array(self.changes))

    def tuned_frequencies(self) -> tuple[str, ...]:
        """Return where the record of modes has the frequencies of each harmonic."""
        return tuple(f"harmonics/{n}/angular_frequencies" for n in self.wheel.harmonics())

    def changed(self, changes: Mapping[str, Any]) -> "WheelJob":
        """Return the job with nested tables of changes put into its scene."""
        tables = copy.deepcopy(self.tables)
        merge(tables, changes)
        return wheel_job(Place(self.name, self.path, tables, self.store, self.out))

    def _sector(self) -> dict[str, Product]:
        return component_products(self.wheel.component, self.component, self.path.parent)


def wheel_job(place: Place) -> WheelJob:
    """Return the job of a scene of a wheel.

    Raises:
        InputError: the scene is wrong; every mistake of one kind is listed.
    """
    scene = check_scene(place.path, place.tables, WheelFile)
    if lines := wrong_names(scene):
        raise InputError("\n".join(f"{place.path}: {line}" for line in lines))
    name, wheel = scene.only
    with named(place.path, InputError):
        changes = wheel.mistuning.changes(wheel.sectors, place.path.parent, f"wheel.{name}.mistuning")
    return WheelJob(**vars(place), scene=scene, changes=changes)
