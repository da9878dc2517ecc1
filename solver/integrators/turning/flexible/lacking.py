"""How much of the static strain energy under joints and rotation a body's modes lack.

A joint acts on a body that deforms through its modes alone. Under the forces λ of the joints at its interfaces, which
its inertia balances, the whole body has the strain energy ½ λᵀ B G Bᵀ λ, its modes ½ λᵀ W Λ⁻¹ Wᵀ λ, and what they lack
is ½ λᵀ R λ with the residual flexibility R of its record (docs/theory/2-reduction.md). Λ and R are those of free
bodies. Under the load ρ C x of a rotation, C = ω² 1 − ω ωᵀ, it is ½ C : D : C of the whole body, and of its modes
½ s Λ⁻¹ sᵀ with s_k = C : S_k.
"""

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.integrators.turning.arrays import Model
from gudgeon.solver.integrators.turning.build import Linkage
from gudgeon.solver.integrators.turning.energy import modal_parts
from gudgeon.solver.integrators.turning.flexible.acting import forces_of_joints
from gudgeon.solver.integrators.turning.flexible.statics import squares_of
from gudgeon.solver.integrators.turning.probes import States

SAID = 0.01
"""Share of the strain energy from which on it is said."""
BY_HELD_MODES = ("row-craig-bampton", "craig-bampton", "interface", "partial-interface")
"""Reductions whose shapes are made more numerous by `fixed_count`."""


def joint_truncations(linkage: Linkage, model: Model, states: States, holds: np.ndarray) -> tuple[Json, list[str]]:
    """Return the quantity `joint_truncation` of each body that joints hold at interfaces, and notes on it.

    It is the largest energy ½ λᵀ R λ over the largest whole one at the samples. Bodies whose record drops R have none.

    Args:
        holds: As `Reading.holds`, (1 + s, J, 6).
    """
    json: Json = {}
    notes = []
    for name, body in linkage.system.bodies.items():
        joint_forces = forces_of_joints(linkage, model, states, holds, name)
        if not joint_forces or body.modal.residual_flexibility is None or not len(body.modal.angular_frequencies):
            continue
        forces = np.hstack([f for _, f in joint_forces])[1:]
        lack, carried = _compliances(body, [interface for interface, _ in joint_forces])
        truncated, represented = (0.5 * np.einsum("si,ij,sj->s", forces, matrix, forces) for matrix in (lack, carried))
        fraction = _share(truncated, represented)
        json[f"{name}.joint_truncation"] = {"value": fraction, "unit": "1"}
        if fraction > SAID:
            component = linkage.system.scene.component_of(name)
            notes.append(
                f"body.{name}: its modes do not represent {fraction:.2g} of the strain energy that the forces of"
                f" its joints would cause as static ones; increase component.{component}.modes.fixed_count, or set"
                " reduction 'rubin-macneal', whose shapes represent all of it"
            )
    return json, notes


def inertia_truncations(linkage: Linkage, model: Model, states: States) -> tuple[Json, list[str]]:
    """Return the quantity `inertia_truncation` of each body that deforms, and notes on it.

    There is no note where the strain energy that the modes do not represent is small against theirs in the run.
    """
    json: Json = {}
    notes = []
    for b, (name, body) in enumerate(linkage.system.bodies.items()):
        couplings, omega = body.modal.inertia_couplings, body.modal.angular_frequencies
        if couplings is None or couplings.centrifugal_compliance is None or couplings.position_moments is None:
            continue
        C = squares_of(model, states.samples, b)[1:]
        total = 0.5 * np.einsum("sij,ijkl,skl->s", C, couplings.centrifugal_compliance, C, optimize=True)
        represented = 0.5 * ((np.einsum("sij,ijk->sk", C, couplings.position_moments) / omega) ** 2).sum(axis=1)
        truncated = np.maximum(total - represented, 0.0)
        fraction = _share(truncated, represented)
        json[f"{name}.inertia_truncation"] = {"value": fraction, "unit": "1"}
        strain = 0.5 * modal_parts(model, states.samples, b)[0] ** 2 @ omega**2
        if fraction > SAID and float(truncated.max()) > SAID * float(strain.max()):
            component = linkage.system.scene.component_of(name)
            key = "fixed_count" if body.modal.reduction in BY_HELD_MODES else "normal_count"
            notes.append(
                f"body.{name}: its modes do not represent {fraction:.2g} of the strain energy that its rotation would"
                " cause as a static load; its gauges include it, its displacements do not: increase"
                f" component.{component}.modes.{key}"
            )
    return json, notes


def _share(truncated: np.ndarray, represented: np.ndarray) -> float:
    """Return the largest of what is lost over the largest whole energy."""
    total = float((truncated + represented).max(initial=0.0))
    return max(0.0, float(truncated.max())) / total if total > 0 else 0.0


def _compliances(body: FlexibleBody, interfaces: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return R and the static compliance W Λ⁻¹ Wᵀ of the modes over the rows of interfaces, (k, k) each."""
    rows = np.vstack([body.modal.loads[name].rows for name in interfaces])
    lack = np.block([[body.residual(i, j) for j in interfaces] for i in interfaces])
    return lack, (rows / body.modal.angular_frequencies**2) @ rows.T
