"""What acts on a component: its interfaces on the mesh, their rows of B, and the model that they load."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import linalg, sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.modes import InterfaceModes, LoadModes, TractionModes
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.loads import LoadRows, load_rows
from gudgeon.pipeline.interfaces.patch import POINT_FINDERS, normal_rows
from gudgeon.pipeline.interfaces.point_mass import component_model
from gudgeon.pipeline.interfaces.points import ContactPoints, surface_coordinates
from gudgeon.pipeline.interfaces.tangential import TangentialRows, rows_across
from gudgeon.pipeline.interfaces.tie import Tie, made_rigid, rigid_ties, tie_of, tie_rows
from gudgeon.pipeline.interfaces.traction_space import TractionSpace, refuse_too_many, refuse_unresolved, traction_space
from gudgeon.pipeline.modes.static import pressure_fields
from gudgeon.pipeline.reduction.methods import ContactRows
from gudgeon.pipeline.reduction.responses import SMOOTH
from gudgeon.pipeline.scenes.component import Component
from gudgeon.pipeline.scenes.interface import Interface

PLACE_FINDERS = POINT_FINDERS | {"traction": traction_space, "tie": tie_of}
"""What is found on the mesh before matrices are assembled, by the kind of an interface; other kinds are loads."""


@dataclass(frozen=True)
class Acting:
    """An interface of a component on its mesh."""

    at: ContactPoints | TractionSpace | LoadRows
    rows: sparse.csr_matrix
    """Its rows of B, (r, dofs)."""
    fields: np.ndarray
    """Forces of the pressure fields that get a static shape, (r, k)."""
    smooth: np.ndarray
    """Forces of smooth pressures, (r, SMOOTH) or fewer; the unit forces of a load, (r, r)."""
    tangential: TangentialRows | None = None
    """Where friction acts."""

    @property
    def forces(self) -> np.ndarray:
        """Nodal forces of the smooth pressures, (dofs, k)."""
        return self.rows.T @ self.smooth

    def modes(self, Phi: np.ndarray) -> InterfaceModes | TractionModes | LoadModes:
        """Return its record with the displacements per coordinate of shapes (dofs, m)."""
        modes = self.at.modes(self.rows @ Phi)
        if self.tangential is None or isinstance(modes, LoadModes):
            return modes
        return self.tangential.added(modes, Phi)


def assembled(
    mesh: MeshRecord, component: Component, scene_key: str, rubbed: Collection[str]
) -> tuple[dict[str, Any], dict[str, Acting], tuple[FEModel, FEModel, sparse.csr_matrix]]:
    """Return where interfaces are, what acts there, and the model, that with rigid ties, and its dofs per dof of the
    latter; see `reduce_component` for errors."""
    sites = _places(mesh, component, f"{scene_key}.interface")
    model = component_model(mesh, component, scene_key)
    acting = _acting(sites, component, model, rubbed, f"{scene_key}.interface")
    rigid = {key: tie for key, tie in sites.items() if isinstance(tie, Tie) and component.interface[key].tie == "rbe2"}
    rigid |= rigid_ties(mesh, rigid)
    return sites, acting, (model, *made_rigid(model, rigid, f"{scene_key}.interface"))


def _places(mesh: MeshRecord, component: Component, scene_key: str) -> dict[str, ContactPoints | TractionSpace | Tie]:
    """Find the interfaces on the mesh, so that incorrect ones are refused before matrices are assembled."""
    sites = {
        key: PLACE_FINDERS[interface.kind](mesh, interface, f"{scene_key}.{key}")
        for key, interface in sorted(component.interface.items())
        if interface.kind in PLACE_FINDERS
    }
    tractions = {key: site for key, site in sites.items() if isinstance(site, TractionSpace)}
    refuse_too_many(tractions, scene_key)
    refuse_unresolved(tractions, scene_key)
    return sites


def _acting(
    sites: Mapping[str, ContactPoints | TractionSpace | Tie],
    component: Component,
    model: FEModel,
    rubbed: Collection[str],
    scene_key: str,
) -> dict[str, Acting]:
    """Return the interfaces of a component on its model, by name in order; `scene_key` is the key of all of them."""
    acting = {}
    for name, interface in sorted(component.interface.items()):
        interface_rows = _on_model(
            sites.get(name), interface, model, component.modes.static_count, f"{scene_key}.{name}"
        )
        if name in rubbed and isinstance(interface_rows.at, ContactPoints | TractionSpace):
            interface_rows = replace(
                interface_rows, tangential=rows_across(model, interface, interface_rows.at, f"{scene_key}.{name}")
            )
        acting[name] = interface_rows
    return acting


def _on_model(
    site: ContactPoints | TractionSpace | Tie | None, interface: Interface, model: FEModel, count: int, scene_key: str
) -> Acting:
    """Return the rows of B of an interface; of a surface of contact `count` pressure fields and the smooth ones, of a
    load its unit forces."""
    if isinstance(site, ContactPoints):
        rows = normal_rows(model, interface, site)
        if model.rotations.any() and not np.abs(rows.data).max(initial=0.0) > 0:
            raise InputError(
                f"{scene_key}.surface: '{interface.surface}' given, the beam does not move along its normal; use"
                f" {interface.surface}-top or {interface.surface}-bottom"
            )
        coordinates = surface_coordinates(site.points, find_surface(model.mesh, interface.surface, scene_key).shape)
    elif isinstance(site, TractionSpace):
        rows, coordinates = site.rows(model), site.centres
    else:
        load = tie_rows(model, site) if site else load_rows(model, interface, scene_key)
        count = load.B.shape[0]
        return Acting(load, load.B, np.empty((count, 0)), np.eye(count))
    fields, smooth = (pressure_fields(coordinates, site.areas, k) for k in (count, SMOOTH))
    return Acting(site, rows, fields, smooth)


def stacked(acting: dict[str, Acting], spread: sparse.csr_matrix, constrained: Collection[str] = ()) -> ContactRows:
    """Return the rows of all interfaces as one matrix, then the tangential ones, over the dofs that `spread` keeps.

    Args:
        constrained: Interfaces each row of which gets a static shape.
    """
    across = {name: a.tangential.B for name, a in acting.items() if a.tangential is not None}
    blocks = [*(a.rows for a in acting.values()), *across.values()]
    B = sparse.vstack([sparse.csr_matrix((0, spread.shape[0])), *blocks], format="csr")
    ends = [int(end) for end in np.cumsum([0, *(block.shape[0] for block in blocks)])]
    spans = [list(span) for span in pairwise(ends)]
    fields, smooth = (
        linalg.block_diag(np.empty((0, 0)), *fields_of, np.empty((ends[-1] - ends[len(acting)], 0)))
        for fields_of in (
            [np.eye(a.rows.shape[0]) if name in constrained else a.fields for name, a in acting.items()],
            [a.smooth for a in acting.values()],
        )
    )
    loads = np.zeros(ends[-1], bool)
    for a, span in zip(acting.values(), spans, strict=False):
        loads[slice(*span)] = isinstance(a.at, LoadRows)
    return ContactRows(
        sparse.csr_matrix(B @ spread), fields, dict(zip(acting, spans, strict=False)), smooth,
        dict(zip(across, spans[len(acting) :], strict=True)), loads=loads,
    )  # fmt: skip
