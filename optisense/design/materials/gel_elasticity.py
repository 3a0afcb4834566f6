"""Elastic constants of an elastomer."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from optisense.design.fields import Model, NonNegative, Number, Positive

MAX_POISSON_RATIO = 0.4999
"""Largest Poisson ratio of a material. At 0.5 it would be incompressible and its bulk modulus
infinite; measured values of silicones are 0.48 to 0.4999.
"""


class GelElasticity(Model):
    """Constants of linear isotropic elasticity of a gel, and its friction."""

    youngs_modulus: Positive = Field(
        description="Young's modulus", examples=[0.435], json_schema_extra={"unit": "MPa"}
    )
    poisson_ratio: Annotated[Number, Field(ge=0.0, le=MAX_POISSON_RATIO)] = Field(
        default=0.49, description="Poisson ratio; near 0.5 for silicones"
    )
    friction: NonNegative = Field(
        default=1.0, description="coefficient of friction of the coated skin"
    )
