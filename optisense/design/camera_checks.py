"""Checks of the camera: its field of view, its lens, its position, and the skin in its view.

A design does not state the size of its camera's lens, so the size of the smallest camera on sale is
assumed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.design.arrangement import SAMPLES, in_picture, skin_distances, straight_rays
from optisense.design.camera import Camera
from optisense.design.parts import TRANSPARENT_SOLIDS, Role
from optisense.design.problems import Diagnostic
from optisense.design.projection import angle_across, folding_angle
from optisense.design.sensor_design import Meshes, SensorDesign
from optisense.geometry import TriangleMesh
from optisense.geometry.containment import inside
from optisense.geometry.mesh_points import distance_within, surface_samples
from optisense.geometry.rays import ray_hits

WIDEST_PERSPECTIVE = 135.0
"""Angle from corner to corner of the widest lens that keeps straight lines straight, degrees: 2
atan(21.6 / 9) of a 9 mm lens for 24 x 36 mm, the shortest on sale (Venus Optics' Laowa 9 mm f/5.6;
assumed, as its data sheet was not at hand). Goerz's Hypergon of 1900 has 130 (H. H. Nasse,
"Distagon, Biogon and Hologon", Carl Zeiss 2011)."""

WIDEST_FISHEYE = 280.0
"""Angle across the image of the widest fisheye, degrees. C-4 Optics' 4.9 mm f/3.5 has 270
(Lensrentals, "Assembling the C-4 Optics 4.9mm f3.5 Hyperfisheye Prototype", 2019). Entaniya's M12
280, a lens for small cameras, has 280 by its name (assumed, as its data sheet was not at hand)."""

ROUNDED = 1e-9
"""Rounding error of an angle, degrees, by which it may exceed its limit."""

NARROWEST = 1.0
"""Smallest angle across the image, degrees. A sensing surface as wide as a fingertip, 17 mm, fills
one degree from 1000 mm away, the farthest that a camera of a design may be (`limits.LARGEST`); a
telecentric lens, which has no angle, can be given as a pinhole at that distance."""

SMALLEST_CAMERA = 0.65
"""Width of the smallest camera module on sale, mm: OmniVision's OVM6948 of 0.65 x 0.65 x 1.158 mm
("OmniVision has created the world's smallest commercially available image sensor", DPReview 2019).
"""

LEAST_SKIN = 0.25
"""Share of the sensing surface's area that the camera must see for a score. Scores reward a camera
that looks at a small spot. The built-in sensors see 0.45 (GelBelt) to 0.75 (GelSight360)."""

LEAST_PICTURE = 0.2
"""Share of the picture that must show the sensing surface for a score. 2to3PW does not count the
other pixels, and rewards a camera that is far away. The built-in sensors have 0.31 (GelSight
Svelte) to 1."""


VIEW_POINTS = 1000
"""Number of points of the sensing surface that are looked for in the picture; they give its share
to about 0.01."""

HIDDEN_STEP = 10
"""Number of points in the picture of which one is looked for behind blockers. The hidden share is
then known to about 0.05. A check precedes every draft in the studio: with all points, that of DIGIT
takes 115 instead of 40 ms."""

BEFORE = 1e-6
"""Share of the distance to a point by which a blocker must be nearer to hide it; a housing that
ends at the skin does not. It covers rounding."""


def lens_problem(camera: Camera, where: str) -> Diagnostic | None:
    """Return the problem of a field of view, at a place of the design, that no lens has; that of
    fisheyes is the true one.
    """
    if camera.fov < NARROWEST:
        return Diagnostic(
            f"no lens of a sensor sees as little as {camera.fov:g} degrees",
            where,
            f"Give {NARROWEST:g} degrees or more",
        )
    if camera.projection == "equidistant":
        folds = folding_angle(camera)
        across = angle_across(camera) if folds is None else camera.fov
        if across <= WIDEST_FISHEYE + ROUNDED:
            return None
        return Diagnostic(
            f"no fisheye lens sees {across:.4g} degrees",
            where,
            f"Give {WIDEST_FISHEYE:g} degrees or less; its distortion counts",
        )
    width, height = camera.resolution
    diagonal = float(np.hypot(1.0, height / width))
    corner = np.degrees(2.0 * np.arctan(diagonal * np.tan(np.radians(camera.fov / 2.0))))
    if corner <= WIDEST_PERSPECTIVE:
        return None
    half = np.tan(np.radians(WIDEST_PERSPECTIVE / 2.0)) / diagonal
    most = np.floor(10.0 * np.degrees(2.0 * np.arctan(half))) / 10.0
    return Diagnostic(
        f"no perspective lens sees {camera.fov:g} degrees across the image "
        f"({corner:.0f} from corner to corner)",
        where,
        f"Give {most:g} degrees or less, or use 'projection: equidistant'",
    )


def place_problem(design: SensorDesign, meshes: Meshes) -> Diagnostic | None:
    """Return the problem of a camera whose lens is inside a transparent solid or another part.

    Cameras inside opaque solids are found together with the lights. A camera that is cast into a
    solid needs a cavity in it: a sphere about the pupil bends no ray, as the lens is made for that
    medium.
    """
    position = np.array(design.camera.position)
    at = "({:g}, {:g}, {:g})".format(*design.camera.position)
    where = design.where("camera", "position")
    for name, mesh in meshes.items():
        role = design.parts[name].role
        if role in TRANSPARENT_SOLIDS and mesh.is_closed and inside(position[None], mesh)[0]:
            return Diagnostic(
                f"the camera is inside the solid part '{name}' ({role.value}) at {at}",
                where,
                "Move it out, or make a cavity for it in the part's mesh, such as a sphere "
                "about the camera's position",
            )
    for name, mesh in meshes.items():
        distance = distance_within(mesh, position, SMALLEST_CAMERA)
        if distance < 0.5 * SMALLEST_CAMERA:
            return Diagnostic(
                f"the camera is {distance:.2g} mm from part '{name}' at {at}: even the "
                f"smallest camera is {SMALLEST_CAMERA:g} mm wide, so its lens is in the part",
                where,
                f"Move it {0.5 * SMALLEST_CAMERA:.2g} mm or more away",
            )
    return None


def camera_fault(design: SensorDesign, meshes: Meshes) -> Diagnostic | None:
    """Return the first reason why the camera can't exist, or None."""
    lens = lens_problem(design.camera, design.where("camera", "fov"))
    return lens or uniqueness_problem(design) or place_problem(design, meshes)


