"""Fresnel reflectance and the lobes of rough surfaces, as NumPy functions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import FloatArray


def fresnel_dielectric(cosine: ArrayLike, eta: float | FloatArray) -> FloatArray:
    """Return the reflectance (...) of a smooth face between transparent media.

    The light is unpolarised (Fresnel's equations; Born and Wolf, 1.5.2); beyond the critical angle
    the reflectance is 1.

    Args:
        cosine: cosine (...) of the angle of incidence, 0 to 1.
        eta: index behind the face divided by the index in front of it.
    """
    ci = np.asarray(cosine, dtype=np.float64)
    sine2 = (1.0 - ci * ci) / (eta * eta)
    ct = np.sqrt(np.maximum(0.0, 1.0 - sine2))
    across = ((ci - eta * ct) / (ci + eta * ct)) ** 2
    along = ((eta * ci - ct) / (eta * ci + ct)) ** 2
    return np.where(sine2 >= 1.0, 1.0, 0.5 * (across + along))


def fresnel_metal(cosine: ArrayLike, eta: ArrayLike, k: ArrayLike) -> FloatArray:
    """Return the reflectance (..., c) of a smooth metal for unpolarised light (Born and Wolf,
    13.2).

    Args:
        cosine: cosine (...) of the angle of incidence.
        eta, k: real and imaginary part (c,) of the metal's index divided by the index before it.
    """
    ci = np.asarray(cosine, dtype=np.float64)[..., None]
    index = np.asarray(eta, dtype=np.float64) + 1j * np.asarray(k, dtype=np.float64)
    ct = np.sqrt(1.0 - (1.0 - ci * ci) / (index * index))
    across = np.abs((ci - index * ct) / (ci + index * ct)) ** 2
    along = np.abs((index * ci - ct) / (index * ci + ct)) ** 2
    return np.asarray(0.5 * (across + along))


def ggx_density(cosine: ArrayLike, alpha: float) -> FloatArray:
    """Return the GGX density (...) of facet normals, 1/sr (Walter et al. 2007, equation 33), by the
    cosine (...) of their angle with the mean normal.
    """
    cos2 = np.square(np.asarray(cosine, dtype=np.float64))
    return np.asarray(alpha**2 / (np.pi * np.square(cos2 * (alpha**2 - 1.0) + 1.0)))


def smith_shadowing(cosine: ArrayLike, alpha: float) -> FloatArray:
    """Return the share (...) of the facets that is visible from a direction, by the cosine (...) of
    its angle with the mean normal: Smith's masking function for GGX (Walter et al. 2007, equation
    34).
    """
    cos2 = np.maximum(np.square(np.asarray(cosine, dtype=np.float64)), 1e-12)
    tan2 = (1.0 - cos2) / cos2
    return np.asarray(2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * tan2)))


def sample_facets(view: FloatArray, alpha: float, u: FloatArray) -> FloatArray:
    """Sample unit normals (n, 3) of the facets visible from unit directions (n, 3), z above 0, by
    numbers (n, 2) from 0 to 1, in the frame where +z is the mean normal.

    Heitz, "Sampling the GGX distribution of visible normals", JCGT 7 (2018).
    """
    stretched = view * [alpha, alpha, 1.0]
    stretched /= np.linalg.norm(stretched, axis=1, keepdims=True)
    first = np.column_stack([-stretched[:, 1], stretched[:, 0], np.zeros(len(view))])
    length = np.linalg.norm(first, axis=1, keepdims=True)
    first = np.where(length > 1e-9, first / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
    second = np.cross(stretched, first)
    radius, turn = np.sqrt(u[:, 0]), 2.0 * np.pi * u[:, 1]
    a, b = radius * np.cos(turn), radius * np.sin(turn)
    lean = 0.5 * (1.0 + stretched[:, 2])
    b = (1.0 - lean) * np.sqrt(np.maximum(0.0, 1.0 - a * a)) + lean * b
    c = np.sqrt(np.maximum(0.0, 1.0 - a * a - b * b))
    normal = a[:, None] * first + b[:, None] * second + c[:, None] * stretched
    normal *= [alpha, alpha, 1.0]
    normal[:, 2] = np.maximum(normal[:, 2], 1e-9)
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))
