"""HTML page of a render: one file that contains all its data and needs no network."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from optisense.design import LightGroup, SensorDesign
from optisense.design.responses import PictureChain
from optisense.geometry import Contact
from optisense.report import _tables as tables
from optisense.report._drawing import swatch_of
from optisense.report._files import as_json, page, script
from optisense.report._mixing import mixing_data
from optisense.report._pictures import data_uri, mask_overlay, normal_colours, pressure_colours
from optisense.report._scene_view import scene_data
from optisense.report.camera_rays import CameraRays
from optisense.report.light_section import LightSection
from optisense.report.real_sensor import RealComparison
from optisense.writing import write_text

if TYPE_CHECKING:
    from optisense.optics import TactileImage


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
    assumed, sourced = tables.provenance_rows(design)
    camera = image.chain.without_noise()
    factor = camera.auto_exposure(image.radiance) if exposure == "auto" else float(exposure)
    return page(
        "report",
        title=design.name,
        description=design.description,
        headline=tables.headline(image.settings, width, height),
        interrupted=image.interrupted,
        width=width,
        height=height,
        pictures=_pictures(design, image, exposure, factor, camera),
        cross_at=_place_to_look_at(image.contact_mask),
        groups=[_group(name, group) for name, group in design.lights.items()],
        mixing=as_json(mixing_data(image.layers, factor, camera)),
        contacts=tables.contact_rows(contacts, image.settings.get("presses") or ()),
        settings=tables.setting_rows(image.settings),
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
