"""The `modes` table of a component: its reduction and the number of coordinates."""

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from gudgeon.solver.numbers import MOST, EachOnce, Strict

Reduction = Literal[
    "macneal", "normal+static", "craig-bampton", "row-craig-bampton", "fixed-reference", "ritz", "rubin", "attachment",
    "interface", "partial-interface", "rigid", "rubin-macneal",
]  # fmt: skip
ALL_FOR_ZERO = ("craig-bampton", "row-craig-bampton", "interface", "partial-interface", "attachment")
"""Reductions for which a normal_count of 0 means all modes."""


def optional(description: str, default: Any = None, **limits: Any) -> Any:
    """Return a field that is no part of a record's key where it has its default."""
    return Field(default=default, exclude_if=lambda value: value == default, description=description, **limits)


class Swap(Strict):
    """Bases between which a run changes as a moving force passes over the body.

    The traction space of the force is divided along into equal parts. Each basis has the normal modes, and Ritz vectors
    of the force at evenly spaced places of its part, ends included, so that neighbours have those of their border.
    """

    bases: int = Field(ge=1, le=MOST, description="Number of bases, one for each part of the traction space")
    vectors: int = Field(default=4, ge=2, le=MOST, description="Ritz vectors per basis, added to the normal modes")


class ModesSettings(Strict):
    """Reduction of a component."""

    reduction: Reduction = Field(
        default="macneal",
        description="macneal: normal modes and static correction modes, with the flexibility of the other modes as"
        " massless residual flexibility R; normal+static: the same without R, contact then needs method 'penalty';"
        " craig-bampton, fixed-reference, ritz: other shapes than normal modes of the free body, with R;"
        " row-craig-bampton: constraint modes of the interfaces' rows and modes with these rows held; rubin: normal"
        " modes and a static shape with mass of every contact row; rubin-macneal: such shapes of loads and"
        " ties alone, and R of the others; attachment: only the static shapes of the rows;"
        " interface: craig-bampton with modes instead of the boundary dofs; partial-interface: the same with some"
        " boundary dofs kept; rigid: no elastic coordinates",
    )
    normal_count: int = Field(
        default=30,
        ge=0,
        le=MOST,
        description="Number of elastic normal modes or Ritz vectors (default: 30; on bars with normal modes, as many as"
        " the mesh resolves, 0.6 an element, from 30 to 180; of"
        " reductions 'row-craig-bampton' and 'attachment' all, where they have fewer); 0: all, for reductions"
        " 'craig-bampton', 'row-craig-bampton', 'interface', 'partial-interface' and 'attachment'; not used by"
        " reduction 'rigid'",
    )
    static_count: int = Field(
        default=0,
        ge=0,
        le=MOST,
        description="Static correction modes of each interface of kind 'points', 'traction' or 'patch'",
    )
    substructures: int = Field(
        default=1,
        ge=1,
        le=MOST,
        description="Number of substructures along the body's longest axis; for reductions 'craig-bampton',"
        " 'interface' and 'partial-interface'",
    )
    fixed_count: int = Field(
        default=10,
        ge=0,
        le=MOST,
        description="Fixed-interface modes of each substructure; for reductions 'craig-bampton', 'row-craig-bampton',"
        " which has one, 'interface' and 'partial-interface'",
    )
    boundary: Annotated[tuple[str, ...], EachOnce] = optional(
        "Surfaces with boundary dofs, in addition to those of interfaces and cuts; for reductions 'craig-bampton',"
        " 'interface' and 'partial-interface'",
        default=(),
    )
    kept: Annotated[tuple[str, ...], EachOnce] = optional(
        "Surfaces and interfaces whose boundary dofs are kept; for reduction 'partial-interface'", default=()
    )
    interface_count: int | None = optional(
        "Elastic interface modes of the boundary dofs that are not kept; default: all; for reductions 'interface' and"
        " 'partial-interface'",
        ge=0,
        le=MOST,
    )
    reference: str | None = Field(
        default=None,
        validate_default=True,
        description="Surface where the reaction is recorded; reduction 'fixed-reference' clamps it",
    )
    ritz_count: int | None = Field(
        default=None,
        validate_default=True,
        ge=1,
        le=MOST,
        description="Load-dependent vectors that reduction 'ritz' generates; default: twice normal_count",
    )

    swap: Swap | None = optional(
        "Bases between which a run changes as the body's moving force passes; for reduction 'normal+static'"
    )

    @field_validator("swap")
    @classmethod
    def _without_residual(cls, value: Swap | None, info: ValidationInfo) -> Swap | None:
        if value is not None and (reduction := info.data.get("reduction", "macneal")) != "normal+static":
            raise ValueError(
                f"is for reduction 'normal+static', '{reduction}' given: R, or its other shapes, have what vectors add"
            )
        return value

    def kept_of(self, available: int) -> int:
        """Return how many of the coordinates that a reduction can have are kept: all for 0, at most the default where
        none is given; more than there are where more are asked for."""
        if "normal_count" not in self.model_fields_set:
            return min(self.normal_count, available)
        return self.normal_count or available

    @field_validator("normal_count")
    @classmethod
    def _at_least_one(cls, value: int, info: ValidationInfo) -> int:
        if value == 0 and (reduction := info.data.get("reduction", "macneal")) not in ALL_FOR_ZERO:
            names = ", ".join(f"'{name}'" for name in ALL_FOR_ZERO)
            raise ValueError(f"0 given; reduction '{reduction}' needs 1 or more, only {names} allow 0 (all)")
        return value

    @field_validator("reference")
    @classmethod
    def _is_named(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is None and info.data.get("reduction") == "fixed-reference":
            raise ValueError("is missing; reduction 'fixed-reference' needs the name of a surface")
        return value

    @field_validator("ritz_count")
    @classmethod
    def _enough(cls, value: int | None, info: ValidationInfo) -> int | None:
        minimum = info.data.get("normal_count", 1)
        if value is not None and value < minimum:
            raise ValueError(f"{value} given, at least normal_count = {minimum} vectors are needed")
        return value
