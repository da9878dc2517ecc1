"""Ours: `build_model` and `normal_modes`, as the pipeline's stages call them."""

from collections import Counter
from collections.abc import Callable
from functools import wraps
from importlib.metadata import version
from typing import Any

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.linalg import BACKENDS, available_backend
from gudgeon.pipeline.modes.normal import normal_modes
from gudgeon.pipeline.scenes.material import Material
from tests.benchmarks.modes.job import DENSITY, POISSON, YOUNG, Answer, Stopwatch, load_mesh, run

VERIFIED = "residual, orthogonality, inertia count"


def modes(path: str, count: int, watch: Stopwatch) -> Answer:
    """Extract `count` elastic modes."""
    counts = counted(BACKENDS[available_backend()])
    mesh = load_mesh(path)
    record = MeshRecord(mesh.nodes, mesh.cells, "tetra10", {})
    model = build_model(record, Material(E=YOUNG, nu=POISSON, rho=DENSITY))
    watch.lap("assembly")
    found = normal_modes(model, count)
    watch.lap("modes, verified")
    frequencies = [float(w) / 6.283185307179586 for w in found.angular_frequencies]
    answer = Answer(f"gudgeon {version('gudgeon')}", VERIFIED, frequencies, found.quality["residual"])
    size = model.K.shape[0]
    answer.solves = counts["solve", size]
    answer.factorisations = counts["__init__", size] + counts["refactorise", size]
    return answer


def counted(factor: Any) -> Counter[tuple[str, int]]:
    """Make a class of factors count factorisations and right-hand sides solved, by method and number of unknowns.

    A method that another counted one calls is not counted again.
    """
    counts: Counter[tuple[str, int]] = Counter()
    running: list[str] = []

    def watch(name: str, columns: Callable[[Any], int]) -> None:
        method = getattr(factor, name)

        @wraps(method)
        def watched(self: Any, first: Any, *rest: Any, **named: Any) -> Any:
            if not running:
                counts[name, first.shape[0]] += columns(first)
            running.append(name)
            try:
                return method(self, first, *rest, **named)
            finally:
                running.pop()

        setattr(factor, name, watched)

    watch("__init__", lambda matrix: 1)
    watch("solve", lambda loads: loads.size // len(loads))
    if hasattr(factor, "refactorise"):
        watch("refactorise", lambda matrix: 1)
    return counts


if __name__ == "__main__":
    run(modes)
