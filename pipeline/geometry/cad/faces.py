"""The faces of a CAD part: number, kind, size and place of each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.cad.names import face_names
from gudgeon.pipeline.geometry.cad.reading import solid_name
from gudgeon.pipeline.geometry.shape_fit import fit_shape, signed_distance
from gudgeon.pipeline.geometry.surfaces import SurfaceRule

SAMPLES = (6, 12, 24, 48, 96)
"""Places along each parameter of a face, the next number where less than `ENOUGH` of them lie on it."""
ENOUGH = 16
ASIDE = 1e-4
"""How far beside a face lies what is inside or outside of its solid, by the part's extent."""
NO_COLOUR = (0, 0, 255, 0)
"""gmsh's colour of what has none."""


@dataclass(frozen=True)
class Face:
    """One outer face of a part."""

    number: int
    """In gmsh's model of the file, from 1."""
    solid: str
    """Name or number of its solid."""
    area: float
    """[m^2]."""
    share: float
    """∫ x·n dA / 3 [m^3] by its samples: about its share of the part's volume."""
    centre: np.ndarray
    """Centre of area [m], (3,)."""
    extent: float
    """Size of the part that it belongs to [m]."""
    shape: SurfaceRule
    """Its true surface, empty if that is no plane, cylinder, cone or sphere."""
    residual: float
    """Largest distance of its samples from that surface [m]."""
    kind: str
    """Kind of the true surface, or what gmsh calls it."""
    hollow: bool
    """Whether a round face is that of a hole: its outward normal points to its axis or centre."""
    name: str
    """In the file; empty if it has none."""
    colour: str
    """In the file, as `#rrggbb`; empty if it has none."""
    points: np.ndarray
    """Samples on it [m], (k, 3)."""
    edges: frozenset[int]

    @property
    def label(self) -> str:
        """Name by which a scene can refer to it without a rule."""
        return f"face{self.number}"

    def text(self) -> str:
        """Return the face as text: number, kind, and normal or radius and centre, in mm."""
        centre = "({})".format(", ".join(f"{1e3 * value:.4g}" for value in self.centre))
        return f"{self.number} ({self.measure()} at {centre} mm)"

    def measure(self) -> str:
        """Return the kind with normal, radius or angle."""
        if self.kind == "plane":
            return "plane, normal {}".format(vector_text(self.shape["normal"]))
        if self.kind in ("cylinder", "sphere"):
            kind = f"{self.kind}, hollow" if self.hollow else self.kind
            return f"{kind}, radius {1e3 * self.shape['radius']:.6g} mm"
        return f"cone, angle {np.degrees(self.shape['angle']):.4g} deg" if self.kind == "cone" else self.kind


def vector_text(vector: Sequence[float]) -> str:
    """Return a direction as a list of a scene."""
    return "[{}]".format(", ".join(f"{value + 0.0:.4g}" if abs(value) > 1e-9 else "0" for value in vector))


def faces_of(gmsh: Any, path: str, solids: Sequence[int], scale: float) -> list[Face]:
    """Return the outer faces of solids in gmsh's model, by number.

    Args:
        scale: Metres per unit of the model.
    """
    model = gmsh.model
    boxes = np.array([model.getBoundingBox(3, tag) for tag in solids]).reshape(-1, 2, 3)
    extent = math.dist(boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0))
    owner: dict[int, int] = {}
    side: dict[int, float] = {}
    face_samples: dict[int, Samples] = {}
    for solid in solids:
        for _, signed in model.getBoundary([(3, solid)], oriented=True):
            tag = abs(signed)
            if len(set(model.getAdjacencies(2, tag)[0]) & set(solids)) == 1:
                face_samples[tag] = samples(gmsh, tag)
                owner[tag], side[tag] = solid, _side(gmsh, signed, solid, face_samples[tag], extent)
    names = face_names(gmsh, path, sorted(owner))
    for solid in solids:  # gmsh's own kernel may turn all faces of a solid inward.
        tags = [tag for tag in owner if owner[tag] == solid]
        if sum(side[tag] * _share(face_samples[tag]) for tag in tags) < 0:
            side |= {tag: -side[tag] for tag in tags}
    return [
        _face(gmsh, tag, owner[tag], face_samples[tag].turned(side[tag]), (extent, scale), names.get(tag, ""))
        for tag in sorted(owner)
    ]


