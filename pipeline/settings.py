"""How a component is reduced."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class ModesSettings(BaseModel):
    """How a component is reduced."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    recipe: Literal["macneal", "normal+static", "rigid"] = Field(
        default="macneal",
        description="macneal: what the kept shapes lack stays as massless residual flexibility R; normal+static: it is"
        " dropped, contact then needs method 'penalty'; rigid: no elastic coordinates at all",
    )
    normal_count: int = Field(default=30, ge=1, description="Elastic normal modes; recipe 'rigid' has none")
    static_count: int = Field(
        default=0, ge=0, description="Static correction shapes of each interface of kind 'points' or 'traction'"
    )
