"""Contacts in photographs, and the contacts of a model that reproduce them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import map_coordinates

from optisense.calibration.contact_finding import FoundContact, find_another, find_contact
from optisense.calibration.photographs import PhotographedPress, Photographs
from optisense.errors import CalibrationError, ContactError
from optisense.geometry import Contact, Sphere

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, OpticalModel

DEPTH_STEPS = 4
"""Number of iterations that find the depth of a ball for a given contact radius; each one reduces
the error several times, and the first is off by at most a third.
"""

RADIUS_ERROR = 0.01
"""Relative error of a contact's radius at which the search for its depth ends; the grid on which
the skin's pressure is computed resolves contacts to about 1 %.
"""

DOUBTFUL = 0.5
"""Asymmetry (`FoundContact.asymmetry`) from which on the difference of a photograph does not look
like that of a ball, for which it is 0.05 to 0.2; it is about 1 where there is no contact."""

LABEL_OFF = 0.6
"""Distance of a label's centre from that of the detected contact, in radii, and relative difference
of the radii, from which on the label is doubted. Hand labels are off by a tenth.
"""

SAME_PLACE = 1.0 / 6.0
"""Distance of contacts from their middle, in radii, up to which they are at the same place, and so
within a third of a radius of each other: a ball that is pressed in anew by hand is farther off."""


@dataclass(frozen=True)
class SeenContact:
    """Position and size of a contact in a photograph.

    Attributes:
        centre: column and row of its middle, pixels from the left and top edge.
        radius: radius, pixels.
    """

    centre: tuple[float, float]
    radius: float


class ContactFinder:
    """Contacts in photographs; each is searched once."""

    def __init__(self, photographs: Photographs) -> None:
        """Store the photographs; nothing is searched yet."""
        self._background, self._presses = photographs.background, photographs.presses
        self._found: dict[tuple[object, ...], FoundContact | None] = {}

    def _contact(self, press: PhotographedPress, labelled: bool = False) -> FoundContact | None:
        """Return the contact with the strongest response in a photograph, or that near its label,
        if it has one.
        """
        near, radius = (press.centre, press.radius) if labelled else (None, None)
        key = id(press), near, radius
        if key not in self._found:
            self._found[key] = find_contact(press.picture, self._background, near, radius)
        return self._found[key]

    def contacts(self, *, refine: bool = True) -> list[SeenContact | None]:
        """Return the contact in each photograph.

        Args:
            refine: whether labelled contacts are also searched, near their labels; hand labels are
                off by pixels. If the picture beside a label does not look like a ball, while it
                does at another place, that place is taken; if it does nowhere, the label is kept. A
                place at which other photographs show the same is not taken, as it is a blemish of
                the background, such as dust.

        Returns:
            Contacts, with None for a photograph that shows no contact.
        """
        found: list[SeenContact | None] = []
        for press in self._presses:
            centre, radius = press.centre, press.radius
            if centre is not None and radius is not None and not refine:
                found.append(SeenContact(centre, radius))
                continue
            seen = self._contact(press, labelled=True)
            if centre is not None and seen is not None and seen.asymmetry > DOUBTFUL:
                free = self._contact(press)
                looks_right = free is not None and free.asymmetry < DOUBTFUL
                if free is not None and looks_right and not self._is_blemish(press, free):
                    seen = free
                elif radius is not None:
                    found.append(SeenContact(centre, radius))
                    continue
            found.append(None if seen is None else SeenContact(seen.centre, seen.radius))
        return found

    def _is_blemish(self, press: PhotographedPress, found: FoundContact) -> bool:
        """Return whether two or more other photographs have their strongest response where one is
        found in a press, but no label there.
        """
        same = 0
        for other in self._presses:
            if other is press or other.centre is None:
                continue
            seen = self._contact(other)
            if seen is None:
                continue
            size = max(seen.radius, found.radius)
            is_near = math.dist(seen.centre, found.centre) < size
            same += is_near and math.dist(other.centre, found.centre) > size
        return same >= 2

    def doubts(self) -> list[str]:
        """Return warnings about presses: no visible contact, or labels that contradict it."""
        found: list[str] = []
        denied: list[FoundContact] = []
        every: list[FoundContact] = []
        twice = 0
        for press in self._presses:
            seen = free = self._contact(press)
            if press.centre is not None:
                labelled = self._contact(press, labelled=True)
                if labelled is not None and labelled.asymmetry < DOUBTFUL:
                    seen = labelled
            if seen is None:
                found.append(f"{press.name}: it shows no contact and is left out")
                continue
            every.append(seen)
            wide = replace(seen, radius=max(seen.radius, press.radius or 0.0))
            other = find_another(press.picture, self._background, wide)
            twice += other is not None and other.asymmetry < DOUBTFUL
            if seen.asymmetry > DOUBTFUL:
                found.append(
                    f"{press.name}: its difference from the background does not look like the "
                    "contact of a ball"
                )
            if press.centre is not None:
                off = math.dist(press.centre, seen.centre)
                if off > LABEL_OFF * max(seen.radius, press.radius or 0.0):
                    denied.append(seen)
                    found.append(
                        f"{press.name}: its label is {off:.0f} pixels away from the contact that "
                        "the picture shows; check whether it is that of another photograph"
                    )
            shown = seen.radius  # that of a contact at the label depends on the label's radius
            if free is not None and math.dist(free.centre, seen.centre) < seen.radius:
                shown = free.radius
            size = shown if press.radius is None else press.radius
            if not 1.0 / (1.0 + LABEL_OFF) < size / max(shown, 1e-9) < 1.0 + LABEL_OFF:
                found.append(
                    f"{press.name}: its label has a radius of {size:.0f} pixels, and the contact "
                    f"in the picture one of {shown:.0f}"
                )
        common, repeated = _common_place(denied, LABEL_OFF), _common_place(every, SAME_PLACE)
        if 2 * twice > len(self._presses):
            found.insert(0, _background_contact("most photographs show two"))
        elif common is not None:
            column, row = common
            found.insert(
                0,
                _background_contact(
                    f"several photographs show one at column {column:.0f}, row {row:.0f}, where "
                    "they have no label"
                ),
            )
        elif repeated is not None:
            column, row = repeated
            found.append(
                f"most presses are at the same place, column {column:.0f}, row {row:.0f}; presses "
                "at different places contain more information"
            )
        return found


def _background_contact(reason: str) -> str:
    return (
        f"the background: it seems to show a contact, as {reason}; take one with nothing pressed in"
    )


def _common_place(contacts: Sequence[FoundContact], near: float) -> tuple[float, float] | None:
    """Return the place from which more than half of the contacts are at most `near` radii away, or
    None if there are not two such contacts.
    """
    if len(contacts) < 2:
        return None
    column, row = np.median([each.centre for each in contacts], axis=0).tolist()
    count = sum(math.dist(each.centre, (column, row)) < near * each.radius for each in contacts)
    return (column, row) if count >= 2 and 2 * count > len(contacts) else None


def check_shape(photographs: Photographs, model: OpticalModel) -> None:
    """Raise CalibrationError if photographs are wider or narrower than the model's pictures."""
    width, height = photographs.size
    own_width, own_height = model.design.camera.resolution
    rounding = 1.5 / min(width, height)
    if abs(width * own_height / (height * own_width) - 1.0) > rounding:
        hint = (
            "Crop the photographs as the camera of the design is cropped, or set "
            "camera.resolution to their shape"
        )
        if abs(height * own_height / (width * own_width) - 1.0) <= rounding:
            hint = "Turn the photographs by 90 degrees"
        raise CalibrationError(
            f"the photographs have {width} x {height} pixels, and the design's camera "
            f"{own_width} x {own_height}, another shape",
            hint=hint,
        )


