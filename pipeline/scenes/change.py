"""Files and surfaces that a design change names."""

from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.component import Component, Profile
from gudgeon.pipeline.scenes.reading import find_file


def table_path(profile: Profile, folder: Path, name: str) -> Path | None:
    """Return the path of a profile's table, in the scene's folder or the current one; None if it has none.

    Raises:
        InputError: it is in neither folder.
    """
    return None if profile.table is None else find_file(profile.table, folder, f"component.{name}.change.profile.table")


def profile_surface(component: Component, name: str) -> str:
    """Return the surface that a component's profile moves.

    Raises:
        InputError: none is named and the component has no interface, or the surface carries a traction space.
    """
    where, surface = f"component.{name}.change.profile.surface", component.change.profile.surface
    if surface is None:
        if not component.interface:
            raise InputError(
                f"{where}: is missing; its default is the surface of the first interface, and there is none"
            )
        surface = next(iter(component.interface.values())).surface
    for key, interface in component.interface.items():
        if interface.kind == "traction" and interface.surface == surface:
            raise InputError(
                f"{where}: '{surface}' carries the traction space interface.{key}, so a profile must not move it; give"
                " the profile to the body that slides over it"
            )
    return surface
