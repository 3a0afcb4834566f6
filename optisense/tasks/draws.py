"""Random contacts: which indenter, where, how deep, and turned how."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.errors import TaskError
from optisense.geometry import Contact, Indenter
from optisense.geometry.contact_text import INDENTER_FORM, parse_indenter
from optisense.geometry.indenter_kinds import tilted

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, OpticalModel

PLACES_SEEN = 320, 240
"""Places are drawn among the points that this many rays of the camera meet."""

MARGIN = 0.02
"""Part of the picture's width that stays free around a contact: 6 of 320 pixels, 0.4 mm on a
GelSight Mini, so that the shading just outside the contact is in the picture too."""

FloatArray = NDArray[np.float64]


def keeps_margin(mask: NDArray[np.bool_], margin: float) -> bool:
    """Whether a contact stays clear of the picture's edge.

    Args:
        mask: (h, w), true where the contact is seen.
        margin: part of the width that must stay free; 0 is always kept.
    """
    if margin == 0.0:
        return True
    inner = mask.copy()
    free = max(1, round(margin * mask.shape[1]))
    inner[free:-free, free:-free] = False
    return not inner.any()


def is_cut(mask: NDArray[np.bool_]) -> bool:
    """Whether a contact reaches the picture's edge, so that some of it may be out of view.

    Args:
        mask: (h, w), true where the contact is seen.
    """
    inner = mask.copy()
    inner[1:-1, 1:-1] = False
    return bool(inner.any())


class Places:
    """The places of a sensing surface that the camera sees, to draw from evenly by area."""

    def __init__(self, rays: ChiefRays, areas: FloatArray) -> None:
        """Args: rays: without contacts. areas: (h, w) mm^2 of surface behind each pixel."""
        weights = np.where(rays.hit, areas, 0.0)
        rows, columns = np.nonzero(weights > 0)
        if not len(rows):
            raise TaskError("the camera sees nothing of the sensing surface")
        self._points = rays.points[rows, columns].astype(np.float64)
        # As parts of the image's width and height, measured to the middles of pixels.
        height, width = rays.hit.shape
        self._spots = np.column_stack([(columns + 0.5) / width, (rows + 0.5) / height])
        self._share = np.cumsum(weights[rows, columns])
        self._middle = int(np.linalg.norm((self._spots - 0.5) * (width, height), axis=1).argmin())

    @classmethod
    def of(cls, model: OpticalModel) -> Places:
        """The places that a model's camera sees."""
        from optisense.optics.transport.chief_rays import pixel_areas

        rays = model.chief_rays(PLACES_SEEN)
        return cls(rays, pixel_areas(rays))

    @property
    def middle(self) -> FloatArray:
        """(3,) mm: the place that the picture shows nearest to its middle."""
        return self._points[self._middle]

    def draw(self, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """A place: its point (3,) mm, and where the image shows it, (2,) parts of its size."""
        chosen = int(np.searchsorted(self._share, rng.uniform(0.0, self._share[-1])))
        return self._points[chosen], self._spots[chosen]


@dataclass(frozen=True)
class DrawnContact:
    """A random contact and the numbers it was made from (mm, degrees)."""

    contact: Contact
    indenter: str
    spot: tuple[float, float]
    tilt_x: float
    tilt_y: float


@dataclass(frozen=True)
class ContactDraw:
    """Ranges that random contacts are drawn from; each quantity is uniform.

    Attributes:
        indenters: texts of `parse_indenter`, each as likely as the others.
        depth: mm, least and most.
        rotation: degrees about the outward normal, least and most.
        tilt: degrees; turns about two axes in the surface are drawn from -tilt to tilt.
        margin: part of the picture's width that stays free between a contact and the picture's
            edge, from 0 to less than a half; 0 lets the edge cut contacts.
    """

    indenters: tuple[str, ...] = ("sphere:1.5",)
    depth: tuple[float, float] = (0.3, 1.0)
    rotation: tuple[float, float] = (0.0, 360.0)
    tilt: float = 0.0
    margin: float = MARGIN

    def __post_init__(self) -> None:
        if not self.indenters:
            raise TaskError("no indenter is given", hint=INDENTER_FORM)
        for name, (low, high) in (("depth", self.depth), ("rotation", self.rotation)):
            if not (np.isfinite([low, high]).all() and low <= high):
                raise TaskError(f"the {name} goes from {low:g} to {high:g}", hint="Give LOW:HIGH")
        if self.depth[0] <= 0:
            raise TaskError(f"the least depth is {self.depth[0]:g}", hint="Give mm above 0")
        if not 0 <= self.tilt < 90:
            raise TaskError(f"the tilt is {self.tilt:g}", hint="Give 0 to less than 90 degrees")
        if not 0 <= self.margin < 0.5:
            raise TaskError(f"the margin is {self.margin:g}", hint="Give 0 to less than 0.5")

    def parsed(self) -> dict[str, Indenter]:
        """The indenters by their texts.

        Raises:
            ContactError: one can't be read.
        """
        return {text: parse_indenter(text) for text in self.indenters}

    def draw(
        self, indenters: dict[str, Indenter], places: Places, rng: np.random.Generator
    ) -> DrawnContact:
        """One contact. All numbers are drawn whether they are used or not, so that changing one
        range leaves the others' draws alone.
        """
        text = self.indenters[int(rng.integers(len(self.indenters)))]
        point, spot = places.draw(rng)
        depth = float(rng.uniform(*self.depth))
        rotation = float(rng.uniform(*self.rotation))
        tilt_x, tilt_y = (float(tilt) for tilt in rng.uniform(-1.0, 1.0, 2) * self.tilt)
        indenter = indenters[text]
        if self.tilt:
            indenter = tilted(indenter, tilt_x, tilt_y)
        x, y, z = point.tolist()
        contact = Contact(indenter, point=(x, y, z), depth=depth, rotation=rotation)
        return DrawnContact(contact, text, (float(spot[0]), float(spot[1])), tilt_x, tilt_y)
