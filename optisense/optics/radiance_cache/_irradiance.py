"""Irradiance over all normals, from nine spherical-harmonic coefficients per cell and light group.

Nine coefficients (bands 0 to 2) give the irradiance of distant light to about one per cent for any
normal (Ramamoorthi and Hanrahan 2001).
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

BAND_0, BAND_1, BAND_2 = 3.141593, 2.094395, 0.785398
"""Factors by which convolution with a clamped cosine scales spherical harmonics of bands 0 to 2:
pi, 2 pi / 3 and pi / 4 (Ramamoorthi and Hanrahan 2001, equation 8)."""


def harmonics(n: mi.Vector3f) -> tuple[mi.Float, ...]:
    """Return the nine real spherical harmonics of bands 0 to 2, (n,) each, for unit directions
    (Ramamoorthi and Hanrahan 2001, equation 3).
    """
    x, y, z = n.x, n.y, n.z
    return (
        mi.Float(0.282095) + 0 * x,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3 * z * z - 1),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    )


@dr.syntax
def irradiance_table(moments: mi.Float, cells: int, bins: mi.UInt32, groups: int) -> mi.Float:
    """Return the irradiance coefficients and the vector sum of the light of each cell and group.

    Args:
        moments: the moments of a cache (see `Tables`).
        cells: number of cells.
        bins: number of direction bins of each cell.
        groups: number of light groups.

    Returns:
        Twelve floats of each cell and group, (12 cells groups,): nine coefficients of the
        irradiance (mW/mm^2) as a function of the normal, and the sum of the light's directions,
        each weighted with its flux density.
    """
    lane = dr.arange(mi.UInt32, cells * groups)
    cell, group = lane // groups, lane % groups
    sums = [mi.Float(0) for _ in range(9)]
    mean = mi.Vector3f(0)
    k = mi.UInt32(0)
    while dr.hint(k < bins, exclude=[moments, bins, groups, cell, group]):
        value = dr.gather(mi.Vector4f, moments, (cell * bins + k) * groups + group)
        if dr.hint(value.w != 0, exclude=[value]):
            flux = mi.Vector3f(value.x, value.y, value.z)
            mean += flux
            basis = harmonics(dr.normalize(flux) * dr.sign(value.w))
            for i in range(9):
                sums[i] += value.w * basis[i]
        k += 1
    dr.eval(sums, mean)  # together; otherwise the loop would run again for each array
    band = [BAND_0, *[BAND_1] * 3, *[BAND_2] * 5]
    out = dr.empty(mi.Float, cells * groups * 12)
    for i in range(9):
        dr.scatter(out, sums[i] * band[i], lane * 12 + i)
    for i in range(3):
        dr.scatter(out, mean[i], lane * 12 + 9 + i)
    return out


def irradiance(
    table: mi.Float, entry: mi.UInt32, normal: mi.Vector3f
) -> tuple[mi.Float, mi.Float, mi.Vector3f]:
    """Return the irradiance (n,), mW/mm^2, at normals, its mean over all normals (n,), and the
    vector sum of the light (3, n), mW/mm^2.

    Where all light is above the horizon of a normal, the irradiance equals the component of the
    vector sum along that normal.

    Args:
        table: the result of `irradiance_table`.
        entry: number (n,) of the cell times the number of light groups, plus that of the group.
        normal: unit normals.
    """
    a = dr.gather(mi.Vector4f, table, entry * 3)
    b = dr.gather(mi.Vector4f, table, entry * 3 + 1)
    c = dr.gather(mi.Vector4f, table, entry * 3 + 2)
    basis = harmonics(normal)
    values = (a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x)
    total = mi.Float(0)
    for value, weight in zip(values, basis, strict=True):
        total = total + value * weight
    return dr.maximum(total, 0), a.x * basis[0], mi.Vector3f(c.y, c.z, c.w)


def vector_sum(table: mi.Float, entry: mi.UInt32) -> mi.Vector3f:
    """Return the vector sum of the light (3, n), mW/mm^2, alone, as in `irradiance`."""
    third = dr.gather(mi.Vector4f, table, entry * 3 + 2)
    return mi.Vector3f(third.y, third.z, third.w)
