"""The response of the surface of an elastic layer on a rigid base to loads.

A layer of thickness h is bonded to a rigid base and loaded on its surface. For loads that vary as
exp(i q x), the equations of linear elasticity have a closed solution (its compliances are checked
in the tests against a numerical solution of the same equations). The response to a load on a small
square is that of a half-space, which has a closed form, plus a smooth correction, which is a Hankel
transform.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0, j1

from optisense.array_types import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

MAX_WAVE_NUMBER = 20.0
"""Largest wave number times thickness in the Hankel transforms. The layer's compliance differs from
the half-space's by terms of exp(-2 q h), which are 1e-15 there."""
PANELS, PANEL_POINTS = 100, 8
"""Number of panels of the Gauss-Legendre rule of the Hankel transforms, and of points in each:
twelve points for each oscillation of the Bessel function at `FARTHEST`."""
FARTHEST = 20.0
"""Distance over thickness beyond which displacements of the layer's surface are neglected; at ten
thicknesses, those of a bonded layer are below 1e-4 of those at one."""
TABLE_POINTS = 1200
"""Number of entries of a table of distances from 0 to `FARTHEST`; a cubic spline through them is
exact to 1e-6."""
TINY = 1e-300
"""Length (mm) added to arguments of logarithms: near the smallest number in double precision, it
keeps them finite where they are multiplied by zero, and changes no other."""


class Compliance(NamedTuple):
    """Response of a surface to loads that vary as exp(i q x), times q and the shear modulus.

    Attributes:
        normal: normal displacement by normal load.
        along: displacement along x by shear load along x.
        across: displacement along y by shear load along y.
        cross: displacement along x by normal load, a quarter of a period later; and the reverse.
    """

    normal: FloatArray
    along: FloatArray
    across: FloatArray
    cross: FloatArray


def layer_compliance(wave_number: ArrayLike, poisson_ratio: float) -> Compliance:
    """Return the compliances (...) of a bonded layer of thickness 1 by the product q h (...).

    With a = q h and k = 3 - 4 nu, all but `across` share the denominator k cosh 2a + 2 a^2 + (k^2 +
    1) / 2; their numerators are (1 - nu) (k sinh 2a - 2a), (1 - nu) (k sinh 2a + 2a) and (k (k - 1)
    (cosh 2a - 1) / 2 - 2 a^2) / 2. `across` is tanh a.
    """
    a = np.asarray(wave_number, dtype=np.float64)
    k = 3.0 - 4.0 * poisson_ratio
    decay = np.exp(-2.0 * a)  # numerators and denominator are multiplied by 2 exp(-2a)
    denominator = k * (1.0 + decay**2) + (4.0 * a**2 + k**2 + 1.0) * decay
    sinh, cosh = k * (1.0 - decay**2), 1.0 + decay**2 - 2.0 * decay
    cross = 0.25 * (k * (k - 1.0) * cosh - 8.0 * a**2 * decay)
    return Compliance(
        (1.0 - poisson_ratio) * (sinh - 4.0 * a * decay) / denominator,
        (1.0 - poisson_ratio) * (sinh + 4.0 * a * decay) / denominator,
        np.tanh(a),
        cross / denominator,
    )


def half_space_compliance(poisson_ratio: float) -> tuple[float, float, float, float]:
    """Return the values of `layer_compliance` for an infinitely thick layer."""
    share = 1.0 - poisson_ratio
    return share, share, 1.0, 0.5 * (1.0 - 2.0 * poisson_ratio)


class _Corrections(NamedTuple):
    """Splines of the difference between a layer of thickness and shear modulus 1 and a half-space,
    by distance.

    `isotropic` and `quadrupole` are the parts of shear compliance that do not depend on the
    direction, and that vary as the cosine of twice its angle.
    """

    normal: CubicSpline
    isotropic: CubicSpline
    quadrupole: CubicSpline
    cross: CubicSpline


