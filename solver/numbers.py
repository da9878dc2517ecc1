"""Numbers that scene files share."""

from typing import Annotated

from pydantic import ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


STRICT = ConfigDict(extra="forbid", frozen=True)
