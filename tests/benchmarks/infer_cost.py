"""`python -m tests.benchmarks.infer_cost [SAMPLES]`: time of `gudgeon infer` per sample on one core."""

import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from gudgeon.pipeline.applications.sensing.calibration import calibrated, write_calibration
from gudgeon.pipeline.applications.sensing.job import infer
from gudgeon.pipeline.scenes.gauge import WRENCH
from tests.scenes import reference

NAMES = [f"{side}{spoke}" for spoke in range(4) for side in ("top", "side")]


def main(samples: int = 200_000) -> None:
    """Print the time per sample of eight channels, the best of three."""
    A = np.array(reference("base-sensor/J1_spoked_plate.json")["strain_per_wrench_8x6_solid3D"])
    channels = [{"name": name, "wiring": "quarter", "gauges": []} for name in NAMES]
    signals = 1e-4 * np.random.default_rng(0).standard_normal((samples, 8))
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write_calibration(folder / "c.json", calibrated(channels, WRENCH, A, np.zeros(8), {}, {}))
        np.savetxt(folder / "s.csv", signals, fmt="%.9g", delimiter=",", header=",".join(NAMES), comments="")
        runs = [infer(folder / "c.json", folder / "s.csv", None) for _ in range(3)]
    best, product = min(one.seconds for one in runs) / samples, min(one.product for one in runs) / samples
    print(
        f"{samples} samples: {1e6 * best:.2f} µs each ({1e-3 / best:.0f} kHz), {1e6 * product:.3f} µs of it the product"
    )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
