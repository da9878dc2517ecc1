"""The calibration of a sensor: signals s = A w + o of a wrench w, and the matrix C with w = C (s − o).

C is the pseudo-inverse of A, least squares with equal noise of all signals. With fewer independent signals than
components of the wrench it does not exist; what the signals do not tell is then said by directions.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import linalg

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import read_json, write_text

KIND = "gudgeon calibration"
INDEPENDENT = 1e-6
"""Least singular value over the largest one, of columns of unit length, from which a direction is told."""
SHOWN = 0.05
"""Share of a component in a direction from which it is named."""


@dataclass(frozen=True)
class Calibration:
    """Signals of n channels per wrench of k components, and back."""

    channels: list[dict[str, Any]]
    """Name, wiring and gauges with their places, of each."""
    components: tuple[str, ...]
    sensitivity: np.ndarray
    """A [V/V per N, N m], (n, k)."""
    offsets: np.ndarray
    """o [V/V], (n,)."""
    matrix: np.ndarray
    """C [N, N m per V/V], (k, n)."""
    condition: float
    """Condition number of A with columns of unit length."""
    residuals: dict[str, Any]
    origin: dict[str, Any]
    """Scene, point, axes and data of it."""

    @property
    def names(self) -> list[str]:
        """Names of the channels."""
        return [c["name"] for c in self.channels]

    def wrenches(self, signals: np.ndarray) -> np.ndarray:
        """Return the wrenches of signals [V/V], (s, n) → (s, k)."""
        with np.errstate(over="ignore", invalid="ignore"):
            return (signals - self.offsets) @ self.matrix.T

    def as_json(self) -> dict[str, Any]:
        """Return the document of its file."""
        return {
            "kind": KIND, "version": 1, "wrench": list(self.components),
            "wrench_units": [unit_of(name) for name in self.components], "signal_unit": "V/V",
            "channels": self.channels, "matrix": self.matrix.tolist(), "offsets": self.offsets.tolist(),
            "sensitivity": self.sensitivity.tolist(), "condition_number": self.condition,
            "residuals": self.residuals, "origin": self.origin,
        }  # fmt: skip


def unit_of(component: str) -> str:
    """Return the unit of a component of a wrench."""
    return "N" if component.startswith("F") else "N m"


def calibrated(
    channels: list[dict[str, Any]],
    components: tuple[str, ...],
    sensitivity: np.ndarray,
    offsets: np.ndarray,
    residuals: dict[str, Any],
    origin: dict[str, Any],
) -> Calibration:
    """Return the calibration of known sensitivities (n, k) and offsets (n,).

    Raises:
        InputError: the signals do not tell all components; which directions are missing.
    """
    scale = _scale(sensitivity, components)
    U, s, Vt = np.linalg.svd(sensitivity / scale, full_matrices=True)
    rank = int((s > INDEPENDENT * max(s.max(initial=0.0), np.finfo(float).tiny)).sum())
    if rank < len(components):
        missing = directions(Vt[rank:].T / scale[:, None], components)
        raise InputError(
            f"sensor: calibration of too low rank: the {len(channels)} signals tell {rank} of {len(components)}"
            f" components; missing: {missing}; add gauges, or name what acts in sensor.NAME.components"
        )
    k = len(components)
    matrix = (Vt.T[:, :k] / s) @ U[:, :k].T / scale[:, None]
    return Calibration(
        channels=channels, components=components, sensitivity=sensitivity, offsets=offsets, matrix=matrix,
        condition=float(s.max() / s.min()), residuals=residuals, origin=origin,
    )  # fmt: skip


def fitted(wrenches: np.ndarray, signals: np.ndarray, components: tuple[str, ...], path: Path) -> dict[str, Any]:
    """Return sensitivity (n, k), offsets (n,), and the residual rms of each signal (n,) of measured rows.

    Raises:
        InputError: the wrenches do not span all components.
    """
    size = np.array([np.abs(column).max() for column in wrenches.T])
    scale = np.where(size > 0, size, 1.0)
    middle = wrenches.mean(axis=0)
    span = (wrenches - middle) / scale
    _, s, Vt = np.linalg.svd(span, full_matrices=True)
    s = np.concatenate([s, np.zeros(len(components) - len(s))]) if len(s) < len(components) else s
    rank = int((s > INDEPENDENT * max(s.max(initial=0.0), np.finfo(float).tiny)).sum())
    if rank < len(components):
        missing = directions(Vt[rank:].T / scale[:, None], components)
        raise InputError(
            f"{path}: calibration data of too low rank: the wrenches of its {len(wrenches)} rows, less their mean, span"
            f" {rank} of {len(components)} components; missing: {missing}"
        )
    rows = np.column_stack([wrenches / scale, np.ones(len(wrenches))])
    answer = np.linalg.lstsq(rows, signals, rcond=None)[0]
    residual = signals - rows @ answer
    freedom = max(len(rows) - rows.shape[1], 1)
    return {
        "sensitivity": answer[:-1].T / scale, "offsets": answer[-1],
        "rms": np.sqrt((residual**2).sum(axis=0) / freedom), "condition": float(s[0] / s[len(components) - 1]),
    }  # fmt: skip


def directions(basis: np.ndarray, components: tuple[str, ...]) -> str:
    """Return directions that span the columns (k, d) as text, each with one component of its own."""
    size = np.abs(basis).max(axis=1)
    weights = basis / np.maximum(size.max(), np.finfo(float).tiny)
    chosen = linalg.qr((weights / np.maximum(np.linalg.norm(weights, axis=0), 1e-300)).T, pivoting=True)[2]
    pivots = np.sort(chosen[: basis.shape[1]])
    vectors = basis @ np.linalg.inv(basis[pivots])
    texts = []
    for pivot, vector in zip(pivots, vectors.T, strict=True):
        others = [
            f"{vector[j]:+.3g} {components[j]}" for j in range(len(components))
            if j not in pivots and abs(vector[j]) > SHOWN * _share(components[pivot], components[j])
        ]  # fmt: skip
        texts.append(" with ".join([components[pivot], " ".join(others)] if others else [components[pivot]]))
    return ", ".join(texts)


def _share(a: str, b: str) -> float:
    """Return a lever [m] or its inverse between a force and a moment, one between equals."""
    return 1.0 if a[0] == b[0] else (0.05 if b[0] == "M" else 20.0)


def _scale(sensitivity: np.ndarray, components: tuple[str, ...]) -> np.ndarray:
    """Return the length of each column, (k,); of a column without signal that of the largest of its unit, or 1."""
    length = np.linalg.norm(sensitivity, axis=0)
    for j, name in enumerate(components):
        same = [length[i] for i, c in enumerate(components) if c[0] == name[0]]
        if length[j] <= INDEPENDENT * max(same):
            length[j] = max(max(same), np.finfo(float).tiny) or 1.0
    return np.where(length > np.finfo(float).tiny, length, 1.0)


def write_calibration(path: Path, calibration: Calibration) -> None:
    """Write a calibration."""
    write_text(path, json.dumps(calibration.as_json(), indent=1) + "\n")


def read_calibration(path: Path) -> Calibration:
    """Read a calibration.

    Raises:
        InputError: the file is missing or none.
    """
    try:
        raw = read_json(path)
    except (OSError, ValueError, RecursionError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: no calibration ({reason}); write one by `gudgeon calibrate SCENE`") from error
    if not isinstance(raw, dict) or raw.get("kind") != KIND or raw.get("version") != 1:
        raise InputError(f"{path}: no calibration of version 1; write one by `gudgeon calibrate SCENE`")
    try:
        calibration = Calibration(
            channels=raw["channels"], components=tuple(raw["wrench"]),
            sensitivity=np.array(raw["sensitivity"], float), offsets=np.array(raw["offsets"], float),
            matrix=np.array(raw["matrix"], float), condition=float(raw["condition_number"]),
            residuals=raw["residuals"], origin=raw["origin"],
        )  # fmt: skip
        n, k = len(calibration.names), len(calibration.components)
        shapes = (calibration.matrix.shape, calibration.offsets.shape)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: damaged: {type(error).__name__} at {error}") from error
    if shapes != ((k, n), (n,)) or not (
        np.isfinite(calibration.matrix).all() and np.isfinite(calibration.offsets).all()
    ):
        raise InputError(
            f"{path}: damaged: {k} components and {n} channels need a finite matrix of {k} x {n} and {n} offsets"
        )
    return calibration
