"""Tables of the page: settings, contacts, and the provenance of the design's numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

from optisense.design import SensorDesign
from optisense.geometry import Contact

Row = tuple[str, str]

LABELS = {
    "photons_asked": "photons asked for",
    "noise_asked_percent": "noise asked for",
    "noise_reached_percent": "noise reached",
    "noise_of_worst_places_percent": "noise in the worst 5 %",
    "seconds_asked": "time asked for",
    "samples_per_pixel": "samples a pixel",
    "seconds": "time",
}
"""Labels of settings whose name is not what a reader would call them."""

ELSEWHERE = ("design", "contacts", "presses", "resolution", "notes", "interrupted")
"""Settings that the page shows in another place."""


def headline(settings: Mapping[str, Any], width: int, height: int) -> list[Row]:
    """Return the few facts below the title."""
    facts = [("picture", f"{width} × {height}")]
    seconds = settings.get("seconds")
    total = seconds.get("total") if isinstance(seconds, Mapping) else None
    for label, key, value in (
        ("photons", "photons", settings.get("photons")),
        ("noise", "noise_percent", settings.get("noise_reached_percent")),
        ("time", "seconds", total),
    ):
        if isinstance(value, int | float) and math.isfinite(value):
            facts.append((label, _value(key, value)))
    return facts


def setting_rows(settings: Mapping[str, Any], unit: str = "") -> list[Row]:
    """Return every setting by name and value; nested ones as ``outer, inner``."""
    rows: list[Row] = []
    for key, value in settings.items():
        label = LABELS.get(key, key.replace("_", " "))
        if isinstance(value, Mapping):
            inside = setting_rows(value, "seconds" if key == "seconds" else "")
            rows += [(f"{label}, {inner}", text) for inner, text in inside]
        elif value is not None and key not in ELSEWHERE:
            rows.append((label, _value(unit or key, value)))
    return rows


def contact_rows(
    contacts: Sequence[Contact], presses: Sequence[Mapping[str, Any]] = ()
) -> list[dict[str, str]]:
    """Return the contacts with place and depth, and force and area if they are known.

    Args:
        presses: `PressedSkin.in_numbers` of each contact; empty if the skin is not elastic.
    """
    rows = []
    for number, contact in enumerate(contacts):
        row = {
            "indenter": _indenter(contact.indenter),
            "place": _place(contact),
            "depth": f"{contact.depth:g} mm" if contact.force is None else "",
            "force": "" if contact.force is None else f"{contact.force:g} N",
            "area": "",
            "pressure": "",
            "warning": "",
        }
        if number < len(presses):
            press = presses[number]
            row["depth"] = row["depth"] or f"{press['depth_mm']:.2f} mm"
            row["force"] = f"{press['force_n']:.2f} N"
            row["area"] = f"{press['area_mm2']:.1f} mm²"
            row["warning"] = press.get("warning", "")
            row["pressure"] = f"{press['greatest_pressure_mpa']:.3f} MPa"
        rows.append(row)
    return rows


def provenance_rows(design: SensorDesign) -> tuple[list[dict[str, str]], list[dict[str, str]]]:
    """Return the design's values that are assumed, and those with a source."""
    rows = [
        {"path": path, "status": entry.status.value, "source": entry.source}
        for path, entry in design.provenance.items()
    ]
    assumed = [row for row in rows if row["status"] == "assumed"]
    return assumed, [row for row in rows if row["status"] != "assumed"]


def _value(key: str, value: Any) -> str:
    """Return a value with the unit that its key implies."""
    unit = " %" if key.endswith("percent") else " s" if key.startswith("seconds") else ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int) and key != "seed":
        return f"{value:,}{unit}"
    if isinstance(value, float):
        return f"{value:.3g}{unit}"
    if isinstance(value, list | tuple):
        return ", ".join(_value("", item) for item in value)
    return str(value)


def _indenter(indenter: Any) -> str:
    """Return a shape's kind and sizes, such as ``sphere, radius 1.5 mm``."""
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
