"""Errors of the light by patches of contacts, against other renderers, in absolute units.

``python -m benchmarks.patches [--only CASE] [--dry]`` writes patches.json and patches.md beside
this file. A ball is pressed into a sensor. What the radiance cache gives in the contact is averaged
over patches (bands of tilt times quarters of azimuth), likewise in a ring of untouched skin around
it; the row of pixels between both, where skin and flank reflect each other at grazing angles, is
reported separately. The pictures of the other renderers are kept in benchmarks/.cache, and their
noise is subtracted in quadrature.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from benchmarks.patch_references import Referee, Reference, ray_offset_shift
from benchmarks.results import measure_parts, page_head
from optisense import OpticalModel, sensors
from optisense.design import SensorDesign, set_value
from optisense.geometry import Contact, Sphere
from optisense.mechanics import CONFORMING
from optisense.optics import TactileImage

FloatArray = NDArray[np.floating]
RESOLUTION = (160, 120)
"""Width and height (pixels) of the images, half those of `benchmarks.case`, since the path tracer
needs tens of thousands of samples for each pixel."""
RESOLUTIONS = {"gelbelt": (320, 240), "gelsight-svelte": (320, 240), "gelsight360": (480, 360)}
"""Resolutions (pixels) for the sensors on whose images of `RESOLUTION` a contact has few pixels."""
RADIUS = 1.5
"""Radius (mm) of the ball, that of `benchmarks.case`."""
PHOTONS = 10_000_000
"""Number of photons of each image, far more than usual, so that noise is below the errors."""
TILTS = 5
"""Number of bands of tilt in the contact, each with as many pixels."""
QUARTERS = 4
"""Number of sectors of azimuth, of 90 degrees each: GelSight Mini has a light on each side."""
RING = 12
"""Width (pixels) of the ring of skin around the contact, beyond the rim."""
CHANNELS = "red", "green", "blue"
"""Names of the channels."""
MARGIN = RING + 2
"""Width (pixels) of the margin around the contact in the reference: the ring and the rim."""

BROAD = 0.0, 0.3, 0.6
"""Specularities of coatings that are diffuse or have a broad lobe."""


@dataclass(frozen=True)
class PatchCase:
    """Sensor with a coating and a contact.

    Attributes:
        sensor: built-in sensor; "gelsight360" gets a perspective camera, since Mitsuba has no
            fisheye.
        specularity: specularity of the coating, 0 to 1.
        place: index of the place in `OpticalModel.nine_contacts`; 4 is the middle.
        depth: depth of the ball, mm.
        referee: reference renderer.
        batches: number of independent pictures of the reference renderer, whose scatter gives its
            noise.
        images: number of images, which are averaged to reduce their noise.
    """

    sensor: str
    specularity: float
    place: int = 4
    depth: float = 0.8
    referee: Referee = Referee.LIGHT
    batches: int = 8
    images: int = 2

    @property
    def name(self) -> str:
        """Name of the case in tables."""
        where = f"place {self.place}, {self.depth:g} mm"
        return f"{self.sensor}, {self.specularity:g}, {where}, by {self.referee}"

    @property
    def resolution(self) -> tuple[int, int]:
        """Width and height of the images, pixels."""
        return RESOLUTIONS.get(self.sensor, RESOLUTION)

    def design(self) -> SensorDesign:
        """Return the sensor's design."""
        design = set_value(sensors.build(self.sensor), "coating.specularity", self.specularity)
        if self.sensor == "gelsight360":
            design = set_value(design, "camera.projection", "perspective")
            design = set_value(design, "camera.fov", 100.0)
        return design

    def contact(self, model: OpticalModel) -> Contact:
        """Return the contact of the ball."""
        place = model.nine_contacts()[self.place].point
        assert place is not None
        return Contact(Sphere(radius=RADIUS), point=place, depth=self.depth)

    def reference(self, model: OpticalModel) -> Reference:
        """Return the region that the reference renderer shows."""
        contact = self.contact(model)
        mask = model.chief_rays(self.resolution, [contact], CONFORMING).contact_mask
        return Reference(self.referee, model, contact, mask, MARGIN)


