"""Documents of reports made up for tests: small, large, and with names that bite."""

import math
from typing import Any

from gudgeon.pipeline.process.clock import Seconds
from gudgeon.pipeline.report.document import Budget, Chain, Choice, Document, Quantity, Run, StageSeconds, Table, Term
from gudgeon.pipeline.report.front import with_front

BITING = """</script><script>throw new Error("injected")</script> & "quoted" <b onclick='x'> $\\q{$"""


def run(name: str, error: float | None, seconds: float, **other: Any) -> Run:
    """Return a run of one quantity, `impulse`, unless its errors are given."""
    errors = other.pop("errors", {} if error is None else {"impulse": error})
    worst = max(errors, key=lambda key: abs(errors[key]), default=None)
    values: dict[str, Any] = {
        "kind": "reduced", "scheme": "residual, event",
        "settings": {"component": {"rod": {"modes": {"normal_count": 30}}}},
        "coordinates": 36, "result": "FINISHED", "errors": errors,
        "largest_error": None if worst is None else abs(errors[worst]), "largest_of": worst, "truncation": None,
        "truncation_against": "no larger basis", "time": None, "time_against": "no finer step", "energy_drift": 2e-11,
        "momentum_residual": 1e-14, "step": 1e-6, "steps": 4000, "factorisations": 1, "iterations": 900,
        "cpu_seconds": seconds, "wall_seconds": 1.1 * seconds,
        "stages": {"mesh": StageSeconds(Seconds(2.0, 1.9), Seconds(0.01, 0.01)),
                   "solve": StageSeconds(None, Seconds(1.1 * seconds, seconds))},
        "peak_mib": 310.0, "front": False,
    }  # fmt: skip
    return Run(name, **values | other)


def quantity(name: str, **other: Any) -> Quantity:
    """Return a quantity that settles."""
    values: dict[str, Any] = {
        "unit": "N s", "measure": "relative", "reference": 2.5, "counts": True, "converges": True,
        "why": "it settles along every chain", "chains": [],
    }  # fmt: skip
    return Quantity(name, **values | other)


def document(runs: list[Run], quantities: list[Quantity], **other: Any) -> Document:
    """Return a document of a rod."""
    values: dict[str, Any] = {
        "scene": "rod", "command": "gudgeon report data/rod --tolerance 1%",
        "reference": {"kind": "analytic", "source": "d'Alembert's solution"},
        "machine": {"cpu": "a processor", "cores": 2, "python": "3.11.9"}, "version": "0.1.0", "left_out": [],
        "changes": [], "choice": None, "timing": "Least of 3 runs after one that is not counted, one thread.",
    }  # fmt: skip
    return Document(**values | {"runs": with_front(runs), "quantities": quantities} | other)


def small() -> Document:
    """Return three runs, one of them nodal and the reference itself."""
    runs = [
        run("30 modes", -0.0082, 0.05),
        run("60 modes", 0.0031, 0.13, coordinates=66),
        run("full FE, 1 µs", None, 31.0, kind="nodal", scheme="full FE", coordinates=35100,
            settings={}),
    ]  # fmt: skip
    return document(runs, [quantity("impulse")])


