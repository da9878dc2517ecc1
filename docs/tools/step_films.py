"""`python -m docs.tools.step_films FOLDER [NAME ...]`: STEP files that come with gmsh, each from file to impact film.

Prints the commands that a user would type, three for each file, and the size of the film.
"""

import subprocess
import sys
import sysconfig
import time
from pathlib import Path

SOURCE = Path(sysconfig.get_path("data")) / "share/doc/gmsh"
FILES: dict[str, tuple[str, list[str]]] = {
    "component8": ("examples/boolean/component8.step", []),
    "step_boundary_colors": ("examples/api/step_boundary_colors.stp", []),
    "t20_data": ("tutorials/t20_data.step", []),
    "as1-tu-203": ("examples/api/as1-tu-203.stp", ["--solid", "4"]),
}
"""File and options of each by name; of the assembly a bolt."""


def film(name: str, folder: Path) -> None:
    """Run the commands of one file, and print them.

    Raises:
        CalledProcessError: a command failed.
    """
    file, options = FILES[name]
    path = str(SOURCE / file)
    target = f"{name}-scene"
    commands = [["faces", path, *options], ["new", path, *options, "--folder", target], ["run", target]]
    start = time.perf_counter()
    for command in commands:
        print("gudgeon", *command, flush=True)
        subprocess.run(
            [sys.executable, "-m", "gudgeon.pipeline", *command], cwd=folder, check=True, capture_output=True
        )
    found = folder / "out" / target / "scene" / "impact.mp4"
    size, seconds = found.stat().st_size, time.perf_counter() - start
    print(f"{name}: {len(commands)} commands, {seconds:.0f} s, {found} of {size} bytes", flush=True)


def main(arguments: list[str]) -> None:
    """Make the films of the named files, of all without names."""
    folder = Path(arguments[0])
    folder.mkdir(parents=True, exist_ok=True)
    for name in arguments[1:] or FILES:
        film(name, folder)


if __name__ == "__main__":
    main(sys.argv[1:])
