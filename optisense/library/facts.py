"""What an entry says, as text: in a line, number by number, and what follows from the numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from optisense.design.fields import unit_of
from optisense.design.materials import Absorber, Coating, Conductor, Dielectric, Diffuse
from optisense.library.entries import AnyEntry, CameraModel, LightEntry, Source
from optisense.library.previews.camera import DISTANCES, footprint_size
from optisense.library.previews.light import colour_facts
from optisense.library.previews.material import critical_angle
from optisense.library.previews.reflection import fresnel_dielectric, fresnel_metal
from optisense.library.scattering import specularity_to_roughness

UNITS = {
    "package": "mm",
    "window": "mm",
    "fov": "degrees",
    "wavelength": "nm",
    "current": "mA",
    "flux": "mW",
    "resolution": "pixels",
    "pixel_size": "micrometres",
    "focal_length": "mm",
}
"""Units of the fields around a value, and of a camera; those of a kind are in its class."""


@dataclass(frozen=True)
class Fact:
    """A field of an entry.

    Attributes:
        name: of the field; that of a light's colour as `flux.red`.
        value: with its unit.
        source: where it comes from; None for words, and where it is not told.
    """

    name: str
    value: str
    source: Source | None


def summary(entry: AnyEntry) -> str:
    """The most telling numbers, in a few words."""
    value: Any = entry.value
    if isinstance(value, Dielectric):
        rough = f", rough {value.roughness:g}" if value.roughness > 0.0 else ""
        return f"index {value.ior:g}{rough}"
    if isinstance(value, Conductor):
        return f"reflects {100 * float(fresnel_metal(1.0, value.eta, value.k).mean()):.0f} %"
    if isinstance(value, Diffuse):
        return f"reflects {100 * float(np.mean(value.reflectance)):.3g} %"
    if isinstance(value, Absorber):
        return "reflects nothing"
    if isinstance(value, Coating):
        return f"specularity {value.specularity:g}"
    if isinstance(value, CameraModel):
        wide, high, _ = value.angles()
        fisheye = " fisheye" if value.projection == "equidistant" else ""
        return f"{wide:.3g} x {high:.3g} degrees{fisheye}"
    return str(value.in_words())


def facts(entry: AnyEntry) -> list[Fact]:
    """All fields of an entry with their sources."""
    own = entry.value.model_dump(mode="json", exclude_none=True)
    units = {name: unit_of(type(entry.value), name) for name in own}
    found = [
        Fact(name, _text(name, value, units[name]), entry.source(name))
        for name, value in own.items()
    ]
    if isinstance(entry, LightEntry):
        for name in ("package", "window"):
            value = getattr(entry, name)
            if value is not None:
                found.append(Fact(name, _text(name, value), entry.source(name)))
        for colour, typical in entry.typical.items():
            for name, value in typical.model_dump(exclude_none=True).items():
                full = f"{name}.{colour}"
                found.append(Fact(full, _text(name, value), entry.source(full)))
    return found


def consequences(entry: AnyEntry) -> list[str]:
    """What follows from the numbers of an entry, a line each.

    Raises:
        LibraryError: the IES file of a light is missing or malformed.
    """
    value: Any = entry.value
    if isinstance(value, Dielectric):
        lines = [f"a smooth face reflects {100 * float(fresnel_dielectric(1.0, value.ior)):.1f} % "
                 "of light that comes straight from air"]  # fmt: skip
        limit = critical_angle(value.ior)
        if limit is not None:
            lines.append(f"light inside is wholly reflected beyond {limit:.1f} degrees")
        return lines
    if isinstance(value, Conductor):
        share = 100 * fresnel_metal(1.0, value.eta, value.k)
        return ["reflects {:.1f}, {:.1f}, {:.1f} % of R, G, B in air".format(*share)]
    if isinstance(value, Coating):
        alpha = specularity_to_roughness(value.specularity)
        return [
            f"{100 * (1 - value.specularity):.0f} % diffuse paint and "
            f"{100 * value.specularity:.0f} % metal flake of roughness {alpha:.2g}"
        ]
    if isinstance(value, CameraModel):
        angles = "sees {:.1f} degrees across, {:.1f} high, {:.1f} over the diagonal"
        lines = [angles.format(*value.angles())]
        for distance in sorted(DISTANCES):
            width, height = footprint_size(value, distance)
            lines.append(f"{distance:g} mm away, in air: {width:.3g} x {height:.3g} mm")
        return lines
    if isinstance(entry, LightEntry):
        half = f"half of the intensity at {value.half_angle():.3g} degrees from the axis"
        return [half, *colour_facts(entry)]
    return []


def _text(name: str, value: object, unit: str = "") -> str:
    """A value with its unit, without Python's quotes and brackets."""
    unit = unit or UNITS.get(name, "")
    if isinstance(value, list | tuple):
        joint = " x " if unit in ("mm", "pixels") else ", "
        text = joint.join(_text("", item) for item in value)
    elif isinstance(value, bool):
        text = "yes" if value else "no"
    else:
        text = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {unit}" if unit else text
