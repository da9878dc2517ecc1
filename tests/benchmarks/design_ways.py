"""`python -m tests.benchmarks.design_ways`: what modes from stored designs cost and how wrong they are, by way.

CPU seconds of one thread over those of new modes: of the way, with its estimate, and with the inertia count; assembly
of stiffness and mass and the search for interfaces apart. For liner and piston of data/piston/coarse.toml as that scene
reduces them; errors of the largest of all frequencies, of the compliance under smooth pressures and loads, and of a
row's own flexibility.
"""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import ModalRecord
from gudgeon.pipeline.design_change import ways
from gudgeon.pipeline.design_change.compliance import largest_change
from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.morph import Movement, moved_mesh
from gudgeon.pipeline.design_change.projection import Target
from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.reduction.acting import assembled, stacked
from gudgeon.pipeline.reduction.couplings import weights_along
from gudgeon.pipeline.reduction.methods import ContactRows
from gudgeon.pipeline.reduction.methods.carried import target_of
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.reduce import reduce_component
from gudgeon.pipeline.scenes.component import Change, Component
from gudgeon.pipeline.stages.mesh import build_mesh

SCENE = Path(__file__).resolve().parents[2] / "data/piston/coarse.toml"
PARTS = {"liner": ("outer", 0.006), "piston": ("skirt", 0.004)}
"""Surface that moves, and the length of which changes are shares [m]: the wall, and a third of that of the piston."""
SHARES = (0.01, 0.03, 0.07)
STORED = {"1": (0.0,), "2": (-0.1, 0.1), "3": (0.0, -0.1, 0.1)}
STARTS = {"1": ("reuse", "project", "inverse", "factor"), "2": ("project", "inverse"), "3": ("project",)}
"""Ways that are measured, by the number of stored designs."""
HEAD = (
    "| part | change | way | cost | certified | counted | frequency | compliance | row |\n"
    "|---|---|---|---|---|---|---|---|---|"
)


class Bench:
    """A part of the scene and its designs."""

    def __init__(self, name: str) -> None:
        job, self.name = open_job(SCENE), name
        self.requested = job.scene.reduced_with(name)
        component = job.scene.component[name].model_copy(update={"change": Change(update="certified")})
        self.component, self.stored = component, component.stored_designs[0]
        assert component.material is not None
        self.material = component.material
        self._base = build_mesh(component, job.folder, name)

    def mesh(self, share: float) -> MeshRecord:
        """Return the mesh of a design."""
        surface, length = PARTS[self.name]
        return moved_mesh(self._base, Movement(surface, share * length, "here")) if share else self._base

    def body(self, share: float, component: Component) -> tuple[Target, ContactRows]:
        """Return the body of a design and its rows."""
        _, acting, (_, model, spread) = assembled(self.mesh(share), component, self.name, self.requested["rubbed"])
        rows = replace(stacked(acting, spread), weights=weights_along(model, self.requested["pulled"]))
        return target_of(model, rows, component.modes.normal_count), rows

    def record(self, share: float) -> ModalRecord:
        """Return the modes of a stored design."""
        return reduce_component(self.mesh(share), "", self.stored, self.name, **self.requested)


def errors(
    target: Target, answer: ways.Answer, truth: tuple[np.ndarray, np.ndarray], columns: dict[str, Any]
) -> list[float]:
    """Return the largest errors of frequencies, smooth compliance and rows."""
    C, (exact, exact_C) = answer.flexibility, truth
    compliances = []
    for ends in columns.values():
        loads = target.loads[:, slice(*ends)]
        before, after = (loads.T @ matrix @ loads for matrix in (C, exact_C))
        compliances.append(abs(largest_change(after - before, before)))
    frequencies = np.sqrt(answer.reduced.values[: target.count]) / exact - 1
    rows = np.abs(C.diagonal() / exact_C.diagonal() - 1)
    return [float(np.abs(frequencies).max()), max(compliances), float(rows.max())]


def compared(bench: Bench, share: float, families: dict[str, Family], columns: dict[str, Any]) -> None:
    """Print the lines of a design."""
    target, rows = bench.body(share, bench.component)
    start = time.process_time()
    exact = macneal(target.model, rows, bench.component.modes)
    cost = time.process_time() - start
    at_rows = (rows.B @ exact.Phi) / exact.angular_frequencies
    truth = exact.angular_frequencies[: target.count], exact.residual_flexibility + at_rows @ at_rows.T
    for count, family in families.items():
        search = ways.Search(target, family, columns, np.inf)
        family.first_order(target)
        begin = time.process_time()
        family.first_order(target)
        first_order = time.process_time() - begin
        if count == "1":
            print(f"{bench.name}, {share:.0%}: first-order estimate {first_order / cost:.1e} of new modes")
        for name in STARTS[count]:
            way, total = ways.WAYS[name], 0.0
            for step in range(2 if name == "inverse" else 1):
                begin = time.process_time()
                answer = way.answer(search)
                taken = total + time.process_time() - begin
                if answer is None:
                    continue
                ways.certified(search, answer)
                total += time.process_time() - begin
                begin = time.process_time()
                ways.complete(search)
                counted = total + time.process_time() - begin
                method = f"`{name}`, {step + 1} steps" if name == "inverse" else f"`{name}`, {count} stored"
                figures = " | ".join(f"{value:.0e}" for value in errors(target, answer, truth, columns))
                costs = " | ".join(f"{seconds / cost:.2f}" for seconds in (taken, total, counted))
                print(f"| {bench.name} | {share:.0%} | {method} | {costs} | {figures} |")


def main() -> None:
    """Print the table, and what assembly and new modes cost."""
    print(HEAD)
    for name in PARTS:
        bench = Bench(name)
        records = {share: bench.record(share) for share in STORED["3"]}
        responses = records[0.0].static_responses
        columns = {} if responses is None else responses.columns
        families = {}
        for count, shares in STORED.items():
            targets = [bench.body(share, bench.stored)[0] for share in shares]
            families[count] = Family(targets, [records[share] for share in shares], bench.material)
            ways.projected(ways.Search(targets[0], families[count]))
        for share in SHARES:
            compared(bench, share, families, columns)
        start = time.process_time()
        target, rows = bench.body(SHARES[0], bench.component)
        assembly = time.process_time() - start
        start = time.process_time()
        macneal(target.model, rows, bench.component.modes)
        print(f"{name}: assembly with interfaces {assembly:.3f} s, new modes {time.process_time() - start:.3f} s")


if __name__ == "__main__":
    main()
