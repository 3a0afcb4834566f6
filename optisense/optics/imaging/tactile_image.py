"""A tactile image: the picture of the sensor's camera and its ground truth."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatingArray
from optisense.design.responses import PictureChain
from optisense.design.responses.electronics import NoiseSeed
from optisense.errors import OutputError, RenderError
from optisense.geometry import TriangleMesh
from optisense.mechanics import PressedSkin, SkinMaps
from optisense.optics.backend.variant import threads_for_exr_files
from optisense.optics.imaging.markers import MarkerPlaces
from optisense.text import brief
from optisense.untrusted_files import read_json
from optisense.writing import inside, is_own_page, removed_together, written_together


def picture(
    radiance: FloatingArray,
    exposure: float | str = "auto",
    chain: PictureChain | None = None,
    noise_seed: NoiseSeed = 0,
) -> NDArray[np.uint8]:
    """Return an 8-bit picture (h, w, 3) of a radiance image.

    Args:
        radiance: (h, w, 3) radiance, mW/(mm^2 sr).
        exposure: factor on the radiance above 0, or "auto".
        chain: picture chain of the camera; the default `PictureChain` if None.
        noise_seed: seed of the camera's noise, if it has some.

    Raises:
        RenderError: the exposure is neither "auto" nor a number above 0.
    """
    chain = chain or PictureChain()
    factor = _factor(exposure, radiance, chain)
    return chain.encode(chain.respond(np.asarray(radiance) * factor, seed=noise_seed))


def _factor(exposure: float | str, radiance: FloatingArray, chain: PictureChain) -> float:
    """Return the factor of an exposure; RenderError if it is neither "auto" nor above 0."""
    if isinstance(exposure, str) and exposure == "auto":
        return chain.auto_exposure(radiance)
    try:
        factor = float(exposure)
    except (TypeError, ValueError):
        factor = -1.0
    if np.isfinite(factor) and factor > 0:
        return factor
    raise RenderError(
        f"the exposure is {brief(repr(exposure))}", hint='give "auto" or a factor above 0'
    )


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


@dataclass(eq=False)
class TactileImage:
    """The result of a render; row 0 of arrays is the top of the image.

    Attributes:
        layers: by light group, (h, w, 3) linear radiance (mW/(mm^2 sr)) with the group's colour and
            flux; the layers add up to the radiance.
        normals: (h, w, 3) unit normals of the coating in the design's frame, towards the camera's
            side; NaN where the camera sees no coating.
        contact_mask: (h, w) mask of the pixels that see an indenter.
        points: (h, w, 3) points (mm) of the coating in the design's frame.
        settings: the requested settings and the values reached, ready for JSON.
        interrupted: whether Ctrl-C ended the tracing early.
        unit_layers: by light group, the layer for lights of 1 mW in every channel, from which other
            layers follow (see ``relight``).
        chain: the picture chain of the camera, from radiance to the picture.
        indenters: the meshes (mm) that press in, in the design's frame, by a display name.
        pressed: forces, pressures and displacements of an elastic skin with contacts.
        markers: positions of the design's markers in the picture, if it has any.
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
        """Return the same image under lights of other colours and powers; exact, without rendering.

        Args:
            flux: by light group, the power (3,), mW, of each light in R, G, B; a group that is not
                named keeps its light. ``LightGroup.channel_flux()`` returns the values of a design.

        Raises:
            RenderError: there is no such light group, or a power is not three finite numbers from
                0.
        """
        for name, values in flux.items():
            if name not in self.unit_layers:
                raise RenderError(
                    f"the image has no light group '{name}'",
                    hint="It has: " + ", ".join(self.unit_layers),
                )
            power = np.asarray(values)
            if power.shape != (3,) or power.dtype.kind not in "iuf" or not _is_power(power):
                raise RenderError(
                    f"the power of the light group '{name}' is {values!r}",
                    hint="Give the power of each light in R, G and B, mW, such as (2.0, 0.0, 0.0)",
                )
        changed = {
            name: _scaled(self.unit_layers[name], np.asarray(values, dtype=np.float32))
            for name, values in flux.items()
        }
        return replace(self, layers=self.layers | changed, settings=dict(self.settings))

    @property
    def radiance(self) -> NDArray[np.float32]:
        """The linear radiance (h, w, 3), mW/(mm^2 sr), the sum of all layers."""
        total = np.zeros_like(self.normals, dtype=np.float32)
        for layer in self.layers.values():
            total += layer
        return total

    def picture(
        self, exposure: float | str = "auto", noise_seed: NoiseSeed | None = None
    ) -> NDArray[np.uint8]:
        """Return the picture (h, w, 3) uint8 that the camera stores.

        Args:
            exposure: the factor on the radiance, or "auto".
            noise_seed: seed of the camera's noise, if it has some; the image's own if None.
        """
        own = int(self.settings.get("seed", 0))
        return picture(
            self.radiance, exposure, self.chain, own if noise_seed is None else noise_seed
        )

    def without_noise(self) -> TactileImage:
        """Return the same image for a camera without noise, like the mean of many pictures."""
        return replace(self, chain=self.chain.without_noise())

    def auto_exposure(self) -> float:
        """Return the exposure factor that the camera's chain selects for the radiance."""
        return self.chain.auto_exposure(self.radiance)

    def skin_maps(self) -> SkinMaps | None:
        """Return the pressure (h, w), MPa, penetration (h, w), mm, and displacement (h, w, 3), mm,
        of the skin behind each pixel.

        They are NaN where the camera sees no skin. The result is None without contacts and for a
        conforming skin, whose forces are not known.
        """
        return None if self.pressed is None else self.pressed.maps(self.points, self.normals)

    def _repr_png_(self) -> bytes:
        """Return the content of the exposed picture's PNG file, which notebooks show."""
        return _encoded(self.picture(), ".png")

    def save_radiance(self, path: str | Path) -> None:
        """Write the linear radiance as an EXR file.

        Raises:
            OSError: the file cannot be written.
        """
        with threads_for_exr_files():
            _bitmap(self.radiance, Path(path))

    def save(self, folder: str | Path, exposure: float | str = "auto") -> None:
        """Write the image to a folder.

        The files are image.png, radiance.exr, normals.npy, contact_mask.npy, `layers/*.exr`,
        run.json, pressure.npy for an elastic skin with contacts, and markers.csv for a design with
        markers. They are written under temporary names and renamed when all are complete. The files
        of an earlier image that this one lacks are removed: its pressure, markers, layers of other
        groups, and its page (report.html). Other files stay; if a file can't be written or
        removed, these stay as well.

        Raises:
            RenderError: the exposure is neither "auto" nor a number above 0.
            OutputError: a file cannot be written, for instance because the disk is full.
        """
        out = Path(folder)
        self.settings["exposure"] = _factor(exposure, self.radiance, self.chain)
        maps = self.skin_maps()
        bitmaps = {"image.png": self.picture(exposure), "radiance.exr": self.radiance}
        bitmaps |= {f"layers/{name}.exr": layer for name, layer in self.layers.items()}
        with removed_together() as remove, written_together("the results") as stage:
            paths = [stage(inside(out, name)) for name in bitmaps]
            # Files are compressed outside Python's lock.
            with threads_for_exr_files(), ThreadPoolExecutor() as pool:
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
                remove(out / "layers" / f"{stale}.exr")
            if before and maps is None:
                remove(out / PRESSURE_FILE)
            if before and self.markers is None:
                remove(out / MARKERS_FILE)
            if is_own_page(out / REPORT_FILE, "render"):
                remove(out / REPORT_FILE)


