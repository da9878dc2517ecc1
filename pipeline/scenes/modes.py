"""How a component is held, how it is reduced, and where stress is read of it."""

from typing import Literal

from pydantic import BaseModel, Field, ValidationInfo, field_validator

from gudgeon.pipeline.geometry.numbers import STRICT

ALL_FOR_ZERO = ("craig-bampton", "interface", "partial-interface", "attachment")
"""Reductions for which a normal_count of 0 means all that they make."""


def is_absent(value: object) -> bool:
    """Return whether a key was left out: it then stays out of what identifies a record."""
    return value is None or value == ()


class ModesSettings(BaseModel):
    """How a component is reduced."""

    model_config = STRICT
    reduction: Literal[
        "macneal",
        "normal+static",
        "craig-bampton",
        "fixed-reference",
        "ritz",
        "rubin",
        "attachment",
        "interface",
        "partial-interface",
        "rigid",
    ] = Field(
        default="macneal",
        description="macneal: what the kept shapes lack stays as massless residual flexibility R; normal+static: it is"
        " dropped, contact then needs method 'penalty'; craig-bampton, fixed-reference, ritz: other kept shapes than"
        " normal modes of the free body, with R; rubin: normal modes and a shape of every contact row, with mass;"
        " attachment: the rows' static shapes alone; interface: craig-bampton with modes for the boundary's dofs;"
        " partial-interface: the same, some of the dofs kept; rigid: no elastic coordinates at all",
    )
    normal_count: int = Field(
        default=30,
        ge=0,
        description="Elastic normal modes or Ritz vectors; 0 is all that reductions 'craig-bampton', 'interface',"
        " 'partial-interface' and 'attachment' make; reduction 'rigid' has none",
    )
    static_count: int = Field(
        default=0,
        ge=0,
        description="Static correction shapes of each interface of kind 'points', 'traction' or 'patch'",
    )
    substructures: int = Field(
        default=1,
        ge=1,
        description="Parts of a body along its longest axis; for reductions 'craig-bampton', 'interface' and"
        " 'partial-interface'",
    )
    fixed_count: int = Field(
        default=10,
        ge=0,
        description="Fixed-interface modes of each substructure; for reductions 'craig-bampton', 'interface' and"
        " 'partial-interface'",
    )
    boundary: tuple[str, ...] = Field(
        default=(),
        exclude_if=is_absent,
        description="Surfaces whose dofs are boundary, beside those that interfaces and cuts touch; for reductions"
        " 'craig-bampton', 'interface' and 'partial-interface'",
    )
    kept: tuple[str, ...] = Field(
        default=(),
        exclude_if=is_absent,
        description="Surfaces and interfaces whose boundary dofs stay physical; for reduction 'partial-interface'",
    )
    interface_count: int | None = Field(
        default=None,
        exclude_if=is_absent,
        ge=0,
        description="Elastic interface modes for the boundary dofs that are not kept; all by default; for reductions"
        " 'interface' and 'partial-interface'",
    )
    reference: str | None = Field(
        default=None,
        validate_default=True,
        description="Surface that reduction 'fixed-reference' clamps; with any reduction, where the reaction is measured",
    )
    ritz_count: int | None = Field(
        default=None,
        validate_default=True,
        ge=1,
        description="Load-dependent vectors that reduction 'ritz' generates; twice normal_count by default",
    )

    @field_validator("normal_count")
    @classmethod
    def _at_least_one(cls, value: int, info: ValidationInfo) -> int:
        if value == 0 and (reduction := info.data.get("reduction", "macneal")) not in ALL_FOR_ZERO:
            names = ", ".join(f"'{name}'" for name in ALL_FOR_ZERO)
            raise ValueError(f"0 given, reduction '{reduction}' needs 1 or more; only {names} take 0, for all")
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
        least = info.data.get("normal_count", 1)
        if value is not None and value < least:
            raise ValueError(f"{value} given, at least normal_count = {least} vectors are needed")
        return value
