"""The camera samples of an image's pixels: more in contacts and around them than elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from optisense.optics.imaging._film import REFERENCE_WIDTH
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.camera_paths import MAX_PIXEL_SAMPLES
from optisense.optics.transport.chief_rays import ChiefRays

CONTACT_SAMPLES = 12
"""Number of camera samples per pixel inside contacts, where tilt and shadow vary within a pixel, in
an image `REFERENCE_WIDTH` wide. Twelve keep the noise of the samples below 1 % in the contact of a
1.5 mm ball on GelSight Mini. Finer images have smaller pixels and take fewer."""
MIN_CONTACT_SAMPLES = 16_000
"""Lower bound on the number of camera samples in all contacts together: that of 1,300 pixels of
twelve samples. In fewer pixels, tilt and shadow vary more; without it, the error in a contact of
GelBelt is 16 % larger (benchmarks/ablation.md)."""
RIM_SAMPLES = 6
"""Number of camera samples per pixel around contacts, in an image `REFERENCE_WIDTH` wide: half of
those inside, as the skin is not tilted there."""
DRAFT_SAMPLES = 3, 1
"""Numbers of camera samples per pixel of a draft, in contacts and around them: a quarter or less of
those of a full image, as the light of a draft is some 9 % off (see `DRAFT_CELL_SCALE`)."""
MIN_PIXEL_SAMPLES = 2
"""Number of camera samples of a contact pixel of importance 0, which is only averaged with others:
a sixth of the usual number or less."""
RIM_WIDTH = 8.0 / 320.0
"""Width of the rim around a contact that gets `RIM_SAMPLES`, as a fraction of the image width: 0.5
mm on GelSight Mini, about the depth of a contact."""
INTERREFLECTION_WIDTH = 1.0 / 107.0
"""Width over which interreflected light is averaged in contacts of coatings with broad metallic
lobes, as a fraction of the image width: 3 pixels of 320, and less in small contacts, whose pixels
have more samples. In a contact of GelSight Mini of specularity 0.6 it reduces the noise of the
camera samples from 3.0 to 1.1 % of the mean, with an error over patches of 0.1 %."""

PixelImportance = Callable[[ChiefRays], NDArray[np.bool_] | NDArray[np.floating]]
"""A function of the chief rays that gives the importance (h, w) of each contact pixel to a score,
0 to 1: the share of the camera samples that it gets."""
GRAIN_SAMPLES = 4
"""Largest number of further camera samples per pixel in grainy places outside contacts, which
halves the grain; they are limited to half of the image's samples. Without them, the error outside
the contact of GelSight Svelte is 21 % larger (benchmarks/ablation.md)."""
OUTLINE_SAMPLES = 9
"""Number of camera samples per pixel at the outlines of the skin, such as the edge of a mirror, and
of lamps in view, so that they are smooth, as in photographs. On GelSight Svelte, 1,200 of 76,800
pixels lie there."""
GRAIN_THRESHOLD = 0.03
"""Threshold of the relative RMS deviation of pixels from the mean of their neighbours above which a
place is grainy: three times a camera's own noise, which is about 0.01."""
NEIGHBOUR_MEAN = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], dtype=np.float32) / 4
"""Convolution kernel that gives the mean of the four neighbours of a pixel."""
DARK_FRACTION = 0.02
"""Fraction of the mean brightness below which grain is ignored, as it is hardly visible in places
so dark."""
GRAIN_WINDOW = 9
"""Side (pixels) of the square over which grain is measured and resampled. The deviations of its 81
pixels give the root mean square to a tenth."""


