"""A report as a notebook shows it."""

from dataclasses import dataclass, fields
from html import escape
from typing import Any

from gudgeon.pipeline.report.document import Document
from gudgeon.pipeline.report.page.picture import error_chart, runs_figure
from gudgeon.pipeline.report.page.words import verdict


@dataclass(frozen=True)
class ShownReport(Document):
    """A report with its pictures."""

    def plot(self) -> Any:
        """Return the figure of `report.png`, the error of each run over its CPU time, a `matplotlib.figure.Figure`."""
        return runs_figure(self)

    def _repr_html_(self) -> str:
        return f"<b>{escape(self.scene)}</b><div>{escape(verdict(self))}</div>{error_chart(self)}"


def shown(document: Document) -> ShownReport:
    """Return a report with its pictures."""
    return ShownReport(**{f.name: getattr(document, f.name) for f in fields(document)})
