"""Files and surfaces that a design change names."""

from pathlib import Path

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.profile import ProfileTable, read_profile
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.reading import find_file


def moved_surface(
    component: Component, folder: Path, name: str, key: str = "profile"
) -> tuple[str, Path | None] | None:
    """Return the surface that a component's profile moves, and its table if any; None without table and offset.

    Args:
        key: The profile's key in the change, for messages.

    Raises:
        InputError: the table is neither in the scene's folder nor in the current one; or no surface is named and the
            component has no interface; or the surface carries a traction space.
    """
    profile, owner = component.change.profile, f"component.{name}.change.{key}"
    path = None if profile.table is None else find_file(profile.table, folder, f"{owner}.table")
    if path is None and profile.offset == 0:
        return None
    surface = profile.surface
    if surface is None:
        if not component.interface:
            raise InputError(
                f"{owner}.surface: is missing; its default is the surface of the first interface, and there is none"
            )
        surface = next(iter(component.interface.values())).surface
    for key, interface in component.interface.items():
        if interface.kind == "traction" and interface.surface == surface:
            raise InputError(
                f"{owner}.surface: '{surface}' carries the traction space interface.{key}, so a profile must not move"
                " it; give the profile to the body that slides over it"
            )
    return surface, path


def deviation_of(
    component: Component, folder: Path, name: str, key: str = "profile"
) -> tuple[str, ProfileTable | float] | None:
    """Return the surface that a component's profile moves, and its deviation [m]; None without table and offset.

    Raises:
        InputError: see `moved_surface` and `read_profile`.
    """
    if (moved := moved_surface(component, folder, name, key)) is None:
        return None
    (surface, path), profile = moved, component.change.profile
    if path is None:
        return surface, profile.offset
    return surface, read_profile(path, profile.scale, profile.offset)
