"""The camera's view of the untouched sensor, and the places where contacts touch it."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, partial
from numbers import Real
from typing import TypeGuard

import numpy as np

from optisense.design import SensorDesign
from optisense.design.camera_checks import uniqueness_problem
from optisense.design.problems import raise_problems
from optisense.errors import RenderError
from optisense.geometry import Contact, Indenter, SensingSurface, Sphere, TriangleMesh, nine_places
from optisense.geometry.contact import place
from optisense.geometry.indenter_kinds import FACET_ERROR
from optisense.geometry.mesh_points import closest_place
from optisense.mechanics import Gel, elasticity_of, refuse_loose_gel
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.sensor_scenes import SensorScenes
from optisense.optics.transport.chief_rays import (
    ChiefRays,
    picture_directions,
    pixel_areas,
    sees_nothing,
    trace_chief_rays,
)

LEAST_SEEN = 9
"""Smallest number of chief rays that must arrive for nine contacts to be placed: one for each."""

VIEW_ACROSS = 96
"""Number of chief rays across the picture that find the part of the surface that the camera sees.
Their end points on built-in sensors are less than 1 mm apart, half of the radiance cache's
`VIEW_MARGIN`."""

MIDDLE_ACROSS = 64
"""Number of chief rays across the picture whose median end point is the middle of what is seen, and
whose end points show the directions of the picture on the surface."""

GRAZING = 5.0
"""Angle (degrees) between the camera's axis and the tangent plane at the origin from which on the
camera's axes are directions on the surface. Below it, both project nearly onto one line, and a tilt
of a fraction of a degree turns v around. The axes of the built-in sensors meet the surface at 78
degrees or more."""

UPWARD = 0.01
"""Distance (mm) by which the middle of what such a camera sees is moved up, as in the picture. On a
skin around the camera's axis, whose places are all as near to that middle, (0, 0) is then above the
middle of the picture. It is far above rounding, and nothing to a contact."""


def is_size(value: object) -> TypeGuard[tuple[float, float]]:
    """Return whether a value is two whole numbers."""
    return (
        isinstance(value, tuple | list | np.ndarray)
        and len(value) == 2
        and all(isinstance(each, Real) and float(each).is_integer() for each in value)
    )


def ray_camera(design: SensorDesign, resolution: tuple[int, int] | None = None) -> RayCamera:
    """Return the design's camera, at the given resolution (width, height) if there is one.

    Raises:
        RenderError: the resolution is not two whole numbers, or below one pixel.
        DesignError: the lens shows a direction twice.
    """
    camera = design.camera
    size: object = camera.resolution if resolution is None else resolution
    if not is_size(size):
        raise RenderError(
            f"the resolution is {size!r}", hint="Give width and height in pixels, as (320, 240)"
        )
    width, height = size
    if width < 1 or height < 1:
        raise RenderError(
            f"a picture of {width}x{height} pixels has no pixel", hint="Give e.g. 320x240"
        )
    folded = uniqueness_problem(design)
    raise_problems([] if folded is None else [folded], "camera")
    return RayCamera(
        position=camera.position,
        direction=camera.direction,
        up=camera.up,
        fov=camera.fov,
        width=int(width),
        height=int(height),
        equidistant=camera.projection == "equidistant",
        distortion=camera.distortion,
        film=camera.resolution[1] / camera.resolution[0],
    )


class SkinView:
    """The camera's view of the undeformed sensing surface, and the gel.

    A view never changes: another shape or camera has another view.
    """

    facet_error = FACET_ERROR
    """Largest distance (mm) of indenters' meshes from their exact shapes."""
    coarse = False
    """Whether contacts are solved coarsely, as in drafts."""

    def __init__(self, design: SensorDesign, scenes: SensorScenes) -> None:
        """Prepare the view of a sensor with these scenes; nothing is traced yet."""
        self._design = design
        self._scenes = scenes

    def chief_rays(self, resolution: tuple[int, int]) -> ChiefRays:
        """Return the chief rays of the untouched sensor."""
        fine = self._scenes.fine
        return trace_chief_rays(
            fine.scene, ray_camera(self._design, resolution), fine.sensing_faces
        )

    @cached_property
    def surface(self) -> SensingSurface:
        """The sensing surface with coordinates in mm; (0, 0) is where the camera's axis meets it,
        or the middle of what is seen.

        There, u and v are the directions of the camera's right and up on the surface. If the
        camera's axis lies within `GRAZING` of the surface, they are the directions in which the
        seen place moves over the surface as one goes right and up in the picture.

        Raises:
            RenderError: the camera sees nothing of the sensing surface, or only a few pixels along
                its own axis.
        """
        # The lens has no distortion here, as distortion may move the axis off the picture's middle.
        straight = replace(ray_camera(self._design, (3, 3)), distortion=None)
        rays = trace_chief_rays(self._scenes.fine.scene, straight)
        if rays.hit[1, 1]:
            origin = rays.points[1, 1].astype(float)
        else:
            fine = self.chief_rays(self._design.camera.size_at(MIDDLE_ACROSS))
            if not fine.hit.any():
                raise sees_nothing(fine, self._scenes.fine.scene)
            origin = np.median(fine.points[fine.hit].astype(float), axis=0)
        mesh = self._scenes.assembly.sensing
        right, up, forward = self._design.camera.axes()
        face, place = closest_place(mesh, origin)
        if abs(mesh.face_normals[face] @ forward) < np.sin(np.radians(GRAZING)):
            if not rays.hit[1, 1]:
                origin += UPWARD * up
                _, place = closest_place(mesh, origin)
            # Odd numbers of pixels have one in the middle.
            width, height = (n | 1 for n in self._design.camera.size_at(MIDDLE_ACROSS))
            right, up = picture_directions(self.chief_rays((width, height)), place)
        return SensingSurface(mesh, origin, right, up)

    @cached_property
    def gel(self) -> Gel:
        """The gel, into which contacts are pressed."""
        assembly, elasticity = self._scenes.assembly, elasticity_of(self._design)
        check = None if self.coarse else partial(refuse_loose_gel, self._design)
        return Gel(
            self.surface,
            assembly.sensing,
            assembly.gels,
            elasticity,
            self.place,
            check,
            self.coarse,
        )

    def place(self, contact: Contact) -> TriangleMesh:
        """Return the part of an indenter that can touch the skin, placed by a contact in the
        design's frame (mm).

        Raises:
            ContactError: the contact is off the surface or deeper than the gel, or no depth gives
                its force.
        """
        contact = self.gel.at_depth(contact)
        return place(contact, self.surface, self._scenes.assembly.gels, self.facet_error)

    def nine_contacts(
        self, indenter: Indenter | None, depth: float, resolution: tuple[int, int] | None
    ) -> list[Contact]:
        """Return one contact at each of nine places; see `RayModel.nine_contacts`."""
        rays = self.chief_rays(self._design.camera.size_at(VIEW_ACROSS, resolution))
        if rays.hit.sum() < LEAST_SEEN:
            raise sees_nothing(rays, self._scenes.fine.scene)
        points = rays.points[rays.hit].astype(np.float64)
        # Each pixel is weighted with the area of surface that it sees.
        weights = pixel_areas(rays)[rays.hit]
        chosen = nine_places(points, weights)
        ball = indenter if indenter is not None else Sphere(radius=1.5)
        return [
            Contact(ball, point=(float(p[0]), float(p[1]), float(p[2])), depth=depth)
            for p in points[chosen]
        ]
