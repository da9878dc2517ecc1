"""The page of a report: one HTML file that is complete without network and script; the script adds interaction.

Every text of a scene is escaped; a content security policy in the page forbids it to load any file.
"""

import base64
from collections.abc import Callable, Sequence

from jinja2 import Environment, PackageLoader

from gudgeon.pipeline.report.document import Chain, Document, Quantity
from gudgeon.pipeline.report.page import words
from gudgeon.pipeline.report.page.picture import ERROR, FRAMES, LEAST, chain_chart, error_chart, looks
from gudgeon.pipeline.report.page.tables import (
    error_columns,
    front_grid,
    kind_grid,
    quantities_grid,
    run_columns,
    runs_grid,
)

SIZES: dict[str, Callable[[float], str]] = {
    "coordinates": words.count_text,
    "edge length": words.edge_text,
    "step": words.step_text,
    "accuracy": "{:.1g}".format,
    "spacing": "× {:.3g}".format,
}
"""Writes the size of a run, by the quantity that measures it."""
WHAT = {"basis": "coordinates", "mesh": "edge length", "grid": "spacing"}


def page(document: Document, picture: bytes | None = None) -> str:
    """Return the page of a report.

    Args:
        picture: A further picture, as PNG.
    """
    environment = Environment(
        loader=PackageLoader("gudgeon.pipeline.report.page", ""), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    budget = words.budget_table(document)
    return environment.get_template("page.html").render(
        document=document,
        words=words,
        picture=None if picture is None else base64.b64encode(picture).decode("ascii"),
        charts={"frames": FRAMES, "draw": error_chart, "looks": looks(document), "least": LEAST,
                "names": {"": ERROR} | {quantity.name: quantity.name for quantity in document.quantities}},
        tables={
            "front": front_grid(document),
            "budget": None if budget is None else kind_grid(budget),
            "runs": runs_grid(document, "runs", run_columns(document)),
            "errors": runs_grid(document, "errors", error_columns(document)),
            "quantities": quantities_grid(document),
            "further": [kind_grid(table) for table in words.tables_of(document)],
        },
        cards=[_card(document, quantity) for quantity in document.quantities if quantity.chains],
    )  # fmt: skip


def _card(document: Document, quantity: Quantity) -> tuple[Quantity, str, list[str]]:
    """Return a quantity, its verdict with the orders of convergence, and a chart for each kind of sizes."""
    axes = axes_of(document, quantity)
    charts = [
        chain_chart(quantity, size_kind, chains, SIZES.get(size_kind, "{:.3g}".format))
        for size_kind, chains in axes.items()
    ]
    orders = [
        f"order in {size_kind}: {' to '.join(f'{order:.1f}' for order in limits)}"
        for size_kind, chains in axes.items()
        if (limits := _orders(chains))
    ]
    return quantity, "; ".join([words.SETTLES[quantity.converges], *orders]), charts


def axes_of(document: Document, quantity: Quantity) -> dict[str, list[Chain]]:
    """Return the chains of a quantity, by the kind of their sizes: coordinates, edge length, step or accuracy."""
    runs, chains_of = {run.name: run for run in document.runs}, {}
    for chain in quantity.chains:
        size_kind = WHAT.get(chain.axis, chain.axis)
        if chain.axis == "step":
            steps = [runs[name].step for name in chain.runs if name in runs]
            size_kind = "step" if any(size in steps for size in chain.sizes) else "accuracy"
        chains_of.setdefault(size_kind, []).append(chain)
    return chains_of


def _orders(chains: Sequence[Chain]) -> list[float]:
    """Return the least and the greatest order of some chains, a single one if they agree."""
    orders = [chain.order for chain in chains if chain.order is not None]
    return sorted({round(min(orders), 1), round(max(orders), 1)}) if orders else []
