"""Light sources that emit photons: their positions, sizes and angular profiles.

A light is a rectangle, a disc or a point with an angular profile that is rotationally exact: a
power of the cosine (1 is Lambertian), or a table of radiant intensity over true angles (IES, spot).
Emission is importance sampled so that every photon carries the same power; a *guide* (see
``emission_guide.py``) may send more photons in directions from which they arrive at the sensing
surface.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.array_types import FloatingArray
from optisense.design.emitters import Intensity
from optisense.design.lights import frame_of
from optisense.optics.backend.arrays import floats, indices
from optisense.optics.scene.surfaces import CLEAR, RAY_OFFSET, RGB

POLAR_CELLS = 512
"""Number of polar cells of a tabulated profile; cells towards the rim hold less power. With 512,
the emission angles of a profile cos(angle)^20 are off by 0.03 degrees (root mean square over its
power)."""
AZIMUTH_CELLS = 128
"""Number of azimuthal cells of each polar cell, all of equal power; those of a round profile are
2.8 degrees wide, finer than the usual tables of luminaires (5 degrees and more)."""
UP_TURN = 90.0
"""Angle (degrees) about a light's direction, right-handed, from the width axis of its frame to its
`up`, at which the azimuth of its profile is 0."""
DISC_CORNERS = 12
"""Number of corners of the polygon that represents a round light window for rays that meet it. With
twelve, its outline is within 2.4 % of the radius of the disc; photons start from the exact disc."""
DISC_REACH = float(np.sqrt(2 * np.pi / (DISC_CORNERS * np.sin(2 * np.pi / DISC_CORNERS))))
"""Distance of these corners from the middle, in radii of the disc, with which the polygon has the
disc's area."""
FACE_CELLS = 16
"""Number of cells across and down the face of a light whose photons start in several media. The
photons of each cell start in one medium, so that a border across the face is off by at most half a
cell, which is 3 % of the face."""
FLOATS_PER_EMITTER = 20
"""Number of floats of a light in the emitter table; five gathers of four floats read them."""
FLOATS_PER_CELL = 5
"""Number of floats of a cell of the inverse tables: the columns of `_inverse`."""


class EmitterShape(IntEnum):
    """Outline of a light's emitting face."""

    POINT = 0
    RECTANGLE = 1
    DISC = 2


class StartMedium(NamedTuple):
    """The medium that photons of a light start in.

    Attributes:
        solid: number of the solid; -1 for air.
        absorption: its absorption coefficient at R, G, B, 1/mm.
    """

    solid: int = -1
    absorption: RGB = CLEAR


@dataclass(frozen=True)
class Emitter:
    """One light.

    Attributes:
        group: number of its light group.
        position: position, mm.
        direction: direction of the profile's axis, of any length.
        up: direction of the face's height axis, of any length.
        shape: outline of the emitting face.
        size: width and height of the emitting face, mm.
        exponent: power of the cosine of a profile without a table (1 is Lambertian).
        intensity: table of the angular profile; None for a power of the cosine.
        media: the medium in front of each cell of the face (`FACE_CELLS` along its width, then the
            next row along its height), or a single one if it is the same for all.
    """

    group: int
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    up: tuple[float, float, float] | None = None
    shape: EmitterShape = EmitterShape.POINT
    size: tuple[float, float] = (0.0, 0.0)
    exponent: float = 1.0
    intensity: Intensity | None = None
    media: tuple[StartMedium, ...] = (StartMedium(),)

    @property
    def area(self) -> float:
        """Area (mm^2) of the emitting face, 0 for a point."""
        filled = {
            EmitterShape.POINT: 0.0,
            EmitterShape.RECTANGLE: 1.0,
            EmitterShape.DISC: np.pi / 4,
        }[self.shape]
        return float(self.size[0] * self.size[1] * filled)

    @property
    def frame(self) -> FloatingArray:
        """Return the unit vectors (3, 3) of width axis, height axis and direction, as rows."""
        return frame_of(self.direction, self.up)


@dataclass
class EmitterTable:
    """All lights on the device.

    ``rows`` holds `FLOATS_PER_EMITTER` floats per light, ``polar`` and ``azimuth`` the inverse
    tables of the profiles, with five floats per cell. For each of the ``across`` x ``across`` cells
    of the face of each light, ``absorption`` holds three floats (1/mm at R, G, B) of the medium in
    front, and ``solids`` its number plus 1, which is less than ``media``; 0 is air.
    """

    count: int
    groups: int
    rows: mi.Float
    polar: mi.Float
    azimuth: mi.Float
    across: mi.UInt32
    absorption: mi.Float
    solids: mi.UInt32
    media: int
    emitters: list[Emitter] = field(default_factory=list)


