"""A contact: an indenter with its place and depth on the sensor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.errors import ContactError
from optisense.geometry._indenters import MeshIndenter
from optisense.geometry.indenter_kinds import FACET_ERROR, Indenter, Tilted, mesh_of
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.rays import exits
from optisense.geometry.surface import SensingSurface, SurfacePoint
from optisense.text import brief

REACH_MARGIN = 0.5
"""Height (mm) above the undeformed surface up to which an indenter is modelled beyond its contact,
so that it also occludes light that passes above the skin beside it."""

LEAST_FORCE, MOST_FORCE = 1e-6, 1e6
"""Smallest and largest force (N) that can be given. The lower is the weight of a grain of sand, the
upper that of a hundred tons; a gel takes some ten."""

BESIDE = 1e-6
"""Distance (mm) beside a point, to four sides, at which the thickness of the gel is looked for if
there is none behind the point itself, as in the plane of a side of the gel: far above the rounding
of double precision, and far below any distance that matters."""

ON_SURFACE = 0.5
"""Largest distance (mm) from the sensing surface of a contact point given as x, y, z: points picked
on another tessellation of a curved surface are nearer, and a mistyped number is farther."""

SMALL = 0.1
"""Largest extent, mm, below which an indenter is probably in another unit: two to three pixels of
the built-in sensors."""

COARSE = 0.01
"""Error of facets, mm, with which the extent is measured: a tenth of `SMALL`."""

PER_METRE = 1000.0
"""Factor from metres, the unit of robot models, to mm."""


@dataclass(frozen=True)
class Contact:
    """An indenter pressed into the sensing surface along its inward normal.

    The frame of an indenter is right-handed. Its z axis is the outward normal and its x axis is
    parallel to u. Its y axis is opposite to v, because a camera sees the surface from inside, where
    u, v and the inward normal are right-handed; it is along v only where a mirror turns the picture
    over.

    Lists and arrays of numbers are converted into tuples.

    Attributes:
        indenter: the indenter.
        at: surface coordinates (u, v), mm (see `SensingSurface`); (0, 0) if neither `at` nor
            `point` is given.
        point: (x, y, z) in the design's frame (mm), instead of `at`; the nearest point of the
            surface is used.
        depth: distance (mm) from the undeformed surface to the indenter's lowest point. With a
            `force`, it keeps its default; another value is an error.
        rotation: rotation (degrees) about the outward normal, counter-clockwise seen from outside;
            at 0 the indenter's x axis is parallel to u, and above 0 it turns towards -v in a direct
            view.
        along: (3,) direction in the design's frame whose projection on the surface replaces u as
            the direction of the x axis.
        force: force (N) along the inward normal, instead of `depth`, which then follows from the
            elasticity of the gel.
        shift: (2,) displacement (mm) along u and v (see `SensingSurface.directions`) by which the
            indenter has moved to this place after it was pressed in; the elastic skin follows as
            far as friction allows.
        twist: rotation (degrees) about the outward normal, counter-clockwise seen from outside,
            after the indenter was pressed in.
    """

    indenter: Indenter
    at: tuple[float, float] | None = None
    point: tuple[float, float, float] | None = None
    depth: float = 0.5
    rotation: float = 0.0
    along: tuple[float, float, float] | None = None
    force: float | None = None
    shift: tuple[float, float] = (0.0, 0.0)
    twist: float = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.indenter, type) or not callable(getattr(self.indenter, "mesh", None)):
            raise ContactError(
                f"the indenter of a contact is {brief(repr(self.indenter))}",
                hint="Give one such as Sphere(2), or MeshIndenter(mesh) for a mesh",
            )
        if self.at is not None and self.point is not None:
            raise ContactError("a contact has both `at` and `point`", hint="Give one of them")
        for name, (shape, _, _) in _NUMBERS.items():
            given = getattr(self, name)
            if given is None and getattr(Contact, name) is None:
                continue
            values = _finite(given, shape)
            if values is None:
                raise self._refusal(name)
            object.__setattr__(self, name, values)
        if self.force is not None and self.depth != Contact.depth:
            raise ContactError("a contact has both `depth` and `force`", hint="Give one of them")
        if self.depth <= 0.0:
            raise self._refusal("depth")
        if self.force is not None and not LEAST_FORCE <= self.force <= MOST_FORCE:
            raise self._refusal("force")
        if self.along is not None and not any(self.along):
            raise self._refusal("along")

    def _refusal(self, name: str) -> ContactError:
        """Return the error for the value of a field."""
        value, (_, title, hint) = getattr(self, name), _NUMBERS[name]
        text = f"{value:g}" if isinstance(value, int | float) else brief(repr(value))
        return ContactError(f"the {title} of a contact is {text}", hint=hint)


_NUMBERS: dict[str, tuple[tuple[int, ...], str, str]] = {
    "at": ((2,), "place `at`", "Give it as 2 finite numbers (u, v), in mm"),
    "point": ((3,), "place `point`", "Give it as 3 finite numbers (x, y, z), in mm"),
    "depth": ((), "depth", "Give a depth above 0, in mm"),
    "rotation": ((), "rotation", "Give a finite number of degrees"),
    "along": ((3,), "direction `along`", "Give it as x, y, z, not all of them 0"),
    "force": (
        (),
        "force",
        f"Give a force above 0, in N, from {LEAST_FORCE:g} to {MOST_FORCE:g}",
    ),
    "shift": ((2,), "shift", "Give two numbers, in mm"),
    "twist": ((), "twist", "Give a finite number of degrees"),
}
"""The numbers of a contact by field: their shape, their title in messages, and the remedy."""


def _finite(values: object, shape: tuple[int, ...]) -> float | tuple[float, ...] | None:
    """Return finite numbers of a shape as plain values; None if they are something else."""
    try:
        array = np.asarray(values)
    except ValueError:  # lists of different lengths
        return None
    if array.dtype.kind not in "iuf" or array.shape != shape or not np.isfinite(array).all():
        return None
    return tuple(array.astype(float).tolist()) if shape else float(array)


def refuse_no_contacts(contacts: object) -> None:
    """Raise ContactError if an argument is not a sequence of contacts."""
    if isinstance(contacts, Sequence) and all(isinstance(each, Contact) for each in contacts):
        return
    hint = "Write [contact], also for a single one"
    if isinstance(contacts, Sequence) and any(isinstance(each, str) for each in contacts):
        hint = "Make each contact of its text with optisense.geometry.parse_contact"
    raise ContactError("the argument `contacts` is no list of contacts", hint=hint)


def locate(contact: Contact, surface: SensingSurface) -> SurfacePoint:
    """Return the place of a contact on a sensing surface.

    Raises:
        ContactError: the contact is off the surface.
    """
    if contact.point is None:
        return surface.point_at(*((0.0, 0.0) if contact.at is None else contact.at))
    place = surface.nearest(contact.point)
    distance = float(np.linalg.norm(place.point - np.asarray(contact.point)))
    if distance > ON_SURFACE:
        x, y, z = contact.point
        raise ContactError(
            f"the point ({x:g}, {y:g}, {z:g}) is {distance:.2f} mm away from the sensing surface",
            hint="The nearest surface point is ({:.3f}, {:.3f}, {:.3f})".format(*place.point),
        )
    return place


def place(
    contact: Contact,
    surface: SensingSurface,
    gel: TriangleMesh | Sequence[TriangleMesh] | None = None,
    facet_error: float = FACET_ERROR,
) -> TriangleMesh:
    """Return the pressed-in mesh of an indenter in the design's frame.

    The gel is not cut: where the indenter lies below the sensing surface it replaces it, so that a
    ray inside the gel sees the first of the two surfaces.

    Args:
        gel: the elastomers under it, as in `available_depth`; None or an empty list to leave the
            depth unchecked.
        facet_error: largest distance of the mesh from the indenter's exact shape, mm.

    Returns:
        The part of the indenter (mm) that can reach the surface; face and shading normals point out
        of the indenter, into the gel.

    Raises:
        ContactError: the contact is off the surface or as deep as the gel.
        OwnCodeError: the class of the indenter fails; see `mesh_of`.
    """
    spot = locate(contact, surface)
    if gel:
        available = available_depth(spot.point, spot.inward, gel)
        if contact.depth >= available:
            raise ContactError(
                f"a contact is {contact.depth:g} mm deep, but the gel there is only "
                f"{available:.2f} mm thick",
                where="at ({:.2f}, {:.2f}, {:.2f}) mm".format(*spot.point),
                hint="Press less deep",
            )
    reach = contact.depth + surface.height_above(spot) + REACH_MARGIN
    pose = np.eye(4)
    pose[:3, :3] = _axes(spot.inward, surface, contact)
    pose[:3, 3] = spot.point + contact.depth * spot.inward
    return mesh_of(contact.indenter, reach, facet_error).transformed(pose)


def available_depth(
    point: ArrayLike, inward: ArrayLike, gel: TriangleMesh | Sequence[TriangleMesh]
) -> float:
    """Return the thickness (mm) of the gel at a point of its surface along the inward normal.

    Args:
        point: (3,) point on the surface of the gel, mm.
        inward: (3,) unit vector into the gel.
        gel: closed mesh, mm, with outward face normals, or several: those that touch or overlap
            under the point count as one, as in `exits`.

    Raises:
        ContactError: there is no gel behind the point.
    """
    gels = [gel] if isinstance(gel, TriangleMesh) else gel
    way = np.asarray(inward, dtype=np.float64)
    sides = np.cross(way, np.eye(3)[np.argsort(np.abs(way))[:2]])
    starts = np.asarray(point) + BESIDE * np.concatenate([np.zeros((1, 3)), sides, -sides])
    depths = exits(gels, starts, np.tile(way, (len(starts), 1)))
    depths = depths[np.isfinite(depths)]
    if not len(depths):
        raise ContactError(
            "there is no gel under a contact",
            where="at ({:.2f}, {:.2f}, {:.2f}) mm".format(*np.asarray(point, dtype=np.float64)),
            hint="Check that the sensing surface lies on the elastomer and its normals point in",
        )
    # In the plane of a side, rounding may hide one layer of several from a line.
    return float(depths[0] if len(gels) == 1 else depths.max())


def _axes(
    inward: NDArray[np.float64], surface: SensingSurface, contact: Contact
) -> NDArray[np.float64]:
    """Return the indenter's rotated axes (3, 3) as columns: x near u or `along`, z outward."""
    z = -inward
    way = surface.u_axis
    if contact.along is not None:
        way = np.asarray(contact.along, dtype=np.float64)
        way = way / np.linalg.norm(way)
    x = way - (way @ z) * z
    if np.linalg.norm(x) < 1e-6:  # the surface has turned by 90 degrees since the origin
        x = np.cross(surface.v_axis, z)
    x = x / np.linalg.norm(x)
    # Opposite to v unless a mirror turns the picture over: these axes are right-handed seen from
    # outside, u and v of a direct view are not.
    y = np.cross(z, x)
    a = math.radians(contact.rotation)
    return np.column_stack(
        [math.cos(a) * x + math.sin(a) * y, math.cos(a) * y - math.sin(a) * x, z]
    )


def size_warning(contact: Contact) -> str | None:
    """Return a sentence about an indenter that is smaller than `SMALL` or than the depth of its
    contact, with the scale that a mesh file may need, or None.

    Raises:
        MeshError, ContactError: the mesh of the indenter can't be read.
    """
    reach = contact.depth
    mesh = mesh_of(contact.indenter, reach, COARSE)
    size = float(np.ptp(mesh.bounds, axis=0).max())
    if contact.force is None and size < reach:
        said = f"an indenter {size:.2g} mm large is pressed {reach:g} mm deep"
    elif size < SMALL:
        said = f"an indenter is {size:.2g} mm large, too small for the camera"
    else:
        return None
    file = _file(contact.indenter)
    if file is None:
        return said
    scaled = f"mesh:{file.source},{PER_METRE * file.scale:g}"
    return f"{said}; if its file is in metres, write {scaled}"


def _file(indenter: Indenter) -> MeshIndenter | None:
    """Return an indenter that is a mesh file, without its tilt, or None."""
    if isinstance(indenter, Tilted):
        return _file(indenter.indenter)
    if isinstance(indenter, MeshIndenter) and not isinstance(indenter.source, TriangleMesh):
        return indenter
    return None
