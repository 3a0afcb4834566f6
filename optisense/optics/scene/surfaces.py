"""The kinds of surface that light meets, and their optical data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

RAY_OFFSET = 2e-4
"""Distance (mm) off a surface at which rays start: a hundred times the rounding of 30 mm in single
precision (2e-6 mm), a hundredth of the thinnest film that a design holds (0.02 mm)."""


class SurfaceKind(IntEnum):
    """The kind of interaction of light with a surface."""

    DIELECTRIC = 0  # refracts and reflects (smooth, or rough with GGX)
    OPAQUE = 1  # reflects off a blend of a diffuse and a metallic lobe; photons are stored here
    MIRROR = 2  # ideal metallic reflection
    ABSORBER = 3
    LIGHT = 4  # the emitting face of a light: absorbs what meets it, is seen by the camera


class Region(IntEnum):
    """The function of an opaque surface in the sensor."""

    OTHER = 0
    SENSING = 1
    INDENTER = 2  # touched by an indenter, whose shape the skin has there
    BENT = 3  # skin beside a contact that is pushed in with it


RGB = tuple[float, float, float]

CLEAR: RGB = (0.0, 0.0, 0.0)
"""Absorption coefficient (1/mm) at R, G, B of a medium that absorbs nothing."""


@dataclass(frozen=True)
class Surface:
    """Optical data of one surface.

    Attributes:
        kind: the interaction of light with the surface.
        eta: for a dielectric, the index on the inside (behind the face normal) over the index on
            the outside; for a metal, the index of the medium behind it over that in front of it.
        alpha: roughness (GGX alpha), 0 for smooth.
        specularity: weight of the metallic lobe of an opaque surface, 0 to 1.
        reflectance: reflectance of the diffuse lobe at R, G, B.
        metal_eta, metal_k: real and imaginary part of the metal's refractive index at R, G, B,
            over the index of the medium in front of it.
        region: function of the surface in the sensor.
        light: number of the light whose emitting face the surface is.
        etas: values of ``eta`` at R, G, B; None if they do not differ.
        absorption: absorption coefficients (1/mm, per channel) inside and outside; None if the
            media are unknown, and rays stay in the medium that they come from.
    """

    kind: SurfaceKind
    eta: float = 1.0
    alpha: float = 0.0
    specularity: float = 0.0
    reflectance: tuple[float, float, float] = (0.0, 0.0, 0.0)
    metal_eta: tuple[float, float, float] = (1.0, 1.0, 1.0)
    metal_k: tuple[float, float, float] = (0.0, 0.0, 0.0)
    region: Region = Region.OTHER
    light: int = 0
    etas: RGB | None = None
    absorption: tuple[RGB, RGB] | None = None

    @property
    def absorbs(self) -> bool:
        """Whether the medium on one of its sides absorbs light."""
        return self.absorption is not None and max(map(max, self.absorption)) > 0.0


def is_coloured(surface: Surface) -> bool:
    """Return whether a surface or a medium beside it differs between channels."""
    if surface.etas is not None:
        return True
    metal = surface.specularity > 0 or surface.kind is SurfaceKind.MIRROR
    values = [surface.reflectance]
    if metal:
        values += [surface.metal_eta, surface.metal_k]
    if surface.kind not in (SurfaceKind.OPAQUE, SurfaceKind.MIRROR):
        values = [] if surface.absorption is None else list(surface.absorption)
    return any(max(v) - min(v) > 1e-6 for v in values)
