"""The page's tables: settings, contacts, and where the design's numbers come from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

from optisense.design import SensorDesign
from optisense.geometry import Contact

Row = tuple[str, str]

UNITS = {
    "noise": "%",
    "noise_percent": "%",
    "noise_target": "%",
    "seconds": "s",
    "time": "s",
}
"""Units of settings whose name does not tell them."""


def headline(settings: Mapping[str, Any], width: int, height: int) -> list[Row]:
    """The few facts that stand under the title."""
    facts = [("picture", f"{width} × {height}")]
    for key, label in (("photons", "photons"), ("noise", "noise"), ("seconds", "time")):
        value = settings.get(key)
        if isinstance(value, int | float) and math.isfinite(value):
            facts.append((label, _value(key, value)))
    return facts


def setting_rows(settings: Mapping[str, Any]) -> list[Row]:
    """Every setting by name and value; those within settings as ``outer, inner``."""
    rows: list[Row] = []
    for key, value in settings.items():
        label = key.replace("_", " ")
        if isinstance(value, Mapping):
            rows += [(f"{label}, {inner}", text) for inner, text in setting_rows(value)]
        elif value is not None and key not in ("design", "contacts"):
            rows.append((label, _value(key, value)))
    return rows


def contact_rows(contacts: Sequence[Contact]) -> list[dict[str, str]]:
    """What touches the sensor, where, and how deep."""
    return [
        {
            "indenter": _indenter(contact.indenter),
            "place": _place(contact),
            "depth": f"{contact.depth:g} mm",
        }
        for contact in contacts
    ]


def provenance_rows(design: SensorDesign) -> tuple[list[dict[str, str]], list[dict[str, str]]]:
    """The design's values that are assumed, and those with a source."""
    rows = [
        {"path": path, "status": entry.status.value, "source": entry.source}
        for path, entry in design.provenance.items()
    ]
    assumed = [row for row in rows if row["status"] == "assumed"]
    return assumed, [row for row in rows if row["status"] != "assumed"]


def _value(key: str, value: Any) -> str:
    unit = f" {UNITS[key]}" if key in UNITS else ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}{unit}" if key != "seed" else str(value)
    if isinstance(value, float):
        return f"{value:.4g}{unit}"
    if isinstance(value, list | tuple):
        return ", ".join(_value("", item) for item in value)
    return str(value)


def _indenter(indenter: Any) -> str:
    """A shape's kind and sizes, as ``sphere, radius 1.5 mm``."""
    text = type(indenter).__name__.removesuffix("Indenter").lower()
    if is_dataclass(indenter):
        for field in fields(indenter):
            value = getattr(indenter, field.name)
            if isinstance(value, int | float) and not isinstance(value, bool):
                unit = "°" if field.name in ("angle", "tilt_x", "tilt_y", "rotation") else " mm"
                text += f", {field.name.replace('_', ' ')} {value:g}{unit if value else ''}"
    return text


def _place(contact: Contact) -> str:
    if contact.point is not None:
        x, y, z = contact.point
        return f"near the point {x:g}, {y:g}, {z:g} mm"
    u, v = contact.at if contact.at is not None else (0.0, 0.0)
    return f"{u:g}, {v:g} mm on the surface"
