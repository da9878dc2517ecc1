"""What a command's process leaves out of the libraries that it loads; a notebook's does not.

scipy copies all names of numpy when it is first imported, which loads numpy's interface to Fortran, its tools for tests
and masked arrays; and it renders the documentation of hundreds of its functions anew. No command reads either. Its
splines import one function of its optimisation, which they call to smooth data alone: it is loaded when it is called.
pydantic looks through all installed packages for plugins of its own.
"""

import os
import sys
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.metadata import version
from importlib.util import find_spec
from types import ModuleType
from typing import Any

UNREAD = ("ctypeslib", "f2py", "ma", "matlib", "polynomial", "testing")
"""Modules of numpy that scipy does not use, loaded when they are first named."""
TESTED = ("1.17.",)
"""Versions of scipy whose own modules are known; others are loaded as they are."""


class _Scipy(MetaPathFinder):
    """Finds nothing itself: prepares the way when a module of scipy is about to be loaded."""

    def __init__(self) -> None:
        self.ways = {
            "scipy._lib.array_api_compat.numpy": _hide,
            "scipy._lib._array_api": _leave_documentation,
            "scipy.interpolate._bsplines": _defer_optimisation,
        }

    def find_spec(self, name: str, _path: Any = None, _target: Any = None) -> None:
        """Do what a module needs once, and leave the search to others."""
        if (prepare := self.ways.pop(name, None)) is not None and version("scipy").startswith(TESTED):
            prepare()


class _NoDocumentation(dict[str, list[Any]]):
    """Stands for `scipy._lib._docscrape.FunctionDoc`: the sections of a text, all empty."""

    def __init__(self, *_: Any, **__: Any) -> None:
        super().__init__()

    def __missing__(self, section: str) -> list[Any]:
        return self.setdefault(section, [])

    def __str__(self) -> str:
        return "\n"


class _Optimisation(ModuleType):
    """Stands for `scipy.optimize` until something of it is used."""

    def __getattr__(self, name: str) -> Any:
        """Return a member of the module, which is loaded for it; the splines' own function loads it when called."""
        return _minimum if name == "minimize_scalar" else getattr(_optimisation(), name)


def load_lean() -> None:
    """Make this process load libraries without what no command reads; once scipy is loaded all are left as they are."""
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    if "scipy" not in sys.modules and not any(isinstance(finder, _Scipy) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Scipy())


def _hide() -> None:
    """Leave modules of numpy out of the names that it lists; they can be imported as before."""
    numpy: Any = import_module("numpy")
    numpy.__all__ = [name for name in numpy.__all__ if name not in UNREAD]
    listed = numpy.__dir__
    numpy.__dir__ = lambda: [name for name in listed() if name not in UNREAD]


def _leave_documentation() -> None:
    """Leave scipy's functions without documentation."""
    docscrape: Any = import_module("scipy._lib._docscrape")
    docscrape.FunctionDoc = _NoDocumentation


def _defer_optimisation() -> None:
    """Have `scipy.optimize` loaded when something of it is used."""
    if "scipy.optimize" not in sys.modules and (spec := find_spec("scipy.optimize")) is not None:
        stand = sys.modules["scipy.optimize"] = _Optimisation("scipy.optimize")
        stand.__path__ = list(spec.submodule_search_locations or ())


def _optimisation() -> ModuleType:
    """Return `scipy.optimize` itself."""
    if isinstance(sys.modules["scipy.optimize"], _Optimisation):
        del sys.modules["scipy.optimize"]
    return import_module("scipy.optimize")


def _minimum(*arguments: Any, **options: Any) -> Any:
    """Return what `scipy.optimize.minimize_scalar` does."""
    return _optimisation().minimize_scalar(*arguments, **options)