class ViewShares(NamedTuple):
    """Shares of the camera's view along straight rays, 0 to 1.

    Attributes:
        skin: share of the sensing surface's area that faces the camera, is in the picture and not
            hidden.
        outside: share of the sensing surface's area that is in the picture, but whose coating's
            outside faces the camera.
        picture: share of the picture that shows the sensing surface.
        hidden: share of the sensing surface's area that is in the picture behind a blocker, by the
            name of the blocker that is nearest to the camera.
    """

    skin: float
    outside: float
    picture: float
    hidden: dict[str, float]


def view_problem(design: SensorDesign, meshes: Meshes) -> Diagnostic | None:
    """Return a warning if too little of the sensing surface is in the camera's straight view.

    Refraction is ignored, so this is only a warning; scores use refracted rays. Designs with
    mirrors are not checked.
    """
    shares = view_shares(design, meshes)
    if shares is None:
        return None
    where = design.where("camera", "direction")
    if shares.picture >= LEAST_PICTURE and shares.skin >= LEAST_SKIN:
        return None
    hider = max(shares.hidden, key=lambda name: shares.hidden[name], default=None)
    if hider is not None and shares.hidden[hider] > shares.skin:
        return Diagnostic(
            f"part '{hider}' (blocker) hides {100 * shares.hidden[hider]:.0f} % of the sensing "
            f"surface from the camera, which sees {100 * shares.skin:.0f} %, if refraction is "
            "neglected",
            design.where("parts", hider, "role"),
            "If it is clear, its role is support; otherwise move it or the camera",
            severity="warning",
        )
    if shares.outside > shares.skin:
        return Diagnostic(
            f"the camera looks at the outside of the coating on {100 * shares.outside:.0f} % "
            f"of the sensing surface, and sees the inside of {100 * shares.skin:.0f} %, if "
            "refraction is neglected",
            design.where("camera", "position"),
            "Move the camera to the side of the gel; or, if it is there, turn the faces of the "
            "sensing surface over, as their normals must point to that side",
            severity="warning",
        )
    skins = [meshes[name] for name in design.parts_of(Role.SENSING_SURFACE) if name in meshes]
    in_sight = any(in_picture(design.camera, skin.vertices).any() for skin in skins)
    if shares.picture == 0.0 and shares.skin == 0.0 and not in_sight:
        return Diagnostic(
            "the sensing surface is not in the camera's field of view",
            where,
            "Point the camera's direction at it, or move the camera, unless the parts bend the "
            "light that far",
            severity="warning",
        )
    if shares.picture < LEAST_PICTURE:
        filled = 100 * shares.picture
        return _small(f"the sensing surface fills {filled:.0f} % of the picture", where)
    return _small(f"{100 * shares.skin:.0f} % of the sensing surface is in the picture", where)


