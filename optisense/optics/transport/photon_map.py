"""Photon maps: the landings of the photons of a pass, and the buffers that record them."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

GROUP_MASK = 0xFF
"""Mask of the bits of a photon's record that hold its light group: the lowest eight."""
HALF_SHIFT = 8
"""Position of the bit that is set for photons of odd number, next to the light group. The
difference between the two halves gives the noise."""
SURFACE_SHIFT = 9
"""Position of the first bit of the number of the surface that a photon landed on; the record's
other 23 bits hold it."""


@dataclass
class PhotonMap:
    """The landings of one photon pass.

    Attributes:
        count: number of landings.
        emitted: number of photons of all lights, including those that are not lit in this pass.
        emitted_power: power of a photon as it is emitted, for a light of 1 mW, in the mean.
        place: four floats per landing: x, y, z (mm) and bits (light group, half, surface).
        travel: four floats per landing: the unit direction and the cosine of incidence.
        power: the photon's share of a light of 1 mW, per channel if ``coloured``.
        coloured: whether powers differ between the channels.
        passing: the photons that crossed the flux layer, if one was given. The layer's height over
            the length of path that each stands for takes the place of the cosine.
    """

    count: int
    emitted: int
    emitted_power: float
    place: mi.Float
    travel: mi.Float
    power: mi.Float
    coloured: bool
    passing: PhotonMap | None = None


@dataclass
class Records:
    """A buffer for the landings of a pass, with a fixed capacity.

    Attributes:
        capacity: number of landings that the buffer can hold.
        counter: number of landings, including those that did not fit.
        place, travel, power: as in `PhotonMap`.
        coloured: whether powers differ between the channels.
    """

    capacity: mi.UInt32
    counter: mi.UInt32
    place: mi.Float
    travel: mi.Float
    power: mi.Float
    coloured: bool

    @classmethod
    def of(cls, capacity: int, coloured: bool) -> Records:
        """Return empty records for this number of landings."""
        size = max(capacity, 1)
        return cls(
            capacity=dr.opaque(mi.UInt32, capacity),
            counter=dr.zeros(mi.UInt32, 1),
            place=dr.empty(mi.Float, size * 4),
            travel=dr.empty(mi.Float, size * 4),
            power=dr.empty(mi.Float, size * (4 if coloured else 1)),
            coloured=coloured,
        )

    def write(self, landing: Landing, where: mi.Bool) -> None:
        """Add the landings that the mask ``where`` selects; symbolic loops may call it."""
        slot = dr.scatter_inc(self.counter, mi.UInt32(0), where)
        kept = where & (slot < self.capacity)
        p, d, t = landing.point, landing.direction, landing.power
        place = mi.Vector4f(p.x, p.y, p.z, dr.reinterpret_array(mi.Float, landing.bits))
        dr.scatter(self.place, place, slot, kept)
        dr.scatter(self.travel, mi.Vector4f(d.x, d.y, d.z, landing.cosine), slot, kept)
        if self.coloured:
            dr.scatter(self.power, mi.Vector4f(t.x, t.y, t.z, 0), slot, kept)
        else:
            dr.scatter(self.power, t.x, slot, kept)

    def photon_map(
        self, emitted: int, emitted_power: float, passing: PhotonMap | None = None
    ) -> PhotonMap:
        """Return the landings of a pass; the arguments are as in `PhotonMap`."""
        count = int(self.counter[0])
        place, travel, power = self.place, self.travel, self.power
        if count == 0:
            # The renderer does not accept empty arrays, so an empty map holds one photon without
            # power.
            count = 1
            place, travel, power = (dr.zeros(mi.Float, 4) for _ in range(3))
        return PhotonMap(
            count, emitted, emitted_power, place, travel, power, self.coloured, passing
        )


@dataclass
class Landing:
    """A photon as it lands, or as it crosses the flux layer.

    Attributes:
        point: position, mm.
        direction: unit vector along which each photon travels.
        cosine: cosine of incidence, or its counterpart in the layer (see `PhotonMap.passing`).
        power: the photon's share of a light of 1 mW, per channel.
        bits: light group, half, and surface.
    """

    point: mi.Point3f
    direction: mi.Vector3f
    cosine: mi.Float
    power: mi.Color3f
    bits: mi.UInt32
