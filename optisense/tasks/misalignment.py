"""The angle between a sensor and a plane, from the mean colour in the middle of the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ContactError, TaskError
from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.mesh import turn_about_x_and_y
from optisense.mechanics import CONFORMING

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

THICKNESS = 2.0
"""Thickness in mm of the plate; only its face touches the skin."""

RAYS = 32, 24
"""Grid of chief rays (columns, rows) that tell how far the camera sees and what a plane covers."""

MARGIN = 0.5
"""mm that the plate reaches beyond the outermost of these rays."""

LEAST_SHARE = 0.9
"""Share of the cropped picture that must show the plate; less would tell the angle by the plate's
border."""


@dataclass(frozen=True)
class TiltedPlate:
    """A plate whose middle stays on the contact place, however it is turned.

    (`optisense.geometry.Plane` counts the depth to its lowest corner instead.)

    Attributes:
        angle_x, angle_y: degrees, turned about the indenter's x axis, which is the u axis, and
            then about its y axis.
        half: mm, half its sides along u and v.
    """

    angle_x: float
    angle_y: float
    half: tuple[float, float]

    def mesh(self, reach: float, facet_error: float = 0.0) -> TriangleMesh:
        """See `optisense.geometry.Indenter`; it reaches below z = 0 where it is tilted."""
        u, v = self.half
        block = TriangleMesh.box((-u, -v, 0.0), (u, v, THICKNESS)).vertex_normals()
        return block.transformed(turn_about_x_and_y(self.angle_x, self.angle_y))


@dataclass(frozen=True)
class Misalignment:
    """A plane pressed on the middle of the sensor at two angles, which are to be read.

    The plane covers what the camera sees and passes at `depth` below the middle of the sensing
    surface. The paper gives the feature and the model; range, depth and crop are ours.

    Attributes:
        range: degrees; both angles are drawn evenly from -range to range.
        depth: mm, so that the crop lies within the contact at all angles.
        crop: the part of the picture's width and height whose mean is taken, where it shows the
            plane.
    """

    range: float = 10.0
    depth: float = 0.8
    crop: float = 0.25

    name: ClassVar[str] = "misalignment"
    unit: ClassVar[str] = "degrees"
    targets: ClassVar[tuple[str, ...]] = ("angle_x", "angle_y")
    features: ClassVar[tuple[str, ...]] = ("mean_red", "mean_green", "mean_blue")
    width: ClassVar[int] = 48
    contact_only: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not (0 < self.range < 45 and self.depth > 0 and 0 < self.crop <= 1):
            raise TaskError(
                f"range {self.range:g}, depth {self.depth:g} and crop {self.crop:g} make no sense",
                hint="Give a range below 45 degrees, a depth above 0 mm and a crop up to 1",
            )

    def check(self, model: OpticalModel) -> None:
        """Try the four largest pairs of angles.

        Raises:
            ContactError: the plane would go through the gel.
            TaskError: it would not cover the crop.
        """
        from optisense.optics.scene.surfaces import Region

        for angle_x in (-self.range, self.range):
            for angle_y in (-self.range, self.range):
                contact = plane_contact(model, angle_x, angle_y, self.depth)
                rays = model.chief_rays(RAYS, [contact], CONFORMING)
                self._ensure_covered(rays.hit & (rays.region == Region.INDENTER))

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """A plane at random angles."""
        angles = rng.uniform(-self.range, self.range, 2).tolist()
        return plane_contact(model, angles[0], angles[1], self.depth), angles

    def measure(self, picture: NDArray[np.uint8], image: TactileImage) -> Sequence[float]:
        """The mean of each channel over the crop, in levels of 255.

        Raises:
            TaskError: less than LEAST_SHARE of the crop shows the plane.
        """
        touched = self._ensure_covered(image.contact_mask)
        middle = self._middle(picture)[touched]
        mean: list[float] = middle.mean(axis=0, dtype=np.float64).tolist()
        return mean

    def _middle(self, values: NDArray[Any]) -> NDArray[Any]:
        """The crop of (h, w, ...)."""
        rows, columns = (central(length, self.crop) for length in values.shape[:2])
        return values[rows, columns]

    def _ensure_covered(self, contact_mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The crop of a contact mask (h, w), or an error if too little of it is true."""
        touched = self._middle(contact_mask)
        if touched.mean() < LEAST_SHARE:
            raise TaskError(
                f"the plane covers only {100 * touched.mean():.0f} % of the crop",
                hint="Press deeper, at smaller angles, or average a smaller crop",
            )
        return touched


def central(length: int, part: float) -> slice:
    """The central `part` of so many rows or columns; at least one."""
    size = max(1, round(length * part))
    start = (length - size) // 2
    return slice(start, start + size)


def plane_contact(model: OpticalModel, angle_x: float, angle_y: float, depth: float) -> Contact:
    """A plane over all that the camera sees, `depth` mm below the surface's middle.

    Args:
        angle_x, angle_y: degrees about the u axis and then about the one square to it.

    Raises:
        ContactError: it reaches the bottom of the gel.
    """
    surface = model.surface
    spot = surface.point_at(0.0, 0.0)
    rays = model.chief_rays(RAYS)
    seen = rays.points[rays.hit] - spot.point
    u, v = (float(np.abs(seen @ axis).max()) + MARGIN for axis in (surface.u_axis, surface.v_axis))
    # As a contact's own axes: v may point the other way than y.
    axes = np.column_stack([surface.u_axis, np.cross(-spot.inward, surface.u_axis), -spot.inward])
    corners = np.array([(a * u, b * v, 0.0) for a in (-1, 1) for b in (-1, 1)])
    turned = corners @ (axes @ turn_about_x_and_y(angle_x, angle_y)).T
    deepest = depth + float((turned @ spot.inward).max())
    for gel in model.gels:
        thickness = float(((gel.vertices - spot.point) @ spot.inward).max())
        if deepest >= thickness:
            raise ContactError(
                f"a plane at {angle_x:g} and {angle_y:g} degrees, {depth:g} mm deep in the middle, "
                f"would be {deepest:.2f} mm deep at a corner, but the gel is {thickness:.2f} mm "
                "thick",
                hint="Press less deep or at smaller angles",
            )
    return Contact(TiltedPlate(angle_x, angle_y, (u, v)), at=(0.0, 0.0), depth=depth)
