"""A command's process loads scipy without what no command reads, and works with the rest of it."""

import json
import subprocess
import sys
from typing import Any

import pytest

LOAD = "from gudgeon.pipeline.cli.lean import load_lean; load_lean(); load_lean()\n"
SHOW = """
import json, sys
import numpy, scipy.fft, scipy.interpolate, scipy.linalg, scipy.spatial, scipy.special
loaded = sorted(sys.modules)
x = numpy.linspace(0, 1, 5)
spline = scipy.interpolate.make_interp_spline(x, x**3)
found = [float(spline(0.3)), float(scipy.special.erf(0.3)), float(scipy.linalg.det([[2.0, 1.0], [1.0, 2.0]])),
         float(scipy.spatial.KDTree([[0.0], [1.0]]).query([0.7])[0]), float(abs(scipy.fft.fft([1.0, 2.0])[1]))]
import scipy.stats
shared = [one.__name__ for one in (numpy.f2py, numpy.ma, numpy.testing)]
finders = sum(type(one).__name__ == "_Scipy" for one in sys.meta_path)
print(json.dumps({"loaded": loaded, "found": found, "documented": bool((scipy.fft.fft.__doc__ or "").strip()),
                  "shared": shared, "finders": finders}))
"""


def shown(code: str) -> Any:
    """Return what a process of its own prints as JSON."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_scipy_is_loaded_without_what_no_command_reads_and_works() -> None:
    lean, whole = shown(LOAD + SHOW), shown(SHOW)
    assert {"numpy.f2py", "numpy.testing"} <= set(whole["loaded"]) - set(lean["loaded"])
    assert not lean["documented"]
    assert whole["documented"]
    assert (lean["finders"], whole["finders"]) == (1, 0)
    assert lean["found"] == whole["found"]
    assert lean["found"] == pytest.approx([0.027, 0.3286267594591274, 3.0, 0.3, 1.0])
    assert lean["shared"] == ["numpy.f2py", "numpy.ma", "numpy.testing"]


def test_a_process_that_has_scipy_is_left_alone() -> None:
    code = "import scipy.linalg, sys\n" + LOAD + "print(sum(type(one).__name__ == '_Scipy' for one in sys.meta_path))"
    assert shown(code) == 0


def test_another_scipy_is_loaded_as_it_is() -> None:
    """Its modules may differ, and nothing of theirs is replaced."""
    other = "import importlib.metadata\nimportlib.metadata.version = lambda name: '9.0'\n"
    assert shown(other + LOAD + SHOW)["documented"]


SPLINES = """
import json, sys
import numpy, scipy.interpolate
before = "scipy.optimize._minimize" in sys.modules
{use}
print(json.dumps([before, found, "scipy.optimize._minimize" in sys.modules]))
"""
USES = {
    "a spline that smooths": "x = numpy.linspace(0, 1, 20); y = numpy.sin(9 * x) + 0.1 * numpy.cos(99 * x)\n"
    "found = float(scipy.interpolate.make_smoothing_spline(x, y)(0.3))",
    "a name": "from scipy.optimize import brentq; found = brentq(lambda x: x**3 - 8, 0, 3)",
    "the module": "import scipy.optimize as o; found = o.brentq(lambda x: x**3 - 8, 0, 3)",
    "scipy alone": "import scipy; found = scipy.optimize.brentq(lambda x: x**3 - 8, 0, 3)",
    "a module of it": "import scipy.optimize._nnls as n; import scipy.optimize as o; found = float(n.nnls is o.nnls)",
}


@pytest.mark.parametrize("use", USES.values(), ids=USES)
def test_splines_leave_optimisation_until_it_is_used(use: str) -> None:
    lean, whole = (shown(load + SPLINES.format(use=use)) for load in (LOAD, ""))
    assert whole[0]
    assert not lean[0]
    assert lean[1:] == whole[1:]
    assert lean[2]


def test_pydantic_looks_for_no_plugins() -> None:
    code = "import json, os\n" + LOAD + "print(json.dumps(os.environ.get('PYDANTIC_DISABLE_PLUGINS')))"
    assert shown(code) == "__all__"
