"""The angle between a sensor and a plane, from the mean colour in the middle of the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ContactError, TaskError
from optisense.geometry import Contact, TriangleMesh, available_depth
from optisense.geometry.rays import NEAREST
from optisense.geometry.rotations import turn_about_axes
from optisense.mechanics import CONFORMING

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

THICKNESS = 2.0
"""Thickness in mm of the plate, which has no effect, as only its face touches the skin."""

RAYS_ACROSS = 32
"""Number of columns of the grid of chief rays that find the extent of the view and the part that a
plane covers, each to a few per cent.
"""

MARGIN = 0.5
"""Distance (mm) by which the plate extends beyond the outermost of these rays, so that it covers
the whole view at all angles.
"""

LEAST_SHARE = 0.9
"""Smallest share of the cropped picture that must show the plate; with less, the features would
depend on the plate's border."""


@dataclass(frozen=True)
class TiltedPlate:
    """A plate whose middle stays at the place of the contact for any rotation.

    (`optisense.geometry.Plane` counts the depth to its lowest corner instead.)

    Attributes:
        angle_x, angle_y: rotation (degrees) about the indenter's x axis, which is the u axis, and
            then about its y axis.
        half: half sides along u and v, mm.
    """

    angle_x: float
    angle_y: float
    half: tuple[float, float]

    def mesh(self, reach: float, facet_error: float = 0.0) -> TriangleMesh:
        """Return the mesh; see `optisense.geometry.Indenter`. It reaches below z = 0 if tilted."""
        u, v = self.half
        block = TriangleMesh.box((-u, -v, 0.0), (u, v, THICKNESS)).vertex_normals()
        return block.transformed(turn_about_axes(self.angle_x, self.angle_y))


@dataclass(frozen=True)
class Misalignment:
    """A perception task: two angles of a plane pressed on the middle of the sensor.

    The plane covers the camera's view and passes at `depth` below the middle of the sensing
    surface. The feature and the model are those of the OptiSense paper; range, depth and crop are
    not.

    Attributes:
        range: bound (degrees) of both angles, drawn uniformly from -range to range.
        depth: depth (mm), with which the crop lies within the contact at all angles.
        crop: share of the picture's width and height with the mean, where it shows the plane.
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
                f"range {self.range:g}, depth {self.depth:g} and crop {self.crop:g} are impossible",
                hint="Give a range below 45 degrees, a depth above 0 mm and a crop up to 1",
            )

    def check(self, model: OpticalModel) -> None:
        """Check the four largest pairs of angles.

        Raises:
            ContactError: the plane would pass through the gel.
            TaskError: the plane would not cover the crop.
        """
        size = model.design.camera.size_at(RAYS_ACROSS)
        for angle_x in (-self.range, self.range):
            for angle_y in (-self.range, self.range):
                contact = plane_contact(model, angle_x, angle_y, self.depth)
                rays = model.chief_rays(size, [contact], CONFORMING)
                self._ensure_covered(rays.contact_mask)

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """Return a plane at random angles, and these angles (degrees)."""
        angles = rng.uniform(-self.range, self.range, 2).tolist()
        return plane_contact(model, angles[0], angles[1], self.depth), angles

    def measure(self, picture: NDArray[np.uint8], image: TactileImage) -> Sequence[float]:
        """Return the mean of each channel of a picture (h, w, 3) over the crop, in levels of 255.

        Raises:
            TaskError: less than LEAST_SHARE of the crop shows the plane.
        """
        touched = self._ensure_covered(image.contact_mask)
        middle = self._middle(picture)[touched]
        mean: list[float] = middle.mean(axis=0, dtype=np.float64).tolist()
        return mean

    def _middle(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the crop of an array (h, w, ...)."""
        rows, columns = (central(length, self.crop) for length in values.shape[:2])
        return values[rows, columns]

    def _ensure_covered(self, contact_mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the crop of a contact mask (h, w); raise if too little of it is true."""
        touched = self._middle(contact_mask)
        if touched.mean() < LEAST_SHARE:
            raise TaskError(
                f"the plane covers only {100 * touched.mean():.0f} % of the crop",
                hint="Press deeper, at smaller angles, or average a smaller crop",
            )
        return touched


def central(length: int, part: float) -> slice:
    """Return the slice of the central `part` of `length` rows or columns; at least one."""
    size = max(1, round(length * part))
    start = (length - size) // 2
    return slice(start, start + size)


def plane_contact(model: OpticalModel, angle_x: float, angle_y: float, depth: float) -> Contact:
    """Return a plane over the camera's whole view, at a depth (mm) below the middle of the surface
    and at angles (degrees) about the u axis, then the perpendicular one; ContactError is raised if
    it reaches the bottom of the gel.
    """
    surface = model.surface
    spot = surface.point_at(0.0, 0.0)
    rays = model.chief_rays(model.design.camera.size_at(RAYS_ACROSS))
    seen = rays.points[rays.hit] - spot.point
    u, v = (float(np.abs(seen @ axis).max()) + MARGIN for axis in (surface.u_axis, surface.v_axis))
    # These are a contact's own axes; v may point opposite to y.
    axes = np.column_stack([surface.u_axis, np.cross(-spot.inward, surface.u_axis), -spot.inward])
    corners = np.array([(a * u, b * v, 0.0) for a in (-1, 1) for b in (-1, 1)])
    turned = corners @ (axes @ turn_about_axes(angle_x, angle_y)).T
    deepest = depth + float((turned @ spot.inward).max())
    bottoms = [float(((gel.vertices - spot.point) @ spot.inward).max()) for gel in model.gels]
    if len(bottoms) > 1:  # layers that end above the bottom of the gel are left out
        middle = available_depth(spot.point, spot.inward, model.gels)
        bottoms = [bottom for bottom in bottoms if bottom >= middle - NEAREST]
    for thickness in bottoms:
        if deepest >= thickness:
            raise ContactError(
                f"a plane at {angle_x:g} and {angle_y:g} degrees, {depth:g} mm deep in the middle, "
                f"would be {deepest:.2f} mm deep at a corner, but the gel is {thickness:.2f} mm "
                "thick",
                hint="Press less deep or at smaller angles",
            )
    return Contact(TiltedPlate(angle_x, angle_y, (u, v)), at=(0.0, 0.0), depth=depth)
