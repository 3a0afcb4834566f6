"""A tactile image: what the sensor's camera sees, and what is true about it."""

from __future__ import annotations

import errno
import json
import os
import re
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.design.responses import PictureChain
from optisense.design.responses.electronics import NoiseSeed
from optisense.errors import OutputError, RenderError
from optisense.geometry import TriangleMesh
from optisense.mechanics import PressedSkin, SkinMaps
from optisense.optics.camera.response import picture
from optisense.optics.imaging.markers import MarkerPlaces
from optisense.untrusted_files import read_json
from optisense.writing import inside, remove_own_page, written_together

RADIANCE_UNIT = "mW/(mm^2 sr)"
"""Unit of radiance in each of the three channels of radiance files and layers."""

REPORT_FILE = "report.html"
"""The page that `optisense render` writes beside an image."""

PRESSURE_FILE = "pressure.npy"
"""The file of `TactileImage.save` with the pressure on an elastic skin: (h, w) float32, MPa."""

MARKERS_FILE = "markers.csv"
"""The file of `TactileImage.save` with a row for each marker, empty where it is not seen."""

MARKER_COLUMNS = "u,v,column_before,row_before,column_after,row_after,dx,dy,dz"
"""Columns of `MARKERS_FILE`: mm on the undeformed surface, pixels from the upper left, mm."""


@dataclass
class TactileImage:
    """The result of a render; arrays are (h, w, ...), row 0 is the top.

    layers: linear radiance (mW / (mm^2 sr)) of each light group with its colour and flux; they
        add up to the radiance.
    normals: unit, of the coating as it is seen, in the design's frame, towards the camera's
        side; NaN where the camera sees none. contact_mask: where an indenter is seen. depth: mm
        that the coating is pushed in along the inward normal, 0 outside contacts. settings:
        what was asked and what was reached, ready for JSON. unit_layers: each group's layer for
        lights of 1 mW in every channel, from which others follow (see ``relight``). chain: of the
        camera, from radiance to the picture. indenters: what pressed in, by a name to show, in the
        design's frame (mm). pressed: forces, pressures and displacements of an elastic skin with
        contacts. markers: where the design's markers are seen, if it has any.
    """

    layers: dict[str, NDArray[np.float32]]
    normals: NDArray[np.float32]
    contact_mask: NDArray[np.bool_]
    points: NDArray[np.float32]
    settings: dict[str, Any] = field(default_factory=dict)
    interrupted: bool = False
    unit_layers: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    chain: PictureChain = field(default_factory=PictureChain)
    indenters: dict[str, TriangleMesh] = field(default_factory=dict)
    pressed: PressedSkin | None = None
    markers: MarkerPlaces | None = None

    def relight(self, flux: Mapping[str, ArrayLike]) -> TactileImage:
        """The same image under lights of other colours and powers; exact, with no new rendering.

        Args:
            flux: (3,) mW of R, G, B of each light, by light group; a group that is not named
                keeps its light. ``LightGroup.channel_flux()`` gives a design's own.

        Raises:
            RenderError: there is no such light group.
        """
        for name in flux:
            if name not in self.unit_layers:
                raise RenderError(
                    f"the image has no light group '{name}'",
                    hint="It has: " + ", ".join(self.unit_layers),
                )
        changed = {
            name: _scaled(self.unit_layers[name], np.asarray(values, dtype=np.float32))
            for name, values in flux.items()
        }
        return replace(self, layers=self.layers | changed, settings=dict(self.settings))

    @property
    def radiance(self) -> NDArray[np.float32]:
        """(h, w, 3) linear radiance, the sum of all layers."""
        total = np.zeros_like(self.normals, dtype=np.float32)
        for layer in self.layers.values():
            total += layer
        return total

    def picture(
        self, exposure: float | str = "auto", noise_seed: NoiseSeed | None = None
    ) -> NDArray[np.uint8]:
        """(h, w, 3) uint8: exposed, and stored as the camera does.

        Args:
            exposure: the factor on the radiance, or "auto".
            noise_seed: of the noise, where the camera has some; that of the image if None.
        """
        own = int(self.settings.get("seed", 0))
        return picture(
            self.radiance, exposure, self.chain, own if noise_seed is None else noise_seed
        )

    def without_noise(self) -> TactileImage:
        """The same image by a camera without noise, as the mean of many pictures has none."""
        return replace(self, chain=self.chain.without_noise())

    def auto_exposure(self) -> float:
        """The factor that makes a good picture of the radiance."""
        return self.chain.auto_exposure(self.radiance)

    def skin_maps(self) -> SkinMaps | None:
        """Pressure (MPa), penetration (mm) and displacement (mm) of the skin behind each pixel.

        They are NaN where the camera sees no skin. None without contacts, and of a conforming
        skin, of which no forces are known.
        """
        return None if self.pressed is None else self.pressed.maps(self.points, self.normals)

    def _repr_png_(self) -> bytes:
        """The exposed picture as a PNG file, for notebooks."""
        stream = mi.MemoryStream()
        mi.Bitmap(self.picture()).write(stream, mi.Bitmap.FileFormat.PNG)
        return bytes(stream.raw_buffer())

    def save_radiance(self, path: Path) -> None:
        """Write the linear radiance as an EXR file.

        Raises:
            OSError: it can't be written.
        """
        _bitmap(self.radiance, path)

    def save(self, folder: str | Path, exposure: float | str = "auto") -> None:
        """Write image.png, radiance.exr, normals.npy, contact_mask.npy, `layers/*.exr`, run.json,
        pressure.npy of an elastic skin with contacts, and markers.csv where the design has markers.

        They are written under temporary names and appear when all are whole. What an earlier
        image left in the folder goes: its pressure, markers, layers of groups that this image does
        not have, and the page (report.html) that was written about it. Other files stay.

        Raises:
            OutputError: a file can't be written, for instance because the disk is full.
        """
        out = Path(folder)
        self.settings["exposure"] = self.auto_exposure() if exposure == "auto" else float(exposure)
        maps = self.skin_maps()
        bitmaps = {"image.png": self.picture(exposure), "radiance.exr": self.radiance}
        bitmaps |= {f"layers/{name}.exr": layer for name, layer in self.layers.items()}
        with written_together("the results") as stage:
            paths = [stage(inside(out, name)) for name in bitmaps]
            with ThreadPoolExecutor() as pool:  # compresses outside Python's lock
                list(pool.map(_bitmap, bitmaps.values(), paths))
            np.save(stage(out / "normals.npy"), self.normals)
            np.save(stage(out / "contact_mask.npy"), self.contact_mask)
            if maps is not None:
                np.save(stage(out / PRESSURE_FILE), maps.pressure.astype(np.float32))
            if self.markers is not None:
                stage(out / MARKERS_FILE).write_text(_marker_table(self.markers), encoding="utf-8")
            text = json.dumps({**self.settings, "layers": list(self.layers)}, indent=2) + "\n"
            stage(out / "run.json").write_text(text, encoding="utf-8")
            before = _layers_before(out)
            for stale in before - set(self.layers):
                (out / "layers" / f"{stale}.exr").unlink(missing_ok=True)
            if before and maps is None:
                (out / PRESSURE_FILE).unlink(missing_ok=True)
            if before and self.markers is None:
                (out / MARKERS_FILE).unlink(missing_ok=True)
            remove_own_page(out / REPORT_FILE, "render")


