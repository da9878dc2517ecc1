"""MacNeal's basis of a design from stored ones of the same mesh, where their estimated error is within a tolerance."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.modes import DESIGN, SHAPE_ERRORS, ModalRecord
from gudgeon.pipeline.design_change.family import Family
from gudgeon.pipeline.design_change.projection import Target
from gudgeon.pipeline.design_change.ways import Carried, carried
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.modes.static import Residual, total_scale
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, sagging_shapes, with_static
from gudgeon.pipeline.scenes.modes import ModesSettings

NEGATIVE = 10.0
"""Negative eigenvalues of R that its stated error may leave, over this error, each row scaled by the root of its total
flexibility."""


def carried_macneal(
    family: Family, base: ModalRecord, keys: Sequence[str], tolerance: float
) -> Callable[[FEModel, ContactRows, ModesSettings], Reduction]:
    """Return a reduction of other designs of a family; `recompute` where no cheaper way is within the tolerance.

    Args:
        base: Record of the family's first design.
        keys: Of the records of all its designs.
        tolerance: Of the largest estimated relative error of a frequency and of a compliance.
    """
    responses = base.static_responses
    columns = {} if responses is None else responses.columns
    spans = spans_of(base)

    def reduction(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
        target = target_of(model, rows, settings.normal_count)
        same = spans == (_listed(rows.spans), _listed(rows.tangential_spans))
        answer = carried(target, family, columns, tolerance) if same else None
        if answer is None:
            exact = macneal(model, rows, settings)
            return replace(exact, quality=exact.quality | {DESIGN: {"way": "recompute", "designs": list(keys)}})
        completed = _completed(model, rows, answer, base, target.count)
        quality = completed.quality | {DESIGN: answer.quality() | {"designs": list(keys)}}
        return replace(completed, quality=quality)

    return reduction


def spans_of(record: ModalRecord) -> tuple[dict[str, list[int]], dict[str, list[int]]]:
    """Return the first and last + 1 of the rows of each interface, and of the tangential ones."""
    return _listed(record.interface_rows), _listed(record.tangential_spans)


def _listed(spans: Mapping[str, Sequence[int]]) -> dict[str, list[int]]:
    return {name: [int(end) for end in span] for name, span in spans.items()}


def target_of(model: FEModel, rows: ContactRows, count: int) -> Target:
    """Return a model and its rows as a body whose normal modes are wanted."""
    weights = np.empty((len(model.held), 0)) if rows.weights is None else rows.weights
    return Target(model, rows.B, rows.wanted, rows.pressures, weights, count)


def _completed(model: FEModel, rows: ContactRows, taken: Carried, base: ModalRecord, count: int) -> Reduction:
    """Return the reduction of an answer: its shapes as `count` normal modes, its static shapes, and R."""
    answer = taken.answer.reduced
    modes = NormalModes(np.sqrt(answer.values[:count]), answer.shapes(count), {})
    at_rows = (rows.B @ modes.Phi) / modes.angular_frequencies
    R = taken.answer.flexibility - at_rows @ at_rows.T
    pressures = np.column_stack([rows.pressures, rows.wanted])
    static = answer.uncertified()
    fields = np.column_stack([static[:, : rows.pressures.shape[1]], answer.responses(rows.wanted)])
    fields = fields - (modes.Phi / modes.angular_frequencies) @ (at_rows.T @ pressures)
    fields -= modes.Phi @ (modes.Phi.T @ (model.M @ fields))
    residual = Residual(R, total_scale(R, at_rows), fields)
    sagging = sagging_shapes(model, rows, modes, static[:, rows.pressures.shape[1] :])
    errors = base.quality.get(SHAPE_ERRORS, [])

    def shape_errors(frequencies: np.ndarray, shapes: np.ndarray) -> list[float]:
        return errors if len(errors) == len(frequencies) else [1.0] * len(frequencies)

    return with_static(model, rows, modes, residual, sagging, shape_errors, error=NEGATIVE * taken.errors.largest)
