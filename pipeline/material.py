"""What a component is made of."""

from pydantic import BaseModel, ConfigDict, Field


class Material(BaseModel):
    """Isotropic linear elasticity."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    E: float = Field(gt=0, allow_inf_nan=False, description="Young's modulus [Pa]")
    nu: float = Field(gt=-1, lt=0.5, description="Poisson's ratio")
    rho: float = Field(gt=0, allow_inf_nan=False, description="Density [kg/m^3]")
