"""A frame of straight beams in space, joined at nodes, on a line mesh."""

from itertools import pairwise
from typing import Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.geometry.cells import FRAME2
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.numbers import NonZero, Point
from gudgeon.pipeline.geometry.section import Section
from gudgeon.pipeline.geometry.shapes.beam import NEAREST, OfSection, divided
from gudgeon.pipeline.geometry.surfaces import point_surface
from gudgeon.solver.numbers import Length, Name, Strict

PARALLEL = 1e-6
"""Sine of the angle between a member and its `up` below which this gives no lateral axis."""


class Member(Strict):
    """A straight beam between two nodes of a frame."""

    start: str = Field(description="Node where it begins")
    end: str = Field(description="Node where it ends")
    up: NonZero = Field(
        default=(0.0, 0.0, 1.0),
        description="Direction of the height of its section, as far as it is across the axis; the lateral axis is"
        " up × axis",
    )
    stations: dict[Name, Length] = Field(
        default={}, description="Named positions along it, by their distance from its start [m]"
    )


class Frame(OfSection):
    """Frame of beams of one section: bending in both planes, stretch and torsion."""

    kind: Literal["frame"]
    section: Section = Field(description="Cross-section of all members")
    nodes: dict[Name, Point] = Field(min_length=2, description="Places where members begin and end [m], by name")
    members: dict[Name, Member] = Field(min_length=1, description="Straight beams between nodes, by name")
    groups: dict[Name, tuple[str, ...]] = Field(
        default={}, description="Surfaces of several nodes, such as those of a rigid hub or of a support, by name"
    )

    @field_validator("section")
    @classmethod
    def _can_twist(cls, value: Section) -> Section:
        lacking = [key for key in ("lateral_moment", "torsion_constant") if getattr(value, key, None) is None]
        if lacking:
            raise ValueError(
                f"a frame needs {' and '.join(lacking)} of the section: use kind 'rectangle' or 'circle', or give them"
                " with kind 'general'"
            )
        return value

    @field_validator("members")
    @classmethod
    def _between_nodes(cls, value: dict[str, Member], info: ValidationInfo) -> dict[str, Member]:
        nodes = info.data.get("nodes")
        if nodes is None:
            return value
        for name, member in value.items():
            for key in ("start", "end"):
                if (node := getattr(member, key)) not in nodes:
                    raise ValueError(f"{name}.{key} = '{node}' given, the frame has the nodes {', '.join(nodes)}")
            along = np.subtract(nodes[member.end], nodes[member.start])
            length = float(np.linalg.norm(along))
            if not length > 0:
                raise ValueError(f"{name}: its start and end are the same point; a length above zero is needed")
            if np.linalg.norm(np.cross(along, member.up)) < PARALLEL * length * np.linalg.norm(member.up):
                raise ValueError(f"{name}.up: {list(member.up)} given, it is along the member; give one across it")
            for station, x in member.stations.items():
                if not NEAREST * length < x < (1 - NEAREST) * length:
                    raise ValueError(
                        f"{name}.stations.{station} = {x} given, a station is between 0 and the length {length:g} m"
                    )
        return value

    @field_validator("groups")
    @classmethod
    def _of_nodes(cls, value: dict[str, tuple[str, ...]], info: ValidationInfo) -> dict[str, tuple[str, ...]]:
        nodes = info.data.get("nodes", ())
        for name, members in value.items():
            unknown = [node for node in members if node not in nodes]
            if not members or (unknown and nodes):
                raise ValueError(f"{name}: {list(members)} given; name nodes of the frame: {', '.join(nodes)}")
        return value

    @model_validator(mode="after")
    def _names_once(self) -> "Frame":
        every = [*self.nodes, *self.groups, *(name for m in self.members.values() for name in m.stations)]
        twice = sorted({name for name in every if every.count(name) > 1})
        if twice:
            raise ValueError(f"'{twice[0]}' names two of its nodes, groups and stations; each needs a name of its own")
        loose = set(self.nodes) - {node for m in self.members.values() for node in (m.start, m.end)}
        if loose:
            raise ValueError(f"nodes.{min(loose)}: no member begins or ends there; remove it")
        return self

    @property
    def lateral_moment(self) -> float:
        """Second moment of area about the axis in the plane of bending [m^4]."""
        return float(self.section.lateral_moment)  # type: ignore[union-attr, arg-type]

    @property
    def torsion_constant(self) -> float:
        """Torsional stiffness over G [m^4]."""
        return float(self.section.torsion_constant)  # type: ignore[union-attr, arg-type]

    def places(self) -> dict[str, str]:
        """Return the member of every station."""
        return {station: name for name, member in self.members.items() for station in member.stations}

    def axes(self, member: str) -> np.ndarray:
        """Return axis, lateral axis and up of a member as rows, right-handed, (3, 3)."""
        beam = self.members[member]
        along = np.subtract(self.nodes[beam.end], self.nodes[beam.start])
        along = along / np.linalg.norm(along)
        lateral = np.cross(beam.up, along)
        lateral /= np.linalg.norm(lateral)
        return np.array([along, lateral, np.cross(along, lateral)])

    def element_axes(self, mesh: MeshRecord) -> np.ndarray:
        """Return the axes of each element as rows, (e, 3, 3)."""
        axes = np.full((len(mesh.cells), 3, 3), np.nan)
        for name in self.members:
            axes[mesh.volumes[name]] = self.axes(name)
        if not np.isfinite(axes).all():
            raise ValueError(f"the mesh has {len(mesh.cells)} elements, of which some belong to no member of the frame")
        return axes

    def build(self, size: float) -> MeshRecord:
        """Divide the members into elements no longer than `size` [m], with nodes at the stations."""
        total = sum(np.linalg.norm(np.subtract(self.nodes[m.end], self.nodes[m.start])) for m in self.members.values())
        refuse_large("line", float(total) / size, size)
        ids = {name: n for n, name in enumerate(self.nodes)}
        nodes, cells, volumes = list(np.array(list(self.nodes.values()), float)), list[list[int]](), {}
        for name, member in self.members.items():
            start, end = (np.array(self.nodes[node], float) for node in (member.start, member.end))
            length = float(np.linalg.norm(end - start))
            stops = sorted({0.0, length, *member.stations.values()})
            stations = np.concatenate([[0.0], *(divided(a, b, size) for a, b in pairwise(stops))])
            line = [ids[member.start], *range(len(nodes), len(nodes) + len(stations) - 2), ids[member.end]]
            nodes += [start + x / length * (end - start) for x in stations[1:-1]]
            for station, x in member.stations.items():
                ids[station] = line[int(np.abs(stations - x).argmin())]
            volumes[name] = np.arange(len(cells), len(cells) + len(line) - 1)
            cells += [list(two) for two in pairwise(line)]
        up, area = np.array([0.0, 0.0, 1.0]), self.section.area
        surfaces = {name: point_surface(n, up, area, nodes[n]) for name, n in ids.items()}
        surfaces |= {name: Surface(np.array([[ids[node]] for node in ones]), {}) for name, ones in self.groups.items()}
        return MeshRecord(np.array(nodes), np.array(cells), FRAME2.name, surfaces, volumes)