def _marker_table(markers: MarkerPlaces) -> str:
    """Return the positions of markers as CSV: a header, and a row for each marker."""
    values = np.hstack([markers.coordinates, markers.before, markers.after, markers.displacement])
    lines = [MARKER_COLUMNS]
    lines += [",".join("" if np.isnan(v) else f"{v:.5g}" for v in row) for row in values]
    return "\n".join(lines) + "\n"


def _layers_before(folder: Path) -> set[str]:
    """Return the layers' names in the run.json that an earlier image wrote into a folder."""
    try:
        names = read_json(folder / "run.json", OutputError)["layers"]
        return {name for name in names if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name)}
    except (OutputError, LookupError, TypeError):
        return set()


def _is_power(values: NDArray[Any]) -> bool:
    return bool((np.isfinite(values) & (values >= 0)).all())


def _scaled(layer: NDArray[np.float32], factors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a layer (h, w, 3) times factors (3,), by rows, which is several times faster."""
    height, width = layer.shape[:2]
    row = np.tile(np.broadcast_to(factors, 3), width)
    return (layer.reshape(height, -1) * row).reshape(layer.shape)


def _bitmap(values: NDArray[Any], path: Path) -> None:
    """Write an array as an EXR or PNG file, whose path may be one that Mitsuba can't open."""
    path.write_bytes(_encoded(values, path.suffix))


def _encoded(values: NDArray[Any], suffix: str) -> bytes:
    """Return the content of an EXR or PNG file of an array."""
    bitmap = mi.Bitmap(np.ascontiguousarray(values))
    kind = mi.Bitmap.FileFormat.PNG
    if suffix == ".exr":
        kind = mi.Bitmap.FileFormat.OpenEXR
        bitmap.metadata()["unit"] = RADIANCE_UNIT
    stream = mi.MemoryStream()
    bitmap.write(stream, kind)
    return bytes(stream.raw_buffer())