CASES = [
    PatchCase("gelsight-mini-ideal", 0.6, referee=Referee.PATH, batches=16),
    PatchCase("gelsight-mini-ideal", 1.0, referee=Referee.PATH, batches=16, images=6),
    *(PatchCase("gelsight-mini-ideal", s) for s in (0.0, 0.3, 0.6, 0.8)),
    PatchCase("gelsight-mini", 0.0, referee=Referee.PATH, images=4),
    PatchCase("gelsight-mini", 1.0, referee=Referee.PATH, batches=24, images=4),
    *(PatchCase("gelsight-mini-ideal", s, place=0, images=8) for s in BROAD),
    PatchCase("gelsight-mini-ideal", 1.0, place=0, referee=Referee.PATH, batches=24, images=6),
    *(
        PatchCase("gelsight-mini-ideal-cylindrical", s, depth=0.3, batches=24, images=20)
        for s in BROAD
    ),
    PatchCase("gelsight-mini-ideal-cylindrical", 1.0, 4, 0.3, Referee.PATH, batches=32, images=6),
    *(PatchCase("gelsight-mini-ideal-spherical", s, batches=16, images=4) for s in BROAD),
    PatchCase("gelsight-mini-ideal-spherical", 1.0, referee=Referee.PATH, batches=24, images=6),
    *(PatchCase("gelbelt", s, batches=16, images=4) for s in BROAD),
    *(PatchCase("gelbelt", s, place=0) for s in (0.0, 0.6)),
    PatchCase("gelbelt", 1.0, referee=Referee.PATH, batches=24, images=4),
    *(PatchCase("gelsight-svelte", s) for s in BROAD),
    PatchCase("gelsight-svelte", 1.0, referee=Referee.PATH, images=4),
    *(PatchCase("gelsight360", s, images=4) for s in BROAD),
    PatchCase("gelsight360", 1.0, referee=Referee.PATH, images=4),
]
"""Cases: flat and curved gels, the middle of the view and its corner (place 0), and coatings from
diffuse to mirroring. Only `gelsight-mini` has rough faces, with which light tracing does not work.
The cylindrical gel is pressed by 0.3 mm, the depth of scores; its small contact gets little red and
blue light, so that its reference needs three times as many photons and its images ten times. The
narrow lobe of a specularity of 1 connects few photons to the camera, so that the path tracer is
faster there."""


@dataclass(frozen=True)
class Patches:
    """Index (h, w) of the patch of each pixel, -1 for none.

    Attributes:
        contact: patches of the contact by tilt and azimuth, `TILTS` times `QUARTERS`.
        skin: patches of the ring around the contact, by azimuth.
        rim: patches of the row of pixels between contact and ring, by azimuth.
    """

    contact: NDArray[np.integer]
    skin: NDArray[np.integer]
    rim: NDArray[np.integer]

    @classmethod
    def of(cls, image: TactileImage) -> Patches:
        """Return the patches of an image with one contact."""
        inside = image.contact_mask
        normals = image.normals
        around = ndimage.distance_transform_edt(~inside)
        ring = (around > 1.5) & (around <= RING) & np.isfinite(normals[..., 0])
        upright = np.nanmean(normals[ring], axis=0)
        upright /= np.linalg.norm(upright)
        tilt = np.arccos(np.clip(normals @ upright, -1, 1))
        order = np.argsort(np.argsort(tilt[inside]))
        band = np.zeros(inside.shape, dtype=int)
        band[inside] = order * TILTS // len(order)
        rows, columns = np.indices(inside.shape)
        turn = np.arctan2(columns - columns[inside].mean(), rows - rows[inside].mean())
        quarter = np.floor((turn / (2 * np.pi) + 1.125) * QUARTERS).astype(int) % QUARTERS
        return cls(
            np.where(inside, band * QUARTERS + quarter, -1),
            np.where(ring, quarter, -1),
            np.where((around > 0) & (around <= 1.0), quarter, -1),
        )