def contact_of(
    press: PhotographedPress, seen: SeenContact, model: OpticalModel, rays: ChiefRays
) -> Contact:
    """Return the contact of a model that touches where a photograph shows it, by the model's chief
    rays at the photograph's size; CalibrationError is raised if it is not on the skin, too wide for
    the ball, or too deep.
    """
    size = min(np.sort(np.ptp(gel.vertices, axis=0))[1] for gel in model.gels)
    if press.diameter > 2.0 * size:
        raise CalibrationError(
            f"the ball's diameter is {press.diameter:g} mm, and the gel is {size:.0f} mm wide",
            where=press.name,
            hint="Give the ball's diameter in mm",
        )
    point, scale = place_on_skin(seen.centre, rays, press.name)
    ball, wanted = 0.5 * press.diameter, seen.radius * scale
    if wanted >= ball:
        raise CalibrationError(
            f"the contact has a radius of {wanted:.2f} mm, and the ball one of {ball:g} mm",
            where=press.name,
            hint="Check the ball's diameter, the label, and what width of the skin the camera sees",
        )
    depth = wanted**2 / ball  # Hertz
    for _ in range(DEPTH_STEPS):
        contact = Contact(Sphere(ball), point=point, depth=depth)
        try:
            area = model.pressed([contact]).contacts[0].area
        except ContactError as error:
            raise CalibrationError(
                f"a ball of {press.diameter:g} mm can't be pressed in there: {error.message}",
                where=press.name,
                hint="Check the ball's diameter and the label; leave this photograph out",
            ) from None
        ratio = wanted / math.sqrt(max(area, 1e-6) / math.pi)
        if abs(ratio - 1.0) < RADIUS_ERROR:
            break
        depth *= min(max(ratio, 0.5), 2.0) ** 2
    return Contact(Sphere(ball), point=point, depth=depth)


def place_on_skin(
    centre: tuple[float, float], rays: ChiefRays, name: str
) -> tuple[tuple[float, float, float], float]:
    """Return the point of the skin, mm, at a position in the picture, and the size of a pixel
    there, mm; CalibrationError is raised where the camera sees no skin.
    """
    column, row = centre[0] - 0.5, centre[1] - 0.5
    steps = np.array([[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    columns, rows = column + steps[:, 0], row + steps[:, 1]
    points = np.stack(
        [map_coordinates(rays.points[..., axis], [rows, columns], order=1) for axis in range(3)],
        axis=1,
    ).astype(np.float64)
    height, width = rays.hit.shape
    inside = 1.0 <= column <= width - 2.0 and 1.0 <= row <= height - 2.0
    if not inside or not rays.hit[round(row), round(column)] or not np.isfinite(points).all():
        raise CalibrationError(
            f"the model's camera sees no skin at column {centre[0]:.0f}, row {centre[1]:.0f}",
            where=name,
            hint="Check the label and the design's camera",
        )
    across = 0.5 * float(np.linalg.norm(points[2] - points[1]))
    down = 0.5 * float(np.linalg.norm(points[4] - points[3]))
    x, y, z = points[0].tolist()
    return (x, y, z), math.sqrt(across * down)