@dataclass(frozen=True)
class SamplingPlan:
    """The pixels that are shaded, and their camera samples.

    Attributes:
        only_contacts: whether all pixels that do not see an indenter stay dark.
        importance: function that gives, with ``only_contacts``, the share of the samples of each
            pixel; a pixel gets at least `MIN_PIXEL_SAMPLES`.
        draft: whether few samples are taken in contacts and grain is not resampled.
    """

    only_contacts: bool = False
    importance: PixelImportance | None = None
    draft: bool = False

    def of_contacts(self, regions: PixelRegions) -> list[tuple[NDArray[np.bool_], int]]:
        """Return the masks (h, w) of the pixels in contacts and around them, with their number of
        samples per pixel; contacts come first, and masks may be empty.

        With ``only_contacts``, the masks are those of each number of samples in contacts.
        """
        inner, outer = self.contact_samples(regions)
        if not self.only_contacts:
            inside = regions.distance <= 1.0  # with the pixels that touch the edge of a contact
            return [(inside, inner), (regions.near & ~inside, outer)]
        contacts = regions.contacts
        share = np.clip(1.0 if self.importance is None else self.importance(regions.rays), 0, 1)
        counts = np.maximum(np.round(inner * share), min(inner, MIN_PIXEL_SAMPLES))
        counts = np.broadcast_to(counts, contacts.shape)
        return [(contacts & (counts == times), int(times)) for times in np.unique(counts[contacts])]

    def contact_samples(self, regions: PixelRegions) -> tuple[int, int]:
        """Return the numbers of samples per pixel in contacts and around them."""
        if self.draft:
            return DRAFT_SAMPLES
        inner, outer = _samples_of_large_contacts(regions.width)
        pixels = max(1, int(regions.contacts.sum()))
        return max(inner, min(MAX_PIXEL_SAMPLES, MIN_CONTACT_SAMPLES // pixels)), outer

    def interreflection_width(self, regions: PixelRegions) -> int:
        """Return the width (pixels, odd) over which interreflected light is averaged in contacts of
        coatings with broad metallic lobes.
        """
        usual, _ = _samples_of_large_contacts(regions.width)
        samples, _ = self.contact_samples(regions)
        narrowing = min(1.0, (usual / samples) ** 0.5)
        return round(INTERREFLECTION_WIDTH * regions.width * narrowing) | 1


def _samples_of_large_contacts(width: int) -> tuple[int, int]:
    """Return the samples per pixel in and around large contacts in an image of a width."""
    share = min(1.0, REFERENCE_WIDTH / width)
    return max(2, round(CONTACT_SAMPLES * share)), max(2, round(RIM_SAMPLES * share))


@dataclass(frozen=True)
class PixelRegions:
    """The pixels in contacts, around them, and far from them.

    Attributes:
        rays: chief rays of the image.
        contacts: (h, w) mask of the pixels that see an indenter.
        distance: (h, w) distance of each pixel from them, pixels; infinite without contacts.
        near: (h, w) mask of the pixels in contacts, around them, or where an elastic skin is bent.
    """

    rays: ChiefRays
    contacts: NDArray[np.bool_]
    distance: NDArray[np.floating]
    near: NDArray[np.bool_]

    @classmethod
    def of(cls, rays: ChiefRays) -> PixelRegions:
        """Return the regions of an image by its chief rays."""
        region = np.where(rays.hit, rays.region, 0)
        contacts = region == Region.INDENTER
        distance = np.full(contacts.shape, np.inf)
        if contacts.any():
            distance = ndimage.distance_transform_edt(~contacts)
        around = distance <= max(2.0, RIM_WIDTH * contacts.shape[1])
        return cls(rays, contacts, distance, around | (region == Region.BENT))

    @property
    def bent(self) -> NDArray[np.bool_]:
        """The mask (h, w) of the pixels that see elastic skin which is bent beside contacts."""
        return self.rays.hit & (self.rays.region == Region.BENT)

    @property
    def width(self) -> int:
        """The width of the image, pixels."""
        return int(self.contacts.shape[1])

    def within(self, fraction: float) -> NDArray[np.bool_]:
        """Return the mask (h, w) of the pixels within a distance of contacts, which is given as a
        fraction of the image's width.
        """
        return self.distance <= fraction * self.width


def grainy(image: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels of ``where`` that lie in grainy places.

    In these, the image (h, w) often differs from the mean of the four neighbours by more than a
    smooth image does.
    """
    if not where.any():
        return where
    inner = ndimage.binary_erosion(where) & (image > DARK_FRACTION * image[where].mean())
    mean = ndimage.convolve(image, NEIGHBOUR_MEAN, mode="nearest")
    # The lower bound avoids a division by zero at a lit pixel among black ones.
    least = np.maximum(0.01 * np.abs(image), np.finfo(np.float32).tiny)
    off = np.where(inner, (image - mean) / np.maximum(np.abs(mean), least), 0.0)
    share = ndimage.uniform_filter(inner.astype(np.float32), GRAIN_WINDOW)
    square = ndimage.uniform_filter((off**2).astype(np.float32), GRAIN_WINDOW)
    return where & (square > GRAIN_THRESHOLD**2 * np.maximum(share, 1e-6))


def outline(label: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels whose label (h, w) differs from that of a pixel beside
    them: those on both sides of the outline of each area of one label.
    """
    found = np.zeros(label.shape, dtype=bool)
    for one, other in (np.s_[1:, :], np.s_[:-1, :]), (np.s_[:, 1:], np.s_[:, :-1]):
        apart = label[one] != label[other]
        found[one] |= apart
        found[other] |= apart
    return found


def sharp_edges(rays: ChiefRays) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels at the outlines of the skin and of lamps in view.

    Lamps that are narrower than a pixel are missed where no middle of a pixel sees them.
    """
    return outline(np.where(rays.hit, -1, rays.lamp.astype(np.int64)))
