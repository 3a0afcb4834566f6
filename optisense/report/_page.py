"""HTML page of a render: one file that contains all its data and needs no network."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from optisense.design import LightGroup, SensorDesign
from optisense.design.responses import PictureChain
from optisense.geometry import Contact
from optisense.report._files import as_json, page, script
from optisense.report._pictures import (
    data_uri,
    mask_overlay,
    mixing_data,
    normal_colours,
    pressure_colours,
    swatch_of,
)
from optisense.report._scene_view import scene_data
from optisense.report.camera_rays import CameraRays
from optisense.report.light_section import LightSection
from optisense.report.real_sensor import RealComparison
from optisense.writing import write_text

if TYPE_CHECKING:
    from optisense.optics import TactileImage

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


def write_report(
    path: str | Path,
    design: SensorDesign,
    image: TactileImage,
    contacts: Sequence[Contact] = (),
    *,
    exposure: float | Literal["auto"] = "auto",
    rays: CameraRays | None = None,
    real: RealComparison | None = None,
    light: LightSection | None = None,
) -> Path:
    """Write a render as one self-contained HTML page.

    Args:
        path: path of the file, which is written whole or not at all.
        design: design of the sensor that was rendered.
        image: tactile image.
        contacts: contacts in the image.
        exposure: exposure of the picture, see `TactileImage.picture`.
        rays: chief rays of the camera (`CameraRays.of` a model), to be drawn.
        real: comparison with a real sensor (`compare_with_real`), if there is one.
        light: ledger and paths of the light (`LightSection.of` a model), to be drawn.

    Returns:
        The path.

    Raises:
        OutputError: the file can't be written.
    """
    text = render_page(
        design, image, contacts, exposure=exposure, rays=rays, real=real, light=light
    )
    write_text(Path(path), text)
    return Path(path)


def render_page(
    design: SensorDesign,
    image: TactileImage,
    contacts: Sequence[Contact] = (),
    *,
    exposure: float | Literal["auto"] = "auto",
    rays: CameraRays | None = None,
    real: RealComparison | None = None,
    light: LightSection | None = None,
) -> str:
    """Return the page of `write_report` as text."""
    height, width = image.contact_mask.shape
    assumed, sourced = provenance_rows(design)
    camera = image.chain.without_noise()
    factor = camera.auto_exposure(image.radiance) if exposure == "auto" else float(exposure)
    return page(
        "report",
        title=design.name,
        description=design.description,
        headline=headline(image.settings, width, height),
        interrupted=image.interrupted,
        width=width,
        height=height,
        pictures=_pictures(design, image, exposure, factor, camera),
        cross_at=_place_to_look_at(image.contact_mask),
        groups=[_group(name, group) for name, group in design.lights.items()],
        mixing=as_json(mixing_data(image.layers, factor, camera)),
        contacts=contact_rows(contacts, image.settings.get("presses") or ()),
        settings=setting_rows(image.settings),
        real=None if real is None else _real(real),
        assumed=assumed,
        sourced=sourced,
        light=None if light is None else light.values(design),
        scene=as_json(
            scene_data(design, image.indenters, rays, () if light is None else light.ways())
        ),
        picture_script=script("picture.js"),
        viewer_script=script("viewer.js"),
    )


def _pictures(
    design: SensorDesign,
    image: TactileImage,
    exposure: float | Literal["auto"],
    factor: float,
    camera: PictureChain,
) -> list[dict[str, str]]:
    """Return the pictures with their captions; the tactile image comes first.

    Args:
        factor, camera: factor on the radiance, and camera without noise.
    """
    picture = image.picture(exposure)
    shown: list[tuple[str, Callable[[], NDArray[np.uint8]], str, str]]
    shown = [("picture", lambda: picture, "tactile image", "")]
    for name, layer in image.layers.items():
        exposed = partial(_exposed, layer, factor, camera)
        shown.append((f"layer {name}", exposed, f"{name} lights alone", ""))
    normals = partial(normal_colours, image.normals, design.camera.axes())
    shown.append(("normals", normals, "surface normals", "red right, green up, blue to the camera"))
    if image.contact_mask.any():
        covered = 100 * float(image.contact_mask.mean())
        overlay = partial(mask_overlay, picture, image.contact_mask)
        maps = image.skin_maps()
        if maps is not None:
            most = f"white is {np.nanmax(maps.pressure):.3f} MPa, black none"
            drawn = partial(pressure_colours, maps.pressure)
            shown.append(("pressure", drawn, "pressure", most))
        shown.append(("contact", overlay, "contact", f"{covered:.1f} % of the picture"))
    with ThreadPoolExecutor() as pool:  # NumPy and zlib release Python's lock
        addresses = list(pool.map(lambda pixels: data_uri(pixels()), [row[1] for row in shown]))
    return [
        {"name": name, "uri": address, "caption": caption, "note": note}
        for (name, _, caption, note), address in zip(shown, addresses, strict=True)
    ]


def _exposed(layer: NDArray[np.float32], factor: float, camera: PictureChain) -> NDArray[np.uint8]:
    exposed = factor * layer
    return camera.encode(exposed if camera.is_plain else camera.respond(exposed))


def _place_to_look_at(mask: NDArray[np.bool_]) -> tuple[int, int]:
    """Return column and row of the first profile: the middle of the contact, if there is one."""
    height, width = mask.shape
    rows, columns = np.nonzero(mask)
    if len(rows) == 0:
        return width // 2, height // 2
    return round(float(columns.mean())), round(float(rows.mean()))


def _real(found: RealComparison) -> dict[str, Any]:
    red, green, blue = (f"{value:.2f}" for value in found.shading)
    return {
        "pictures": [
            ("a real sensor", data_uri(found.real)),
            ("this model", data_uri(found.model)),
        ],
        "difference": f"{found.difference:.0f}",
        "own_spread": f"{found.own_spread:.0f}",
        "shading": f"{red} in red, {green} in green and {blue} in blue",
        "rows": found.rows(),
    }


def _group(name: str, group: LightGroup) -> dict[str, Any]:
    return {
        "name": name,
        "swatch": swatch_of(group.colour),
        "model": group.model,
        "count": len(group.lights),
        "flux": f"{group.flux:g} mW",
    }
