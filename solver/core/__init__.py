"""The native core: time loops and their contact response, compiled for two levels of instructions.

`GUDGEON_CORE=baseline` picks another module than the processor's best. So do `checked`, which ends a process with file
and line where an index is wrong, and `sanitized`; CONTRIBUTING.md says how they are built.
"""

import importlib
import os
import platform
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gudgeon.solver.errors import SolverError

LEVELS = ("v3", "baseline", "checked", "sanitized")
NEEDED = frozenset({"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"})
"""Flags of a processor that has x86-64-v3."""
REMEDY = "; run 'make core' in the checkout, or install gudgeon again; 'gudgeon doctor' checks the rest"
"""What is to be done where the module of a level cannot be loaded."""


def best_level(processors: Path = Path("/proc/cpuinfo")) -> str:
    """Return the highest level of instructions that this processor has."""
    if platform.machine() not in ("x86_64", "AMD64") or not processors.exists():
        return "baseline"
    with processors.open() as lines:
        flags = next((line for line in lines if line.startswith("flags")), "")
    return "v3" if set(flags.split()) >= NEEDED else "baseline"


def _module() -> tuple[str, Any]:
    level = os.environ.get("GUDGEON_CORE") or best_level()
    if level not in LEVELS:
        raise SolverError(f"GUDGEON_CORE: {level!r} is not one of {', '.join(LEVELS)}")
    try:
        return level, importlib.import_module(f"{__name__}._{level}")
    except ModuleNotFoundError as error:
        if error.name != f"{__name__}._{level}":
            raise
        raise SolverError(f"native core: _{level} is not compiled{REMEDY}") from None
    except ImportError as error:
        raise SolverError(f"native core: _{level} does not load: {error}{REMEDY}") from error


level, module = _module()
if TYPE_CHECKING:
    from _baseline import *  # noqa: F403  # The build writes its types.
else:

    def __getattr__(name: str) -> Any:
        """Return what the module has: `core.Small` and the like."""
        return getattr(module, name)
