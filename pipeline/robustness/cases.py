"""The cases of `gudgeon robustness`: the shipped ones, those of a file, and the scene's own."""

from pathlib import Path

from pydantic import Field

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.reading import check_scene, read_tables
from gudgeon.pipeline.scenes.robustness import Case, Robustness
from gudgeon.solver.numbers import Strict

SHIPPED = Path(__file__).with_name("cases.toml")


class CaseFile(Strict):
    """A file of cases."""

    case: dict[str, Case] = Field(min_length=1)


def read_cases(path: Path) -> dict[str, Case]:
    """Read a file of cases; raises InputError with every mistake listed."""
    return check_scene(path, read_tables(path), CaseFile).case


def chosen_cases(settings: Robustness, file: Path | None, only: tuple[str, ...], scene: Path) -> dict[str, Case]:
    """Return the shipped cases with those of the file and the scene, or only the cases and groups named in `only`.

    Raises:
        InputError: a name is unknown, or the file is wrong; `scene` is the path for the message.
    """
    cases = read_cases(SHIPPED) | (read_cases(file) if file is not None else {}) | settings.case
    groups = list(dict.fromkeys(case.group for case in cases.values()))
    if unknown := [name for name in only if name not in cases and name not in groups]:
        raise InputError(
            f"{scene}: --only {unknown[0]}: no such case or group; groups are {', '.join(groups)}; cases are"
            f" {', '.join(cases)}"
        )
    return {name: case for name, case in cases.items() if not only or name in only or case.group in only}