@lru_cache(maxsize=32)
def _corrections(poisson_ratio: float) -> _Corrections:
    from scipy.interpolate import CubicSpline  # slow to import

    nodes, weights = np.polynomial.legendre.leggauss(PANEL_POINTS)
    panel = MAX_WAVE_NUMBER / PANELS
    q = (panel * (np.arange(PANELS)[:, None] + 0.5 * (nodes + 1.0))).ravel()
    weights = np.tile(0.5 * panel * weights / (2.0 * np.pi), PANELS)
    normal, along, across, cross = (
        layer - half_space
        for layer, half_space in zip(
            layer_compliance(q, poisson_ratio), half_space_compliance(poisson_ratio), strict=True
        )
    )
    distance = np.linspace(0.0, FARTHEST, TABLE_POINTS)
    phase = q * distance[:, None]
    bessel_0, bessel_1 = j0(phase), j1(phase)
    bessel_2 = 2.0 * np.divide(bessel_1, phase, out=np.zeros_like(phase), where=phase > 0.0)
    bessel_2[1:] -= bessel_0[1:]

    def transform(bessel: FloatArray, values: FloatArray) -> CubicSpline:
        return CubicSpline(distance, bessel @ (weights * values))

    return _Corrections(
        transform(bessel_0, normal),
        transform(bessel_0, 0.5 * (along + across)),
        transform(bessel_2, -0.5 * (along - across)),
        transform(bessel_1, -cross),
    )


