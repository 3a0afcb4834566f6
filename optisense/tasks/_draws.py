"""Random contacts: random indenters, places, depths and rotations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.errors import TaskError
from optisense.geometry import Contact, Indenter
from optisense.geometry.contact_text import INDENTER_FORM, parse_indenter
from optisense.geometry.indenter_kinds import tilted
from optisense.keyword_types import is_number, set_plain_numbers
from optisense.tasks._splits import Cell, cell_of

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, OpticalModel

PLACES_ACROSS = 320
"""Number of the camera's rays across the picture whose end points are the places that are drawn
from; on a GelSight Mini they are 0.07 mm apart."""

MARGIN = 0.02
"""Margin around a contact, as a share of the picture's width: 6 of 320 pixels, 0.4 mm on a GelSight
Mini, so that the picture includes the shading just outside the contact."""


def rays_of_places(model: OpticalModel, resolution: tuple[int, int] | None = None) -> ChiefRays:
    """Return chief rays of the untouched sensor, whose end points are the places of contacts in
    pictures of the shape of a resolution, the camera's own by default.
    """
    return model.chief_rays(model.design.camera.size_at(PLACES_ACROSS, resolution))


def keeps_margin(mask: NDArray[np.bool_], margin: float) -> bool:
    """Return whether a contact, of a mask (h, w), keeps a margin to the picture's edge, as a share
    of its width; 0 is always kept.
    """
    return margin == 0.0 or not is_cut(mask, max(1, round(margin * mask.shape[1])))


def is_cut(mask: NDArray[np.bool_], width: int = 1) -> bool:
    """Return whether a contact, of a mask (h, w), reaches a strip along the picture's edge of some
    pixels' width. In the outermost pixels, some of it may be out of view.
    """
    outer = mask.copy()
    outer[width:-width, width:-width] = False
    return bool(outer.any())


class Places:
    """The places of a sensing surface that the camera sees, drawn uniformly by area."""

    def __init__(self, rays: ChiefRays, areas: FloatArray) -> None:
        """Collect the places of chief rays without contacts, each of which sees an area (mm^2) of
        surface.
        """
        weights = np.where(rays.hit, areas, 0.0)
        rows, columns = np.nonzero(weights > 0)
        if not len(rows):
            raise TaskError("the camera sees nothing of the sensing surface")
        self._points = rays.points[rows, columns].astype(np.float64)
        # Positions are shares of the image's width and height, at the middles of pixels.
        height, width = rays.hit.shape
        self._spots = np.column_stack([(columns + 0.5) / width, (rows + 0.5) / height])
        self._share = np.cumsum(weights[rows, columns])
        self._middle = int(np.linalg.norm((self._spots - 0.5) * (width, height), axis=1).argmin())

    @classmethod
    def of(cls, model: OpticalModel, resolution: tuple[int, int] | None = None) -> Places:
        """Return the places that pictures of a resolution show; see `rays_of_places`."""
        from optisense.optics.transport.chief_rays import pixel_areas

        rays = rays_of_places(model, resolution)
        return cls(rays, pixel_areas(rays))

    @property
    def middle(self) -> FloatArray:
        """Return the place (3,), mm, that the picture shows nearest to its middle."""
        return self._points[self._middle]

    def cells(self, aspect: float) -> frozenset[Cell]:
        """Return the cells in which there are places, for a picture of a height over its width."""
        return frozenset(cell_of(spot, aspect) for spot in self._spots.tolist())

    def draw(self, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Draw a place; return its point (3,), mm, and its position (2,) in shares of the image."""
        chosen = int(np.searchsorted(self._share, rng.uniform(0.0, self._share[-1])))
        return self._points[chosen], self._spots[chosen]


@dataclass(frozen=True)
class DrawnContact:
    """A random contact and the values that it was made from (mm, degrees)."""

    contact: Contact
    indenter: str
    spot: tuple[float, float]
    tilt_x: float
    tilt_y: float

    def elsewhere(self, places: Places, rng: np.random.Generator) -> DrawnContact:
        """Return the same contact at another random place.

        The shares of indenters, depths and rotations do not depend on where they fit.
        """
        point, spot = places.draw(rng)
        x, y, z = point.tolist()
        contact = replace(self.contact, point=(x, y, z))
        return replace(self, contact=contact, spot=(float(spot[0]), float(spot[1])))


@dataclass(frozen=True)
class ContactDraw:
    """Ranges that random contacts are drawn from; each quantity is uniform.

    Attributes:
        indenters: texts of `parse_indenter`, each given once, drawn with equal probability.
        depth: smallest and largest depth, mm.
        rotation: smallest and largest rotation (degrees) about the outward normal.
        tilt: largest rotation (degrees) about each of two axes in the surface, of either sign.
        margin: margin between a contact and the picture's edge as a share of the picture's width,
            from 0 to less than a half; with 0 the edge may cut contacts.
    """

    indenters: tuple[str, ...] = ("sphere:1.5",)
    depth: tuple[float, float] = (0.3, 1.0)
    rotation: tuple[float, float] = (0.0, 360.0)
    tilt: float = 0.0
    margin: float = MARGIN

    def __post_init__(self) -> None:
        set_plain_numbers(self)
        if not self.indenters:
            raise TaskError("no indenter is given", hint=INDENTER_FORM)
        indenters: object = self.indenters
        if isinstance(indenters, str):
            raise TaskError(
                f"the indenters are the text '{indenters}'",
                hint=f"Write ('{indenters}',), also for a single one",
            )
        for text in self.indenters:
            if self.indenters.count(text) > 1:
                raise TaskError(
                    f"the indenter '{text}' is given twice",
                    hint="All are equally likely: name it once",
                )
        for name, given in (("depth", self.depth), ("rotation", self.rotation)):
            is_pair = isinstance(given, tuple | list) and len(given) == 2
            if not (is_pair and all(map(is_number, given)) and given[0] <= given[1]):
                raise TaskError(
                    f"the range of the {name} is {given!r}",
                    hint="Give two numbers, the smaller one first",
                )
        if self.depth[0] <= 0:
            raise TaskError(f"the least depth is {self.depth[0]:g}", hint="Give mm above 0")
        if not 0 <= self.tilt < 90:
            raise TaskError(f"the tilt is {self.tilt:g}", hint="Give 0 to less than 90 degrees")
        if not 0 <= self.margin < 0.5:
            raise TaskError(f"the margin is {self.margin:g}", hint="Give 0 to less than 0.5")

    def parsed(self) -> dict[str, Indenter]:
        """Return the indenters by their texts.

        Raises:
            ContactError: a text is not an indenter.
        """
        return {text: parse_indenter(text) for text in self.indenters}

    def draw(
        self, indenters: dict[str, Indenter], places: Places, rng: np.random.Generator
    ) -> DrawnContact:
        """Draw one contact.

        All random numbers are drawn even if they are not used, so that changing one range does not
        change the draws of the others.
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
