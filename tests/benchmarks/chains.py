"""CPU time of a step over the number of bodies: `python -m tests.benchmarks.chains PICTURE` draws chains of bars."""

import sys
import tempfile
from pathlib import Path

from matplotlib.figure import Figure

from tests.benchmarks.test_ports import steps_of_chains

BARS = (10, 20, 50, 100, 150, 200)


def main(picture: str) -> None:
    """Measure, print and draw."""
    with tempfile.TemporaryDirectory() as folder:
        found = steps_of_chains(Path(folder), BARS)
    figure = Figure(figsize=(5, 3.2), layout="constrained")
    axes = figure.subplots()
    print(*(f"{bars}: {1e6 * one:.1f} µs" for bars, one in found.items()), sep="  ")
    axes.plot(list(found), [1e6 * one for one in found.values()], "o-")
    axes.set(xlabel="bars of 41 coordinates", ylabel="CPU time of a step [µs]", xlim=(0, None), ylim=(0, None))
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(sys.argv[1])