def layer_correction(distance: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return the normal displacement (...), mm, of a layer by a point force, minus that of a
    half-space, at distances (...) from 0 to `FARTHEST` thicknesses, for 1 N, 1 mm and 1 MPa.
    """
    return np.asarray(_corrections(poisson_ratio).normal(distance))


def surface_displacement(x: FloatArray, y: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return the displacement (2, 3, ...), mm, along x and y of the surface of a bonded layer by 1
    N along x, along y and into the layer, for a thickness of 1 mm and a shear modulus of 1 MPa.

    Positions x and y (...) are relative to the force, in thicknesses. At the force itself the
    infinite part, which is the half-space's, is left out.
    """
    nu, splines = poisson_ratio, _corrections(poisson_ratio)
    r = np.hypot(x, y)
    inverse = np.divide(1.0, r, out=np.zeros_like(r), where=r > 0.0)
    cosine, sine = x * inverse, y * inverse
    far = np.minimum(r, FARTHEST)
    isotropic, quadrupole = splines.isotropic(far), splines.quadrupole(far)
    cross = splines.cross(far) - (1.0 - 2.0 * nu) / (4.0 * np.pi) * inverse
    scale = inverse / (2.0 * np.pi)
    alike = (1.0 - nu) * scale + isotropic
    twice = cosine**2 - sine**2
    mixed = (nu * scale + 2.0 * quadrupole) * cosine * sine
    return np.stack(
        [
            [alike + nu * scale * cosine**2 + quadrupole * twice, mixed, cross * cosine],
            [mixed, alike + nu * scale * sine**2 - quadrupole * twice, cross * sine],
        ]
    )


class LoadKernels(NamedTuple):
    """Displacements (mm) along the surface, at points, by unit loads (1 MPa) on a square around the
    origin.

    Attributes:
        xz, yz: displacement along x and y by pressure.
        xx, yy, xy: displacement along x by shear along x, y by y, and x by y (as y by x).
    """

    xz: FloatArray
    yz: FloatArray
    xx: FloatArray
    yy: FloatArray
    xy: FloatArray


@dataclass(frozen=True)
class SquareLoad:
    """A uniform load on a square of the surface of a bonded layer.

    The half-space's part of its effect is exact (Love 1929 for pressure; Cerruti's solution
    integrated for shear, as in Johnson, Contact Mechanics, 1985, section 3.6). The layer's
    correction is that of a point load.

    Attributes:
        side: side (mm) of the square, which is centred on the origin and parallel to x and y.
        thickness: thickness of the layer, mm.
        shear_modulus: shear modulus of the layer, MPa.
        poisson_ratio: Poisson's ratio of the layer, below 0.5.
    """

    side: float
    thickness: float
    shear_modulus: float
    poisson_ratio: float

    def pressed_in(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the normal displacement (...), mm, of points (...), mm, by a pressure of 1 MPa."""
        half_space = self._sum(_x_squared, x, y) + self._sum(_y_squared, x, y)
        half_space *= (1.0 - self.poisson_ratio) / (2.0 * np.pi)
        return self._total(half_space + self._corrected("normal", x, y), x, y)

    def kernels(self, x: FloatArray, y: FloatArray) -> LoadKernels:
        """Return the displacements along the surface, (...) each, mm, of points (...), mm."""
        nu, inverse = self.poisson_ratio, 1.0 / (2.0 * np.pi)
        x_part, y_part = self._sum(_x_squared, x, y), self._sum(_y_squared, x, y)
        r = np.hypot(x, y)
        cosine, sine = (
            np.divide(values, r, out=np.zeros_like(r), where=r > 0.0) for values in (x, y)
        )
        isotropic, quadrupole, cross = (
            self._corrected(name, x, y) for name in ("isotropic", "quadrupole", "cross")
        )
        twice = cosine**2 - sine**2
        coupling = 0.5 * (1.0 - 2.0 * nu) * inverse
        # Shear on a half-space: u_xx = ((1 - nu) / r + nu x^2 / r^3) / (2 pi mu) and the like.
        sideways = (
            -coupling * self._sum(_slope, x, y) + cross * cosine,
            -coupling * self._sum(_slope_of_y, x, y) + cross * sine,
            inverse * (x_part + (1.0 - nu) * y_part) + isotropic + quadrupole * twice,
            inverse * (y_part + (1.0 - nu) * x_part) + isotropic - quadrupole * twice,
            inverse * nu * self._sum(_mixed, x, y) + quadrupole * 2.0 * cosine * sine,
        )
        return LoadKernels(*(self._total(each, x, y) for each in sideways))

    def _sum(
        self, term: Callable[[FloatArray, FloatArray], FloatArray], x: FloatArray, y: FloatArray
    ) -> FloatArray:
        """Return the definite integral (...) over the square, from corners of an antiderivative."""
        half = self.side / 2.0
        upper = term(x + half, y + half) - term(x - half, y + half)
        return upper - term(x + half, y - half) + term(x - half, y - half)

    def _corrected(self, name: str, x: FloatArray, y: FloatArray) -> FloatArray:
        spline = getattr(_corrections(self.poisson_ratio), name)
        r = np.minimum(np.hypot(x, y) / self.thickness, FARTHEST)
        return np.asarray(spline(r)) * (self.side**2 / self.thickness)

    def _total(self, values: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
        near = np.hypot(x, y) < FARTHEST * self.thickness
        return np.where(near, values, 0.0) / self.shear_modulus


def _x_squared(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the antiderivative of x^2 / r^3 in x and y."""
    r = np.hypot(x, y)
    # ln(x + r), without cancellation where x is negative
    logarithm = np.log(np.abs(x) + r + TINY)
    return y * np.where(x >= 0.0, logarithm, 2.0 * np.log(np.abs(y) + TINY) - logarithm)


def _y_squared(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the antiderivative of y^2 / r^3 in x and y."""
    return _x_squared(y, x)


def _mixed(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the antiderivative of x y / r^3 in x and y."""
    return -np.hypot(x, y)


def _slope_of_y(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the antiderivative of y / r^2 in x and y."""
    return _slope(y, x)


def _slope(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the antiderivative of x / r^2 in x and y."""
    return y * np.log(np.hypot(x, y) + TINY) + x * np.arctan2(y, np.abs(x)) * np.sign(x)