def means(image: FloatArray, patch: NDArray[np.integer]) -> FloatArray:
    """Return the means (patches, 3) of an image (h, w, 3) over the patches that have pixels."""
    return np.array([image[patch == n].mean(axis=0) for n in np.unique(patch[patch >= 0])])


def compare(
    images: FloatArray, truth: FloatArray, patch: NDArray[np.integer], scale: FloatArray
) -> dict[str, float]:
    """Return errors of images over patches.

    Args:
        images: radiance (n, h, w, 3) of images with different seeds.
        truth: radiance (m, h, w, 3) of independent pictures of the reference renderer.
        patch: index (h, w) of the patch of each pixel.
        scale: radiance (3,) by which the differences of each channel are divided.

    Returns:
        rms, limit: RMS error of the mean of the images over all patches and channels, without the
            noise of both, and its upper limit. worst: error of the worst patch. noise, image_noise:
            RMS noise of the reference and of the mean of the images. red, green, blue and
            red_noise, ...: relative error of the mean over all patches, and its standard error.
    """
    (whole, noise), (mean, image_noise) = (
        _mean_and_variance(np.array([means(picture, patch) for picture in pictures]) / scale)
        for pictures in (truth, images)
    )
    off = mean - whole
    everywhere = truth.mean(axis=0)[patch >= 0].mean(axis=0)
    # Some sensors have no light of a colour.
    divisor = np.where(everywhere > 0, everywhere, 1.0)
    ratio = np.where(
        everywhere > 0, images.mean(axis=0)[patch >= 0].mean(axis=0) / divisor - 1, 0.0
    )
    ratio_noise = np.sqrt(
        sum(
            (pictures[:, patch >= 0].mean(axis=1) / divisor).var(axis=0, ddof=1) / len(pictures)
            for pictures in (truth, images)
        )
    )
    noises = noise + image_noise
    square = max(float((off**2).mean() - noises.mean()), 0.0)
    # The square of a normally distributed value of mean x and variance v has the variance
    # 2 v^2 + 4 v x^2.
    spread = np.sqrt((2 * noises**2 + 4 * noises * square).mean() / off.size)
    found = {
        "rms": float(np.sqrt(square)),
        "limit": float(np.sqrt(square + 2 * spread)),
        "worst": float(off.ravel()[np.abs(off).argmax()]),
        "noise": float(np.sqrt(noise.mean())),
        "image_noise": float(np.sqrt(image_noise.mean())),
        **dict(zip(CHANNELS, ratio.tolist(), strict=True)),
        **dict(zip((f"{name}_noise" for name in CHANNELS), ratio_noise.tolist(), strict=True)),
    }
    return {key: round(value, 5) for key, value in found.items()}


