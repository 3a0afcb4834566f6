"""The sensors and contacts of the ablation, and their reference images.

The references are rendered by progressive photon mapping, which shares the photon pass and the
surfaces with the radiance cache but neither its cells nor its shading. Too few of its photons
arrive in the narrow lobes of a mirroring coating. The references of such coatings are images from
the radiance cache with ten times the photons, so that only changes of the error are known;
`benchmarks.patches` compares all features together with path tracing. The references are kept in
files.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, uniform_filter

from benchmarks.patches import RING
from optisense import OpticalModel, sensors
from optisense.design import SensorDesign, set_value
from optisense.design.difference import fingerprint
from optisense.geometry import Contact, Indenter, Sphere
from optisense.geometry.objects import ObjectIndenter
from optisense.mechanics import CONFORMING
from optisense.optics.drafts import DraftModel
from optisense.optics.estimators import RADIANCE_CACHE, SPPM

CACHE = Path(__file__).parent / ".cache"
RESOLUTION = (160, 120)
"""Width and height (pixels) of the images, half those of `benchmarks.case`, since many references
are rendered."""
PHOTONS = 600_000
"""Number of photons of an image, near the 560,000 of `benchmarks.case`."""
LOBE_PHOTONS = 300_000
"""Number of photons of an image of which narrow lobes are traced, which takes longer."""
DRAFT_PHOTONS = 20_000
"""Number of photons of a draft, as in the studio."""
RADIUS, DEPTH = 1.5, 0.8
"""Radius and depth (mm) of the ball, those of `benchmarks.case`."""
BALL = Sphere(radius=RADIUS)
"""The indenter of most cases."""
MIDDLE, CORNER = 4, 0
"""Indices, among the nine contacts of a sensor, of that in the middle of the view and of one in a
corner, near the lamps."""
REFERENCE_PHOTONS = 3_000_000
"""Largest number of photons of each seed of the reference."""
REFERENCE_SEEDS = (101, 102)
"""Seeds of the two reference images, which no judged image has; the difference of the two gives the
noise of the reference."""
BOX = 3
"""Side (pixels) of the square over which pictures are averaged before they are compared, which
removes most of the reference's noise."""

FloatArray = NDArray[np.floating]


@dataclass(frozen=True)
class Case:
    """A sensor with an indenter pressed in, and its image.

    Attributes:
        sensor: built-in sensor.
        what: what distinguishes the case from other cases of the sensor.
        settings: values of the design, by path.
        place: index of the indenter's place among the nine contacts of the sensor.
        indenter: the indenter.
        depth: its depth, mm.
        resolution: width and height, pixels.
        draft: whether the image is a draft.
        lobes: whether the coating's metallic lobes are traced. The features of this tracing are
            switched off, and the reference is the radiance cache with all features.
    """

    sensor: str
    what: str
    settings: dict[str, Any] = field(default_factory=dict)
    place: int = MIDDLE
    indenter: Indenter = BALL
    depth: float = DEPTH
    resolution: tuple[int, int] = RESOLUTION
    draft: bool = False
    lobes: bool = False

    @property
    def name(self) -> str:
        """The name of the case in the table."""
        return f"{self.sensor}, {self.what}"

    @property
    def photons(self) -> int:
        """Number of photons of an image."""
        return DRAFT_PHOTONS if self.draft else LOBE_PHOTONS if self.lobes else PHOTONS

    @property
    def design(self) -> SensorDesign:
        """The design of the sensor."""
        design = sensors.build(self.sensor)
        for path, value in self.settings.items():
            design = set_value(design, path, value)
        return design

    def model(self) -> OpticalModel:
        """Return a new model of the sensor, without any light."""
        return DraftModel(self.design) if self.draft else OpticalModel(self.design)

    def contact(self, model: OpticalModel) -> Contact:
        """Return the contact of the indenter."""
        place = model.nine_contacts()[self.place].point
        assert place is not None
        return Contact(self.indenter, point=place, depth=self.depth)