def large() -> Document:
    """Return sixty-one runs of three quantities over bases, steps and schemes; one quantity does not converge."""
    runs: list[Run] = []
    chains: list[Chain] = []
    schemes = ["residual, event", "residual, small", "penalty, small", "Hertz law, small",
               "Craig-Bampton, residual", "constraint, event", "Ritz, residual", "Rubin, small",
               "normal + static, penalty"]  # fmt: skip
    for s, scheme in enumerate(schemes):
        for n in (10, 20, 40):
            chain = []
            for step in (4e-6, 1e-6):
                basis, time = (0.9 + 0.1 * s) * n**-1.6, 0.05 * (step / 4e-6) ** 2 * (1 + 0.3 * s)
                errors = {"impulse": basis + time, "force": 3 * basis + 2 * time, "chatter": 0.2 + 0.1 * math.sin(n)}
                if s == 2 and n == 10:
                    errors = {}
                counting = {key: errors[key] for key in ("impulse", "force") if key in errors}
                worst = max(counting, key=lambda key: counting[key], default=None)
                runs.append(
                    run(f"{scheme}, {n} modes, {step * 1e6:g} µs", None, 2e-4 * n ** (1.2 + 0.05 * s) / (step * 1e6),
                        errors=errors, scheme=scheme, step=step, coordinates=n + 6,
                        result="FINISHED" if errors else "DIVERGED",
                        largest_error=counting.get(worst or ""), largest_of=worst,
                        truncation={"impulse": basis, "force": 3 * basis} if errors else None,
                        time={"impulse": time, "force": 2 * time} if errors else None)
                )  # fmt: skip
                chain.append(runs[-1].name)
            chains.append(Chain("step", chain, [2e-6, 1e-6], [0.1, 0.05], [0.06 / n * (s + 1), 0.0], None, None))
        names = [f"{scheme}, {n} modes, 1 µs" for n in (10, 20, 40)]
        chains.append(Chain("basis", names, [10, 20, 40], [0.3, 0.1, 0.04], [0.28 / (s + 1), 0.06, 0.0], True, 1.6))
    sizes = [(8e-6, 0.031), (4e-6, 0.009), (2e-6, 0.0024), (1e-6, 0.0006), (5e-7, 0.0)]
    for step, error in sizes:
        runs.append(
            run(f"full FE, {step * 1e6:g} µs", None, 5e-5 / step, kind="nodal", scheme="full FE",
                coordinates=35100, step=step, settings={}, errors={"impulse": error / 2, "force": error})
        )  # fmt: skip
    last = [f"{schemes[-1]}, {n} modes, 1 µs" for n in (10, 20, 40)]
    broken = [Chain("basis", last, [10, 20, 40], [0.3, 0.1, 0.29], [0.03, -0.65, 0.0], False, None)]
    quantities = [
        quantity("impulse", chains=chains),
        quantity("force", measure="L2", unit="N", reference=None, chains=chains[:8]),
        quantity("chatter", counts=False, converges=False, why="differences grow from 20 to 40 modes", chains=broken),
    ]
    best = min((r for r in runs if (r.largest_error or 1) <= 0.05), key=lambda r: r.cpu_seconds)
    why = f"{best.name} meets 5%: {best.largest_error:.2%} of {best.largest_of} in {best.cpu_seconds:.3g} s"
    choice = Choice(0.05, best.name, best.settings, best.largest_error, best.largest_of, best.cpu_seconds, why)
    sizes = {"impulse": 0.011, "force": 0.031}
    terms = [
        Term("mesh", "edges / 1.5 and edges × 1.5, extrapolated", sizes, {"force": 1.9}, 0.031, "force"),
        Term("basis", "against 40 modes", {"impulse": 4e-3, "force": 2e-3}, {}, 4e-3, "impulse"),
        Term("step", "not estimated: there is no finer step"),
    ]
    return document(
        runs, quantities, choice=choice, budget=Budget(best.name, terms), window=40e-6, until=2e-3,
        left_out=[{"name": "penalty, event", "why": "a law has no exact motion between events"}],
        changes=[{"change": "20 µm barrel", "impulse_change": -0.089, "impulse_error": -4.7e-4, "cold_seconds": 13.9,
                  "reuse_seconds": 0.372, "stages": {"mesh": "fresh", "modes": "fresh", "morph": "ran"}}],
        tables=[Table("Whole cycle", ["run", "force"], [["30 modes", "12%"]], "what comes later is chaotic")],
        notes=["mesh: 35 100 dofs"],
    )  # fmt: skip


def biting() -> Document:
    """Return a document whose every text tries to leave its element."""
    one = run(BITING, 0.01, 1.0, errors={BITING: 0.01}, scheme=BITING, settings={BITING: BITING},
              stages={BITING: StageSeconds(None, Seconds(1.0, 1.0))}, truncation={BITING: 0.01},
              truncation_against=BITING, time_against=BITING)  # fmt: skip
    failed = run("other", None, 2.0, result=BITING)
    budget = Budget(BITING, [Term(BITING, BITING, {BITING: 0.01}, {BITING: 1.0}, 0.01, BITING)])
    chain = Chain(BITING, [BITING, "other"], [1, 2], [0.1, 0.2], [0.1, 0.0], None, None)
    choice = Choice(0.1, BITING, {BITING: BITING}, 0.01, BITING, 1.0, BITING)
    return document(
        [one, failed], [quantity(BITING, unit=BITING, why=BITING, chains=[chain])], scene=BITING, command=BITING,
        reference={"kind": BITING, "source": BITING}, machine={"cpu": BITING, "cores": 2}, version=BITING,
        left_out=[{"name": BITING, "why": BITING}], changes=[{"change": BITING, "note": BITING}], choice=choice,
        budget=budget,
        notes=[BITING], tables=[Table(BITING, ["a", BITING], [["b", BITING]], BITING)], timing=BITING,
    )  # fmt: skip


def infinite() -> Document:
    """Return a run whose error is no number, one whose error is none at all, and one at round-off."""
    runs = [
        run("blown up", math.inf, 1.0),
        run("lost", math.nan, 2.0),
        run("exact", 2e-16, 3.0, step=None, cpu_seconds=0.0),
    ]  # fmt: skip
    return document(runs, [quantity("impulse")])


def crowd() -> Document:
    """Return seventy runs of as many schemes, all on the front."""
    runs = [
        run(f"setting {i} of many, with a name that is rather long", 0.5 / 1.15**i, 0.01 * 1.2**i, scheme=f"scheme {i}")
        for i in range(70)
    ]
    return document(runs, [quantity("impulse")])


def unmatched() -> Document:
    """Return runs without any reference."""
    reference = {"kind": "none", "source": "one run only"}
    return document([run("as in the scene", None, 0.4)], [], reference=reference)
