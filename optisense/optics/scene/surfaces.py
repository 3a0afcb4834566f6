"""The kinds of surface that light meets, and their optical data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

RAY_OFFSET = 2e-4
"""Distance (mm) off a surface at which rays start: a hundred times the rounding of 30 mm in single
precision, a hundredth of the thinnest film that a design holds (0.02 mm)."""


class SurfaceKind(IntEnum):
    """What light does at a surface."""

    DIELECTRIC = 0  # refracts and reflects (smooth, or rough with GGX)
    OPAQUE = 1  # reflects off a blend of a diffuse and a metallic lobe; photons are stored here
    MIRROR = 2  # ideal metallic reflection
    ABSORBER = 3
    LIGHT = 4  # the emitting face of a light: absorbs what meets it, is seen by the camera


class Region(IntEnum):
    """What an opaque surface is to the sensor."""

    OTHER = 0
    SENSING = 1
    INDENTER = 2


@dataclass(frozen=True)
class Surface:
    """Optical data of one surface.

    For a dielectric ``eta`` is the index on the inside (behind the face normal) over the index
    on the outside. ``reflectance``, ``metal_eta`` and ``metal_k`` are per channel R, G, B.
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