def _marker_table(markers: MarkerPlaces) -> str:
    """The places of markers as CSV: a heading, and a row for each."""
    values = np.hstack([markers.coordinates, markers.before, markers.after, markers.displacement])
    lines = [MARKER_COLUMNS]
    lines += [",".join("" if np.isnan(v) else f"{v:.5g}" for v in row) for row in values]
    return "\n".join(lines) + "\n"


def _layers_before(folder: Path) -> set[str]:
    """The layers that an earlier image wrote into a folder, by its run.json."""
    try:
        names = read_json(folder / "run.json", OutputError)["layers"]
        return {name for name in names if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name)}
    except (OutputError, LookupError, TypeError):
        return set()


def _scaled(layer: NDArray[np.float32], factors: NDArray[np.float32]) -> NDArray[np.float32]:
    """A layer (h, w, 3) times (3,) factors; by rows, several times sooner than by pixels."""
    height, width = layer.shape[:2]
    row = np.tile(np.broadcast_to(factors, 3), width)
    return (layer.reshape(height, -1) * row).reshape(layer.shape)


def _bitmap(values: NDArray[Any], path: Path) -> None:
    bitmap = mi.Bitmap(np.ascontiguousarray(values))
    if path.suffix == ".exr":
        bitmap.metadata()["unit"] = RADIANCE_UNIT
    try:
        bitmap.write(str(path))
    except RuntimeError as error:
        full = os.strerror(errno.ENOSPC) in str(error)  # it has words only, and no number
        number = errno.ENOSPC if full else errno.EIO
        said = os.strerror(number) if full else str(error)
        raise OSError(number, said, str(path)) from error
    if path.stat().st_size == 0:  # it says nothing when the disk is full
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