def _mean_and_variance(each: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the mean (patches, 3) of independent values (n, patches, 3), and the variance (3,) of
    that mean in each channel, averaged over patches.
    """
    return each.mean(axis=0), each.var(axis=0, ddof=1).mean(axis=0) / len(each)


def measure(case: PatchCase, photons: int = PHOTONS) -> dict[str, Any]:
    """Return all numbers of a case."""
    model = OpticalModel(case.design())
    contact = case.contact(model)
    # The reference comes first: its pictures are kept if the measurement is interrupted.
    reference = case.reference(model)
    truth, effort = reference.pictures(case.batches)
    if case.referee is Referee.PATH:
        model = _seen_alike(model, reference.mask)
    images = [
        model.render([contact], case.resolution, photons, seed=seed, skin=CONFORMING)
        for seed in range(1, case.images + 1)
    ]
    radiance = np.array([image.radiance for image in images], dtype=np.float64)
    patches = Patches.of(images[0])
    model.forget_light()
    whole = truth.mean(axis=0)
    found: dict[str, Any] = {"effort": round(effort / 1e6, 3), "images": case.images}
    for name, patch in vars(patches).items():
        # The skin around a metal contact is dark; it is judged by its own light.
        scale = whole[(patches.contact if name == "contact" else patch) >= 0].mean(axis=0)
        found[name] = compare(radiance, truth, patch, np.where(scale > 0, scale, 1.0))
    return found


def _seen_alike(model: OpticalModel, mask: NDArray[np.bool_]) -> OpticalModel:
    """Return a sensor whose camera is turned so that it sees the pixels of a mask (h, w) where the
    path tracer sees them.
    """
    right, down = ray_offset_shift(model, mask)
    height, width = mask.shape
    camera = model.camera((width, height))
    _, ahead = camera.rays(mi.Float(width / 2 + right), mi.Float(height / 2 + down))
    turned = [float(each[0]) for each in ahead]
    return OpticalModel(set_value(model.design, "camera.direction", turned))


def main() -> None:
    """Run the benchmark, print its results and write them."""
    measures = {case.name: partial(measure, case) for case in CASES}
    measure_parts("patches", __doc__, measures, table)


def table(found: dict[str, Any]) -> str:
    """Return the results as Markdown."""
    lines = [
        *page_head("Errors of the rendered light by regions of a contact", "benchmarks.patches"),
        f"A ball of radius {RADIUS} mm is pressed in. The mean of several images of "
        f"{RESOLUTION[0]}x{RESOLUTION[1]} pixels or more and {PHOTONS / 1e6:g} million photons is "
        "compared with a reference, in absolute units: Mitsuba's `path`, or light tracing "
        "(`light`), which connects each photon that lands in the contact to the camera. For a "
        "comparison with `path`, the camera is turned by the shift of its picture, as its rays "
        "start some micrometres off surfaces: 0.06 pixels on GelSight Svelte, none elsewhere. The "
        "*effort* is in millions of samples per pixel for `path`, and of photons otherwise; "
        "*images* is the number of images. A GPU rendered the references with more than 200 "
        "million photons or 0.1 million samples, and some of the images. "
        "All values are in per cent. *RMS* is the error over patches and three channels, "
        "relative to the mean of each channel there, after subtraction of all noise. The noise "
        "leaves an uncertainty, and the *limit* is two standard errors above the RMS. The patches "
        f"are {TILTS} bands of tilt times {QUARTERS} quarters of azimuth in the contact, and "
        "quarters of the skin around it and of the row of pixels between both. The noise of the "
        "images is that of their mean; where it is not given, it is not subtracted. The last three "
        "columns are the errors of the means of the channels and their standard errors, which "
        "earlier measurements lack.", "",
        "| sensor, specularity, place, depth | effort | images | region | RMS | limit | noise of "
        "the reference | noise of the images | red | green | blue |", "|---" * 11 + "|",
    ]  # fmt: skip
    rows = {case.name: found[case.name] for case in CASES if case.name in found}
    for name, row in rows.items():
        for where in ("contact", "skin", "rim"):
            of = row[where]
            # Earlier measurements have no limit, or no noise of the images, which is in their RMS.
            numbers = [
                f"{100 * of[key]:.1f}" if key in of else ""
                for key in ("rms", "limit", "noise", "image_noise")
            ]
            numbers += [_with_error(of, key) for key in CHANNELS]
            effort = f"{row['effort']:g} | {row['images']}"
            lines.append(f"| {name} | {effort} | {where} | " + " | ".join(numbers) + " |")
    measured = {name.rsplit(",", 1)[0] for name in rows}
    missing = {name for case in CASES if (name := case.name.rsplit(",", 1)[0]) not in measured}
    if missing:
        lines += ["", "Not measured:", "", *(f"- {name}" for name in sorted(missing))]
    return "\n".join(lines) + "\n"


def _with_error(row: dict[str, float], channel: str) -> str:
    """Return the error of the mean of a channel, per cent, with its standard error if known."""
    error = f"{100 * row[channel]:+.1f}"
    noise = row.get(f"{channel}_noise")
    return error if noise is None else f"{error} ± {100 * noise:.1f}"


if __name__ == "__main__":
    main()
