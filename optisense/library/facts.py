"""Library entries as text: a summary, the numbers one by one, and derived quantities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from optisense.design.fields import unit_of
from optisense.library._entries import AnyEntry, CameraModel, LightEntry, Source
from optisense.library.previews.camera import DISTANCES, footprint_size
from optisense.library.previews.light import colour_facts

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
"""Units of the fields of an entry beside its value, and of a camera; kinds have theirs."""

LONGEST_TABLE = 4
"""Largest number of rows of a table that is shown number by number: a colour matrix has three, and
a shading table of twelve would fill the screen."""


@dataclass(frozen=True)
class Fact:
    """Field of an entry.

    Attributes:
        name: name of the field; that of a light's colour as `flux.red`.
        value: value with its unit.
        source: source of the value; None for words, and if there is none.
    """

    name: str
    value: str
    source: Source | None


def summary(entry: AnyEntry) -> str:
    """Return the most informative numbers of an entry, in a few words."""
    value: Any = entry.value
    if isinstance(value, CameraModel):
        wide, high, _ = value.angles()
        fisheye = " fisheye" if value.projection == "equidistant" else ""
        return f"{wide:.3g} x {high:.3g} degrees{fisheye}"
    return str(value.in_words())


def facts(entry: AnyEntry) -> list[Fact]:
    """Return all fields of an entry with their sources."""
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
    """Return quantities that follow from the numbers of an entry, one per line.

    Raises:
        LibraryError: the IES file of a light is missing or malformed.
    """
    value: Any = entry.value
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
    return list(value.consequences())


def _text(name: str, value: object, unit: str = "") -> str:
    """Return a value with its unit, without Python's quotes and brackets."""
    unit = unit or UNITS.get(name, "")
    if isinstance(value, dict):
        text = ", ".join(
            f"{_text('', item)}" if key == "kind" else f"{key} {_text('', item)}"
            for key, item in value.items()
        )
    elif isinstance(value, list | tuple) and value and isinstance(value[0], list | tuple):
        rows = ["(" + ", ".join(_text("", each) for each in row) + ")" for row in value]
        size = f"{len(value)} rows of {len(value[0])} numbers"
        text = " ".join(rows) if len(value) <= LONGEST_TABLE else size
    elif isinstance(value, list | tuple):
        joint = " x " if unit in ("mm", "pixels") else ", "
        text = joint.join(_text("", item) for item in value)
    elif isinstance(value, bool):
        text = "yes" if value else "no"
    else:
        text = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {unit}" if unit else text
