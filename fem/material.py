"""Isotropic St. Venant-Kirchhoff materials."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fem.bounds import real
from fem.errors import FemInputError


@dataclass(frozen=True)
class Material:
    """S = lambda tr(E) I + 2 mu E with the Green-Lagrange strain E.

    Attributes
    ----------
    young_modulus : Pa, positive.
    poisson_ratio : in (-1, 0.5).
    density : kg/m^3, positive.
    """

    young_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        if not 0.0 < real(self.young_modulus) < math.inf:
            raise FemInputError(
                "Young's modulus must be positive and finite", where="material", value=self.young_modulus
            )
        if not -1.0 < real(self.poisson_ratio) < 0.5:
            raise FemInputError("Poisson's ratio must lie in (-1, 0.5)", where="material", value=self.poisson_ratio)
        if not 0.0 < real(self.density) < math.inf:
            raise FemInputError("density must be positive and finite", where="material", value=self.density)

    @property
    def lame_lambda(self) -> float:
        """First Lame constant lambda = E nu / ((1 + nu)(1 - 2 nu)), Pa."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    @property
    def shear_modulus(self) -> float:
        """mu = E / (2 (1 + nu)), Pa."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))