def inverse_tables(intensity: Intensity) -> tuple[FloatingArray, FloatingArray]:
    """Return the inverse tables of an angular profile; see `_inverse` for their columns.

    Returns:
        Polar cells (POLAR_CELLS, 5) in cosines, and azimuthal cells (POLAR_CELLS, AZIMUTH_CELLS, 5)
        in angles from the light's width axis divided by 2 pi.
    """
    fine = 8192
    # Cells are evenly spaced in angle, which resolves narrow beams near the axis, and weighted with
    # their exact solid angle.
    angles = np.linspace(0.0, np.radians(intensity.polar[-1]), fine + 1)
    edges = np.cos(angles)
    middle = np.degrees(0.5 * (angles[1:] + angles[:-1]))
    phi = (np.arange(AZIMUTH_CELLS * 4) + 0.5) * 360.0 / (AZIMUTH_CELLS * 4)
    if len(intensity.azimuth) == 1:
        ring = intensity.at(middle, np.zeros(fine))
    else:
        ring = np.mean(
            [
                intensity.at(middle, np.full(fine, angle))
                for angle in phi[:: max(1, len(phi) // 128)]
            ],
            axis=0,
        )
    # Cells get smaller towards the rim, where the intensity falls to zero.
    share = 1 - (1 - np.linspace(0, 1, POLAR_CELLS + 1)) ** 2
    polar = _inverse(ring * -np.diff(edges), edges, share)
    steps = np.linspace(0.0, 1.0, AZIMUTH_CELLS + 1)
    if len(intensity.azimuth) == 1:
        return polar, np.tile(_inverse(np.ones(AZIMUTH_CELLS), steps, steps), (POLAR_CELLS, 1, 1))
    start, before, after, end, share_before = polar.T
    cosine = np.where(share_before >= 0.5, start + before, after + end) / 2
    centre = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    # Dark parts end at angles of the table.
    borders = np.union1d(np.linspace(0.0, 360.0, len(phi) + 1), intensity.azimuth)
    parts, turns = np.diff(borders), (borders + UP_TURN) / 360.0
    between = 0.5 * (borders[1:] + borders[:-1])
    rows = [intensity.at(np.full(len(between), angle), between) for angle in centre]
    rows = [values if values.any() else np.ones(len(between)) for values in rows]
    return polar, np.stack([_inverse(values * parts, turns, steps) for values in rows])


def _inverse(power: FloatingArray, edges: FloatingArray, shares: FloatingArray) -> FloatingArray:
    """Return cells that divide the power along an axis by given shares, without its dark parts.

    A cell has no dark part at its ends, and at most one gap, the widest dark part in between.
    Photons are distributed evenly over the part before the gap and over the part after it.

    Args:
        power: power (n,) between the edges.
        edges: places (n + 1,) along the axis, which ascend or descend.
        shares: shares (m + 1,) of the power at the borders of the cells, from 0 to 1.

    Returns:
        For each cell (m, 5): its start, the start and the end of its gap, its end, and the share of
        its power before the gap. A cell without a gap is all before it.
    """
    sums = np.concatenate([[0.0], np.cumsum(power)])
    sums /= sums[-1]
    lit = np.diff(sums) > 0
    dark = np.concatenate([[0.0], np.cumsum(np.where(lit, 0.0, np.diff(edges)))])
    keep = np.concatenate([[True], lit])
    borders = np.interp(shares, sums[keep], (edges - dark)[keep])  # with all gaps closed
    first = np.flatnonzero(~lit & np.concatenate([[True], lit[:-1]]))
    last = np.flatnonzero(~lit & np.concatenate([lit[1:], [True]])) + 1
    at, widths = sums[first], edges[last] - edges[first]
    passed = np.concatenate([[0.0], np.cumsum(widths)])
    start = borders[:-1] + passed[np.searchsorted(at, shares[:-1], "right")]
    end = borders[1:] + passed[np.searchsorted(at, shares[1:], "left")]
    cells = np.stack([start, end, end, end, np.ones(len(start))], axis=1)
    for gap in np.argsort(np.abs(widths)):
        cell = np.searchsorted(shares, at[gap], "right") - 1
        if cell < len(cells) and at[gap] > shares[cell]:
            before = (at[gap] - shares[cell]) / (shares[cell + 1] - shares[cell])
            cells[cell, [1, 2, 4]] = edges[first[gap]], edges[last[gap]], before
    return cells


def emitter_table(emitters: list[Emitter], groups: int) -> EmitterTable:
    """Copy lights to the device; lights that share an intensity table share its inverse."""
    rows = np.zeros((len(emitters), FLOATS_PER_EMITTER), dtype=np.float32)
    profiles: dict[int, int] = {}
    polar: list[FloatingArray] = []
    azimuth: list[FloatingArray] = []
    for row, emitter in zip(rows, emitters, strict=True):
        profile = -1
        if emitter.intensity is not None:
            profile = profiles.setdefault(id(emitter.intensity), len(profiles))
            if profile == len(polar):
                for cells, all_cells in zip(
                    inverse_tables(emitter.intensity), (polar, azimuth), strict=True
                ):
                    all_cells.append(cells.ravel())
        frame = emitter.frame
        row[0:3] = emitter.position
        row[4:7], row[8:11], row[12:15] = frame
        row[7], row[11] = emitter.size[0] / 2, emitter.size[1] / 2
        row[15] = emitter.exponent
        bits = np.array([emitter.group, emitter.shape, profile + 1], dtype=np.uint32)
        row[3], row[16], row[17] = bits.view(np.float32)
    if not polar:
        polar, azimuth = [np.zeros(FLOATS_PER_CELL)], [np.zeros(FLOATS_PER_CELL)]
    across = FACE_CELLS if any(len(emitter.media) > 1 for emitter in emitters) else 1
    media = [
        medium
        for emitter in emitters
        for medium in emitter.media * (across**2 // len(emitter.media))
    ]
    return EmitterTable(
        count=len(emitters),
        groups=groups,
        rows=floats(rows),
        polar=floats(np.concatenate(polar)),
        azimuth=floats(np.concatenate(azimuth)),
        across=dr.opaque(mi.UInt32, across),
        absorption=floats(np.array([medium.absorption for medium in media])),
        solids=indices(np.array([medium.solid + 1 for medium in media])),
        media=max(medium.solid for medium in media) + 2,
        emitters=list(emitters),
    )


def profile_direction(
    table: EmitterTable, profile: mi.UInt32, exponent: mi.Float, sample: mi.Point2f
) -> mi.Vector3f:
    """Return the unit directions (3, n) of samples of equal power, along the light's width axis,
    height axis and direction.

    Args:
        profile: number (n,) of the inverse table of the light's profile plus 1; 0 is a power of the
            cosine.
        exponent: the power (n,) of the cosine where ``profile`` is 0.
        sample: point of the unit square.
    """
    tabulated = profile > 0
    base = dr.maximum(profile, 1) - 1
    # The inverse of the spacing of cells in ``inverse_tables``.
    place = (1 - dr.safe_sqrt(1 - sample.x)) * POLAR_CELLS
    cell = dr.minimum(mi.UInt32(place), POLAR_CELLS - 1)
    ring = base * POLAR_CELLS + cell
    cosine = dr.select(
        tabulated,
        _place(table.polar, ring, place - mi.Float(cell), tabulated),
        dr.power(1 - sample.x, dr.rcp(exponent + 1)),
    )
    turn = sample.y * AZIMUTH_CELLS
    step = dr.minimum(mi.UInt32(turn), AZIMUTH_CELLS - 1)
    around = _place(table.azimuth, ring * AZIMUTH_CELLS + step, turn - mi.Float(step), tabulated)
    phi = dr.two_pi * dr.select(tabulated, around, sample.y)
    sine = dr.safe_sqrt(1 - cosine * cosine)
    sin_phi, cos_phi = dr.sincos(phi)
    return mi.Vector3f(sine * cos_phi, sine * sin_phi, cosine)


def _place(table: mi.Float, cell: mi.UInt32, share: mi.Float, active: mi.Bool) -> mi.Float:
    """Return the places (n,) of shares of the power within cells of `_inverse`."""
    start, before, after, end, split = (
        dr.gather(mi.Float, table, cell * FLOATS_PER_CELL + k, active)
        for k in range(FLOATS_PER_CELL)
    )
    return dr.select(
        share <= split,
        dr.lerp(start, before, share / split),
        dr.lerp(after, end, (share - split) / (1 - split)),
    )


def emit(
    table: EmitterTable, light: mi.UInt32, angle: mi.Point2f, place: mi.Point2f
) -> tuple[mi.Point3f, mi.Vector3f, mi.UInt32, mi.UInt32]:
    """Return origin (3, n), mm, unit direction (3, n), light group (n,) and number (n,) of the cell
    of all lights' faces, of photons of equal power.

    Args:
        light: number (n,) of the light.
        angle: point of the unit square that chooses the direction.
        place: point of the unit square that chooses the place on the emitting face.
    """
    a = dr.gather(mi.Vector4f, table.rows, light * 5)
    b = dr.gather(mi.Vector4f, table.rows, light * 5 + 1)
    c = dr.gather(mi.Vector4f, table.rows, light * 5 + 2)
    d = dr.gather(mi.Vector4f, table.rows, light * 5 + 3)
    e = dr.gather(mi.Vector4f, table.rows, light * 5 + 4)
    group = dr.reinterpret_array(mi.UInt32, a.w)
    shape = dr.reinterpret_array(mi.UInt32, e.x)
    profile = dr.reinterpret_array(mi.UInt32, e.y)
    s, t, n = (mi.Vector3f(v.x, v.y, v.z) for v in (b, c, d))
    local = profile_direction(table, profile, d.w, angle)
    disc = mi.warp.square_to_uniform_disk_concentric(place)
    square = 2 * place - 1
    offset = dr.select(shape == int(EmitterShape.DISC), disc, square)
    point = mi.Point3f(a.x, a.y, a.z) + s * (offset.x * b.w) + t * (offset.y * c.w) + n * RAY_OFFSET
    direction = s * local.x + t * local.y + n * local.z
    column, row = (
        dr.minimum(mi.UInt32((along + 1) * mi.Float(table.across) / 2), table.across - 1)
        for along in (offset.x, offset.y)
    )
    cell = (light * table.across + row) * table.across + column
    return mi.Point3f(point), mi.Vector3f(direction), group, cell
