"""Data of a design for the page's 3-D view: solids, lights, camera and contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import LightGroup, SensorDesign
from optisense.design.colour import ROLE_LOOKS
from optisense.design.projection import directions
from optisense.errors import OptiSenseError
from optisense.geometry import TriangleMesh
from optisense.geometry.shading_normals import CREASE
from optisense.report._pictures import encoded
from optisense.report.camera_rays import CameraRays

MAX_TRIANGLES = 400_000
"""Largest number of triangles of a part in a page; a browser would stall on more."""

MARKER_SIZE = 0.35
"""Radius at which lights without an emitting window are drawn, mm: about that of a small LED."""


def scene_data(
    design: SensorDesign,
    indenters: Mapping[str, TriangleMesh],
    rays: CameraRays | None = None,
    ways: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """Return the 3-D view's data, ready for JSON.

    Args:
        indenters: meshes of the indenters, in the design's frame.
        rays: chief rays of the camera, if they are to be drawn.
        ways: paths of photons, see `LightSection`.

    Returns:
        ``parts`` (name, role, colour, alpha, meshes), ``lights`` (groups with discs and
        directions), ``camera`` (pose and frustum), ``rays`` (pairs of ends of those that reach the
        sensing surface, ``seen``, and of others, ``lost``; empty if there are none), ``ways``,
        ``centre`` (3,) and ``size`` in mm.
    """
    meshes = design.deformed_meshes()
    parts = [_part(name, design.parts[name].role.value, mesh) for name, mesh in meshes.items()]
    parts += [_part(name, "indenter", mesh) for name, mesh in indenters.items()]
    corners = np.concatenate([mesh.bounds for mesh in meshes.values()])
    camera = np.asarray(design.camera.position)[None]
    corners = np.concatenate([corners, camera])
    low, high = corners.min(axis=0), corners.max(axis=0)
    return {
        "parts": [part for part in parts if part is not None],
        "lights": [_lights(name, group) for name, group in design.lights.items()],
        "camera": _camera(design, meshes),
        "rays": {}
        if rays is None
        else {name: encoded(ends, np.float32) for name, ends in rays.segments().items()},
        "ways": list(ways),
        "centre": _rounded((low + high) / 2),
        "size": float(np.linalg.norm(high - low)),
    }


def _part(name: str, role: str, mesh: TriangleMesh) -> dict[str, Any] | None:
    if len(mesh.faces) > MAX_TRIANGLES:
        return None
    colour, alpha = ROLE_LOOKS.get(role, ("#999999", 1.0))
    smooth = mesh if mesh.normals is not None else mesh.vertex_normals()
    normals = smooth.normals
    assert normals is not None
    return {
        "name": name,
        "role": role,
        "colour": colour,
        "alpha": alpha,
        "points": encoded(smooth.vertices, np.float32),
        "normals": encoded(np.round(normals * 127), np.int8),
        "faces": encoded(smooth.faces, np.uint32),
        "edges": encoded(feature_edges(mesh), np.float32),
    }


def _lights(name: str, group: LightGroup) -> dict[str, Any]:
    radius = _window_radius(group)
    return {
        "name": name,
        "colour": _rounded(group.colour),
        "lights": [
            {
                "position": _rounded(light.position),
                "direction": _rounded(
                    np.asarray(light.direction) / np.linalg.norm(light.direction)
                ),
                "radius": radius,
            }
            for light in group.lights
        ],
    }


def _window_radius(group: LightGroup) -> float:
    """Return the radius of a disc as large as the light's emitting window, mm."""
    from optisense import library

    try:
        model = library.emitter(group)
    except OptiSenseError:
        return MARKER_SIZE
    window = model.window()
    return MARKER_SIZE if window is None else float(np.sqrt(np.prod(window.size))) / 2


def _camera(design: SensorDesign, meshes: dict[str, TriangleMesh]) -> dict[str, Any]:
    """Return the pupil and the four corners of the field of view at the sensing surface's depth."""
    camera = design.camera
    position = np.asarray(camera.position, dtype=np.float64)
    _, up, forward = camera.axes()
    surfaces = [
        mesh.vertices
        for name, mesh in meshes.items()
        if design.parts[name].role.value == "sensing_surface"
    ]
    depths = (np.concatenate(surfaces) - position) @ forward if surfaces else np.array([20.0])
    depth = max(float(np.median(depths)), 1.0)
    rays = directions(camera, np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0, 1.0]))
    ahead = np.maximum(rays @ forward, np.cos(np.radians(75.0)))  # not too far for a fisheye
    corners = list(position + depth * rays / ahead[:, None])
    return {
        "name": camera.model,
        "position": _rounded(position),
        "corners": [_rounded(corner) for corner in corners],
        "up": _rounded(up),
        "forward": _rounded(forward),
    }


def _rounded(values: Any) -> list[float]:
    return [round(float(value), 4) for value in values]


def feature_edges(mesh: TriangleMesh) -> NDArray[np.float64]:
    """Return edges between faces that meet at more than `CREASE`, which are always sharp in
    shading, and edges of one face only.

    Args:
        mesh: any mesh; coincident vertices count as one.

    Returns:
        End points (k, 2, 3), mm.
    """
    welded = mesh.welded()
    faces = welded.faces.astype(np.int64)
    ends = np.roll(faces, -1, axis=1)
    count = len(welded.vertices)
    # Edges are encoded as one number each, which sorts several times faster than pairs.
    edges = (np.minimum(faces, ends) * count + np.maximum(faces, ends)).reshape(-1)
    order = np.argsort(edges, kind="stable")
    unique, starts, counts = np.unique(edges[order], return_index=True, return_counts=True)
    first = order[starts] // 3
    second = order[np.minimum(starts + 1, len(order) - 1)] // 3
    normals = welded.face_normals
    cosine = np.einsum("ij,ij->i", normals[first], normals[second])
    is_sharp = (counts != 2) | (cosine < np.cos(np.radians(CREASE)))
    sharp = unique[is_sharp]
    return welded.vertices[np.column_stack([sharp // count, sharp % count])]