class Samples(NamedTuple):
    """Points (k, 3), normals (k, 3) and shares of area (k,) of a face, in the model's unit."""

    points: np.ndarray
    normals: np.ndarray
    weights: np.ndarray

    def turned(self, side: float) -> "Samples":
        """Return them with normals to the other side for −1."""
        return self._replace(normals=side * self.normals)


def _share(face_samples: Samples) -> float:
    return float(face_samples.weights @ np.einsum("ki,ki->k", face_samples.points, face_samples.normals)) / 3


def samples(gmsh: Any, tag: int) -> Samples:
    """Return samples of a face, with gmsh's normals."""
    model = gmsh.model
    low, high = model.getParametrizationBounds(2, tag)
    uv, on = np.empty((0, 2)), np.empty(0, bool)
    for count in SAMPLES:
        steps = (np.arange(count) + 0.5) / count
        u, v = (a + (b - a) * steps for a, b in zip(low, high, strict=True))
        uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
        on = np.array([bool(model.isInside(2, tag, pair, True)) for pair in uv.tolist()])
        if on.sum() >= ENOUGH:
            break
    chosen = uv[on] if on.any() else uv  # A sliver lies between all places.
    flat = chosen.ravel()
    points = np.array(model.getValue(2, tag, flat)).reshape(-1, 3)
    normals = np.array(model.getNormal(tag, flat)).reshape(-1, 3)
    slopes = np.array(model.getDerivative(2, tag, flat)).reshape(-1, 2, 3)
    cell = np.prod(np.subtract(high, low)) / len(uv)
    return Samples(points, normals, np.linalg.norm(np.cross(slopes[:, 0], slopes[:, 1]), axis=1) * cell)


def _side(gmsh: Any, signed: int, solid: int, face_samples: Samples, extent: float) -> float:
    """Return 1 where gmsh's normal of a face points out of its solid, −1 elsewhere.

    Args:
        signed: Number of the face, negative where the solid has it turned; it says enough in gmsh's own kernel.
    """
    if not gmsh.model.occ.getEntities(2):
        return math.copysign(1.0, signed)
    outside = face_samples.points[0] + ASIDE * extent * face_samples.normals[0]
    return -1.0 if gmsh.model.isInside(3, solid, outside.tolist()) else 1.0


def distances(gmsh: Any, faces: Sequence[Face], point: np.ndarray, scale: float) -> np.ndarray:
    """Return the distances of faces from a point [m], (k,); on parts of gmsh's own kernel those of their samples."""
    if not gmsh.model.occ.getEntities(2):
        return np.array([np.linalg.norm(face.points - point, axis=1).min() for face in faces])
    point_tag = gmsh.model.occ.addPoint(*(point / scale))
    lengths = [gmsh.model.occ.getDistance(0, point_tag, 2, face.number)[0] for face in faces]
    gmsh.model.occ.remove([(0, point_tag)])
    return scale * np.array(lengths)


def _face(gmsh: Any, tag: int, solid: int, face_samples: Samples, sizes: tuple[float, float], name: str) -> Face:
    """Describe a face by its outward samples; `sizes` are the part's extent, and metres per unit of the model."""
    model, (points, normals, weights), (extent, scale) = gmsh.model, face_samples, sizes
    try:
        area, centre = float(model.occ.getMass(2, tag)), np.array(model.occ.getCenterOfMass(2, tag))
    except Exception:  # gmsh's own kernel integrates nothing
        area, centre = float(weights.sum()), weights @ points / weights.sum()
    volume_term = _share(face_samples)
    points = points * scale
    shape, residual = fit_shape(points, normals)
    hollow = False
    if shape and shape["kind"] != "plane":
        off = signed_distance(points + ASIDE * extent * scale * normals, shape)
        hollow = bool(off.mean() < 0)
    colour = tuple(model.getColor(2, tag))
    return Face(
        number=tag, solid=solid_name(gmsh, solid) or str(solid), area=area * scale**2,
        share=volume_term * scale**3, centre=centre * scale,
        extent=extent * scale, shape=shape, residual=residual, kind=shape.get("kind") or model.getType(2, tag).lower(),
        hollow=hollow, name=name, colour="" if colour == NO_COLOUR else "#{:02x}{:02x}{:02x}".format(*colour[:3]),
        points=points, edges=frozenset(int(edge) for edge in model.getAdjacencies(2, tag)[1]),
    )  # fmt: skip