def view_shares(design: SensorDesign, meshes: Meshes) -> ViewShares | None:
    """Return the shares of the camera's view along straight rays; None if there is no sensing
    surface, or a mirror.
    """
    skins = [meshes[name] for name in design.parts_of(Role.SENSING_SURFACE) if name in meshes]
    total = sum(skin.area for skin in skins)
    if total == 0.0 or design.parts_of(Role.MIRROR):
        return None
    camera = design.camera
    position = np.array(camera.position)
    points, normals = np.concatenate([_even_points(skin, total) for skin in skins], axis=1)
    facing = np.einsum("ki,ki->k", position - points, normals) > 0.0
    shown = in_picture(camera, points)
    inside = points[facing & shown]
    some = inside[::HIDDEN_STEP]
    nearest, hider = np.ones(len(some)), np.full(len(some), -1)
    blockers = [name for name in design.parts_of(Role.BLOCKER) if name in meshes]
    for number, name in enumerate(blockers):
        hits = ray_hits(meshes[name], position, some - position)
        closest = np.ones(len(some))
        np.minimum.at(closest, hits.ray, hits.distance)
        closer = closest < nearest - BEFORE
        nearest[closer], hider[closer] = closest[closer], number
    arriving = np.isfinite(skin_distances(design, meshes, straight_rays(camera)))
    picture = np.count_nonzero(arriving) / SAMPLES
    counts = np.bincount(hider + 1, minlength=len(blockers) + 1) / max(1, len(some))
    counts *= len(inside) / len(points)
    hidden = {name: float(n) for name, n in zip(blockers, counts[1:], strict=True) if n > 0.0}
    outside = np.count_nonzero(shown & ~facing) / len(points)
    return ViewShares(float(counts[0]), outside, picture, hidden)


def _even_points(skin: TriangleMesh, total: float) -> NDArray[np.float64]:
    """Return points, mm, of one of several sensing surfaces, which stand for equal shares of their
    `total` area, mm², and their inward normals: (2, k, 3) together.
    """
    spacing = float(np.sqrt(total / VIEW_POINTS))
    points, faces, areas = surface_samples(skin.vertices, skin.faces, spacing)
    count = max(1, round(VIEW_POINTS * skin.area / total))
    reached = np.cumsum(areas)
    chosen = np.searchsorted(reached, (np.arange(count) + 0.5) / count * reached[-1])
    return np.stack([points.T[chosen], skin.face_normals[faces[chosen]]]).astype(np.float64)


def _small(message: str, where: str) -> Diagnostic:
    return Diagnostic(
        f"{message}, if refraction is neglected",
        where,
        "Move the camera or change its field of view, unless the parts bend the light that far; "
        f"scores need {100 * LEAST_PICTURE:g} % of the picture and {100 * LEAST_SKIN:g} % of the "
        "surface",
        severity="warning",
    )


def uniqueness_problem(design: SensorDesign) -> Diagnostic | None:
    """Return the problem of a lens that shows a direction twice within the picture."""
    angle = folding_angle(design.camera)
    if angle is None:
        return None
    return Diagnostic(
        f"the lens's distortion folds {angle:.3g} degrees off its axis, inside the picture: "
        "points beyond are shown twice, or some pixels show nothing",
        design.where("camera", "distortion"),
        "Give coefficients nearer to 0, or a smaller field of view (fov); a calibration is "
        "valid only where its marks were",
    )
