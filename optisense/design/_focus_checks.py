"""Checks of the camera's focus, along straight rays."""

from __future__ import annotations

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.arrangement import skin_distances, straight_rays
from optisense.design.lenses.blur import DISC_DEVIATION
from optisense.design.parts import TRANSPARENT_SOLIDS, Role
from optisense.design.problems import Diagnostic
from optisense.design.responses.chain import SoftFocus
from optisense.design.sensor_design import Meshes, SensorDesign
from optisense.geometry.containment import inside
from optisense.geometry.rays import ray_hits

SHARP = 2.0
"""Diameter of the largest circle of confusion that counts as sharp, in pixels. A disc that is two
pixels wide has a standard deviation of half a pixel, little more than that of a pixel itself
(0.29)."""


def focus_problem(design: SensorDesign, meshes: Meshes) -> Diagnostic | None:
    """Return a warning if the sensing surface is out of focus.

    Cameras whose blur does not depend on depth are not checked.
    Gel and other solids on the way make objects appear nearer, and nearer still in the plane of
    incidence of an oblique face. Rays are not refracted here, so this is only a warning. Designs
    with mirrors are not checked.
    """
    camera = design.camera
    if camera.blur is None or not camera.blur.by_depth or design.parts_of(Role.MIRROR):
        return None
    vergences = straight_vergences(design, meshes)
    if not vergences.size:
        return None
    deviation = SoftFocus.of(camera.blur, camera, vergences[None]).deviation[0]
    circle = deviation / DISC_DEVIATION * camera.resolution[0]
    soft = circle > SHARP
    if not soft.any():
        return None
    distance = 1.0 / vergences.mean(axis=1)
    near, far = distance.min(), distance.max()
    middle = 2.0 / (1.0 / near + 1.0 / far)
    place = f"{middle:.3g} mm" if far - near < 0.05 * near else f"{near:.3g} to {far:.3g} mm"
    return Diagnostic(
        f"{100 * soft.mean():.0f} % of the sensing surface in view is out of focus: circles of "
        f"confusion of up to {circle.max():.1f} pixels; it appears {place} away",
        design.where("camera", "blur"),
        f"Focus {middle:.3g} mm away (camera.blur.focus_distance), or give a larger f-number",
        severity="warning",
    )


def straight_vergences(design: SensorDesign, meshes: Meshes) -> FloatArray:
    """Return the inverses (k, 2), 1/mm, of the apparent distances of the sensing surface along the
    straight rays that meet it before any blocker, across and in the plane of incidence.

    They are measured along the axis for perspective lenses, whose field of focus is flat, and along
    the ray for others.
    """
    camera, origin = design.camera, np.array(design.camera.position)
    rays = straight_rays(camera)
    nearest = skin_distances(design, meshes, rays)
    seen = np.isfinite(nearest)
    rays, nearest = rays[seen], nearest[seen]
    if not len(rays):
        return np.zeros((0, 2))
    distance = _reduced(design, meshes, origin, rays, nearest)
    if camera.projection == "perspective":
        distance = distance * (rays @ camera.axes()[2])[:, None]
    return 1.0 / distance


def _reduced(
    design: SensorDesign,
    meshes: Meshes,
    origin: FloatArray,
    rays: FloatArray,
    length: FloatArray,
) -> FloatArray:
    """Return the apparent lengths (k, 2), mm, of rays from a point (3,) along unit directions (k,
    3), of geometric lengths (k,), mm, across and in the plane of incidence.

    Across it, each piece is divided by its medium's index. In it, a face also shortens all pieces
    behind it by the ratio of the squares of the cosines of incidence and refraction (Coddington's
    equations for a plane). The angles are those of parallel layers behind air, and the planes of
    incidence of several faces count as one.
    """
    solids = [
        (design.parts[name].priority, getattr(design.materials[material], "ior", 1.0), meshes[name])
        for name in design.parts_of(*TRANSPARENT_SOLIDS)
        if name in meshes and (material := design.parts[name].material) is not None
    ]
    solids.sort(key=lambda each: each[0])
    crossings = [[(0.0, 1.0), (float(end), 1.0)] for end in length]
    for _, _, mesh in solids:
        hits = ray_hits(mesh, origin, rays)
        cosines = np.abs(np.einsum("ij,ij->i", mesh.face_normals[hits.face], rays[hits.ray]))
        for ray, *crossing in zip(
            hits.ray.tolist(), hits.distance.tolist(), cosines.tolist(), strict=True
        ):
            if crossing[0] < length[ray]:
                crossings[ray].append(tuple(crossing))
    total = np.zeros((len(rays), 2))
    for ray, places in enumerate(crossings):
        ends, cosines = np.array(sorted(places)).T
        middles = origin + 0.5 * (ends[1:] + ends[:-1])[:, None] * rays[ray]
        index = np.ones(len(middles))
        for _, ior, mesh in solids:
            index = np.where(inside(middles, mesh), ior, index)
        sine = 1.0 - cosines[1:-1] ** 2
        ratio = (1.0 - sine / index[:-1] ** 2) / (1.0 - sine / index[1:] ** 2)
        shortened = np.cumprod(np.concatenate([[1.0], ratio]))
        pieces = np.diff(ends) / index
        total[ray] = pieces.sum(), (shortened * pieces).sum()
    return total
