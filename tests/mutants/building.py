"""Builds the checked core with all native faults in a copy of its sources: `GUDGEON_FAULT` is the number that holds."""

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.mutants.fault import Fault

ROOT = Path(__file__).resolve().parents[2]
VARIABLE = "GUDGEON_FAULT"
CHOICE = f"""
#include <cstdlib>
namespace gudgeon {{
inline const long fault = std::getenv("{VARIABLE}") ? std::atol(std::getenv("{VARIABLE}")) : 0;
}}
"""
"""What the faults read, before all else in view.hpp."""


def built(folder: Path, numbered: Sequence[tuple[int, Fault]]) -> Path:
    """Return the path of the compiled module; what an edit does not concern is not compiled again."""
    kinds = ("*.hpp", "*.cpp", "solver/core/CMakeLists.txt", "solver/core/sources.py")
    listed = subprocess.run(["git", "ls-files", *kinds], capture_output=True, text=True, check=True, cwd=ROOT)
    for name in listed.stdout.split():
        text = (ROOT / name).read_text()
        for number, fault in numbered:
            if fault.file == name:
                text = text.replace(fault.old, f"(::gudgeon::fault == {number} ? ({fault.new}) : ({fault.old}))")
        if name == "solver/core/view.hpp":
            text = text.replace("#pragma once", f"#pragma once\n{CHOICE}", 1)
        copy = folder / "sources" / name
        if not copy.exists() or copy.read_text() != text:
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(text)
    programs = Path(sys.executable).parent
    subprocess.run([programs / "cmake", "-S", folder / "sources/solver/core", "-B", folder / "build", "-G", "Ninja",
                    "--log-level=WARNING", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_MAKE_PROGRAM={programs / 'ninja'}",
                    f"-DPython_EXECUTABLE={sys.executable}"], check=True, stdout=subprocess.DEVNULL)  # fmt: skip
    subprocess.run([programs / "ninja", "--quiet", "-C", folder / "build", "_checked"], check=True)
    (module,) = (folder / "sources/solver/core").glob("_checked.*.so")
    return module


def remove(folder: Path) -> None:
    """Remove what was built."""
    shutil.rmtree(folder, ignore_errors=True)