DIFFUSE, METALLIC = {"coating.specularity": 0.0}, {"coating.specularity": 0.6}
"""Settings of coatings without metal, and with more metal than not."""
POLISHED = {"coating.specularity": 0.8}
"""Settings of a coating whose lobes are nearly as narrow as those that are traced."""
MIRRORING = {"coating.specularity": 1.0}
"""Settings of coatings of metal alone."""
WHITE = {"coating.specularity": 0.0, "coating.reflectance": (0.8, 0.8, 0.8)}
"""Settings of a coating as white as paint, which reflects much light between skin and contact."""
SENSORS = "gelsight-mini-ideal", "gelsight-svelte", "gelbelt", "gelsight360"
CASES = [
    *(
        Case(sensor, what, coating)
        for sensor in SENSORS
        for what, coating in (("diffuse", DIFFUSE), ("metallic", METALLIC), ("polished", POLISHED))
    ),
    *(Case(sensor, "mirroring", MIRRORING, lobes=True) for sensor in (*SENSORS, "gelsight-mini")),
    Case("gelsight-mini", "as fitted"),
    Case("gelsight-mini-ideal", "white, deep", WHITE, indenter=Sphere(radius=3.0), depth=1.8),
    Case("gelsight-mini-ideal", "polished, deep", POLISHED, indenter=Sphere(radius=3.0), depth=1.8),
    Case("gelsight-mini-ideal", "small, in a corner", DIFFUSE, CORNER, Sphere(radius=0.5), 0.3),
    Case("gelsight-mini-ideal", "brick", DIFFUSE, indenter=ObjectIndenter("brick")),
    Case("gelsight-mini-ideal-spherical", "diffuse", DIFFUSE),
    Case("gelsight-mini-ideal", "draft", DIFFUSE, draft=True),
    Case("gelsight-svelte", "draft", METALLIC, draft=True),
    Case("gelsight-mini-ideal", "metallic, 320x240", METALLIC, resolution=(320, 240)),
    Case("gelsight-mini-ideal", "mirroring, 320x240", MIRRORING, resolution=(320, 240), lobes=True),
]
"""Coatings from diffuse to mirroring on four sensors; and cases in which a refinement may
matter that changes little in those: the sensor that is fitted to photographs, much interreflection
in large contacts, a small contact near the lamps, an indenter whose studs shade each other, a
curved surface, drafts of the studio, and many pixels."""


def smooth(image: FloatArray) -> FloatArray:
    """Return an image (h, w, 3), averaged over squares of `BOX` pixels."""
    return np.asarray(uniform_filter(image.astype(np.float64), (BOX, BOX, 1)))


def masks(contact: NDArray[np.bool_], truth: FloatArray) -> list[NDArray[np.bool_]]:
    """Return masks (h, w) of the pixels in the contact, of those around it, and of all others that
    are not dark, of which those around it are a part.
    """
    lit = ~contact & (truth.sum(axis=-1) > 0.02 * truth.sum(axis=-1).mean())
    return [contact, lit & (distance_transform_edt(~contact) <= RING), lit]


@dataclass(frozen=True)
class Truth:
    """The reference of a case.

    Attributes:
        image: smoothed radiance (h, w, 3).
        noise: variance of its noise in each region.
        masks: the masks (h, w) of the regions; see `masks`.
    """

    image: FloatArray
    noise: FloatArray
    masks: list[NDArray[np.bool_]]

    def errors(self, image: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the squared error of an image (h, w, 3) in the contact and elsewhere, relative to
        the squared mean, without the noise of the reference; and the error of its mean.
        """
        got = smooth(image)
        means = np.array([self.image[mask].mean() for mask in self.masks])
        square = np.array([((got - self.image)[mask] ** 2).mean() for mask in self.masks])
        bias = np.array([got[mask].mean() for mask in self.masks]) / means - 1
        return np.maximum(square - self.noise, 0) / means**2, bias


def reference(case: Case) -> Truth:
    """Return the reference of a case, from a file of `CACHE` if it has been rendered before.

    Its name depends on the design, the contact, and the numbers of pixels and photons.
    """
    CACHE.mkdir(exist_ok=True)
    press = (case.place, case.indenter, case.depth, case.resolution, REFERENCE_PHOTONS)
    known = f"{fingerprint(case.design)} {press}"
    path = CACHE / f"ablation-{hashlib.sha256(known.encode()).hexdigest()[:16]}.npz"
    if not path.is_file():
        model = OpticalModel(case.design)
        contact = case.contact(model)
        images = [
            model.render(
                [contact],
                case.resolution,
                REFERENCE_PHOTONS,
                seed=seed,
                estimator=RADIANCE_CACHE if case.lobes else SPPM,
                skin=CONFORMING,
            )
            for seed in REFERENCE_SEEDS
        ]
        pressed = images[0].contact_mask
        np.savez(path, *(image.radiance for image in images), contact=pressed)
    with np.load(path) as kept:
        one, other, contact = smooth(kept["arr_0"]), smooth(kept["arr_1"]), kept["contact"]
    truth = (one + other) / 2
    where = masks(contact, truth)
    noise = [((one - other)[mask] ** 2).mean() / 4 for mask in where]
    return Truth(truth, np.array(noise), where)
