"""The table of the optical data of surfaces on the device."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.scene.surfaces import CLEAR, Surface, SurfaceKind

FLOATS_PER_SURFACE = 16
"""Number of floats of a surface in the table of optical data; four gathers of four floats read
them."""


def surface_table(surfaces: list[Surface]) -> mi.Float:
    """Return the optical data of n surfaces on the device, (16 n,): those of `surface_rows`."""
    return mi.Float(surface_rows(surfaces).ravel())


def surface_rows(surfaces: list[Surface]) -> np.ndarray:
    """Return the rows (n, 16) float32 of the table of optical data.

    The four groups of four floats are: kind (as bits), eta, alpha, specularity | reflectance,
    region | metal eta, light | metal k. Dielectrics have the etas of the channels in place of the
    reflectance, the absorption coefficients inside and outside in place of the metal's eta and k,
    and in the last float a flag that these are known.
    """
    rows = np.zeros((len(surfaces), FLOATS_PER_SURFACE), dtype=np.float32)
    for row, surface in zip(rows, surfaces, strict=True):
        bits = np.array([int(surface.kind), int(surface.region), surface.light], dtype=np.uint32)
        row[0], row[7], row[11] = bits.view(np.float32)
        row[1:4] = surface.eta, surface.alpha, surface.specularity
        row[4:7] = surface.reflectance
        row[8:11] = surface.metal_eta
        row[12:15] = surface.metal_k
        if surface.kind is SurfaceKind.DIELECTRIC:
            row[4:7] = surface.eta if surface.etas is None else surface.etas
            row[8:11], row[12:15] = surface.absorption or (CLEAR, CLEAR)
            row[15] = surface.absorption is not None
    return rows


def surface_kind(
    table: mi.Float, surface: mi.UInt32, active: mi.Bool
) -> tuple[mi.UInt32, mi.Float, mi.Float]:
    """Return the kind, eta and alpha, (n,) each, of surfaces (n,).

    The arguments ``table``, ``surface`` and ``active`` of this and the following functions are the
    table of `surface_table`, the numbers (n,) of surfaces in it, and a mask (n,).
    """
    row = dr.gather(mi.Vector4f, table, surface * 4, active)
    return dr.reinterpret_array(mi.UInt32, row.x), row.y, row.z


def channel_eta(
    table: mi.Float, surface: mi.UInt32, channel: mi.UInt32, active: mi.Bool
) -> mi.Float:
    """Return the eta (n,) of dielectrics for light of one channel (n,), 0 to 2 for R, G, B."""
    return dr.gather(mi.Float, table, surface * FLOATS_PER_SURFACE + 4 + channel, active)


def media_absorption(
    table: mi.Float, surface: mi.UInt32, active: mi.Bool
) -> tuple[mi.Bool, mi.Color3f, mi.Color3f]:
    """Return whether the media of dielectrics are known (n,), and their absorption coefficients
    (3, n), 1/mm, in front of the face normal and behind it.
    """
    inside = dr.gather(mi.Vector4f, table, surface * 4 + 2, active)
    outside = dr.gather(mi.Vector4f, table, surface * 4 + 3, active)
    behind = mi.Color3f(inside.x, inside.y, inside.z)
    return outside.w > 0, mi.Color3f(outside.x, outside.y, outside.z), behind


def surface_region(table: mi.Float, surface: mi.UInt32, active: mi.Bool) -> mi.UInt32:
    """Return the `Region` (n,) of surfaces."""
    return dr.reinterpret_array(
        mi.UInt32, dr.gather(mi.Float, table, surface * FLOATS_PER_SURFACE + 7, active)
    )


def surface_light(table: mi.Float, surface: mi.UInt32, active: mi.Bool) -> mi.UInt32:
    """Return the number (n,) of the light whose emitting face a surface is."""
    return dr.reinterpret_array(
        mi.UInt32, dr.gather(mi.Float, table, surface * FLOATS_PER_SURFACE + 11, active)
    )
