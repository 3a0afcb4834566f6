"""A sensor's surfaces, lights and camera as an ordinary Mitsuba scene.

Mitsuba's own ``path`` integrator renders this scene with Mitsuba's BSDFs, emitters and sensor, as a
reference for tests and benchmarks. A path tracer finds an area light through smooth glass only by
chance, and never a point light or a spot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.errors import RenderError
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.emitters import Emitter, EmitterShape
from optisense.optics.scene.interfaces import SMOOTH_ALPHA
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surfaces import CLEAR, Surface, SurfaceKind

Colour = tuple[float, float, float]

PATH_DEPTH = 256
"""Largest number of surfaces of a path in the exported scene. A mirroring skin and the faces of a
slab guide light on longer paths than one expects; docs/validation.md states what these carry.
Russian roulette ends most paths long before: on GelSight Mini, a limit of 32 takes the same time
within the 5 % by which repeated measurements differ."""

SPOT_PIXELS = 512
"""Side (pixels) of the bitmap that holds the profile of a spot light. With 512, a pixel of a spot
of 60 degrees is 0.4 degrees wide on its axis."""
MAX_SPOT_ANGLE = 80.0
"""Largest cut-off angle (degrees) of an exported spot light. Mitsuba maps its profile to a plane
across the axis, which cannot reach 90 degrees; at 80 degrees, a pixel is 1.3 degrees wide."""

BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
"""Mitsuba's BSDF of a surface that absorbs all light."""


def mitsuba_scene(
    pieces: Sequence[Piece],
    emitters: Sequence[Emitter],
    camera: RayCamera,
    flux: Sequence[Colour],
    *,
    samples: int = 64,
    channel: int | None = None,
) -> dict[str, Any]:
    """Return a dictionary for ``mi.load_dict``.

    If a medium absorbs, the integrator is ``volpath``, which follows media, otherwise ``path``.

    Args:
        pieces: all surfaces; emitting faces are left out, as the emitters include them.
        emitters: the lights.
        camera: a perspective camera.
        flux: power (mW) per channel of each light of a group, in the order of the groups.
        samples: number of samples per pixel.
        channel: channel (0 to 2 for R, G, B) whose refractive indices the scene has; the picture is
            exact in that channel only. By default all light has the mean index, as Mitsuba's
            dielectrics have a single index.

    Raises:
        RenderError: Mitsuba has no such camera, or a light's profile extends too far from its axis.
    """
    absorbing = any(piece.surface.absorbs for piece in pieces)
    integrator = "volpath" if absorbing else "path"
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": integrator, "max_depth": PATH_DEPTH, "rr_depth": 16},
        "sensor": _sensor(camera, samples),
    }
    for number, piece in enumerate(pieces):
        if piece.surface.kind is not SurfaceKind.LIGHT:
            scene[f"piece_{number}"] = _mesh(piece, channel)
    for number, emitter in enumerate(emitters):
        scene[f"light_{number}"] = _emitter(emitter, np.asarray(flux[emitter.group], float))
    return scene


def surface_bsdf(surface: Surface, channel: int | None = None) -> dict[str, Any]:
    """Return Mitsuba's description of a surface; its indices are already relative to the medium in
    front of it.
    """
    if surface.kind is SurfaceKind.DIELECTRIC:
        own = channel is not None and surface.etas is not None
        eta = surface.etas[channel] if own else surface.eta  # type: ignore[index]
        smooth = {"int_ior": float(eta), "ext_ior": 1.0}
        if surface.alpha <= SMOOTH_ALPHA:
            return {"type": "dielectric", **smooth}
        return {
            "type": "roughdielectric",
            "distribution": "ggx",
            "alpha": float(surface.alpha),
            "sample_visible": True,
            **smooth,
        }
    if surface.kind in (SurfaceKind.ABSORBER, SurfaceKind.LIGHT):
        return {"type": "twosided", "bsdf": BLACK}
    index = {"eta": _rgb(surface.metal_eta), "k": _rgb(surface.metal_k)}
    if surface.kind is SurfaceKind.MIRROR:
        return {"type": "twosided", "bsdf": {"type": "conductor", **index}}
    diffuse = {"type": "diffuse", "reflectance": _rgb(surface.reflectance)}
    metal = {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha": float(surface.alpha),
        "sample_visible": True,
        **index,
    }
    if surface.specularity <= 0.0:
        return {"type": "twosided", "bsdf": diffuse}
    if surface.specularity >= 1.0:
        return {"type": "twosided", "bsdf": metal}
    blend = {"type": "blendbsdf", "weight": float(surface.specularity), "a": diffuse, "b": metal}
    return {"type": "twosided", "bsdf": blend}


def _rgb(values: Sequence[float] | NDArray[np.floating]) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in values]}


def _medium(absorption: Colour) -> Any:
    """Return a Mitsuba medium that absorbs and does not scatter."""
    return mi.load_dict(
        {"type": "homogeneous", "albedo": _rgb((0.0,) * 3), "sigma_t": _rgb(absorption)}
    )


def _mesh(piece: Piece, channel: int | None) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(surface_bsdf(piece.surface, channel))
    media = piece.surface.absorption or (CLEAR, CLEAR)
    for side, absorption in zip(("interior", "exterior"), media, strict=True):
        if max(absorption) > 0.0:
            properties[side] = _medium(absorption)
    vertices = np.asarray(piece.vertices, dtype=np.float32)
    smooth = piece.normals is not None
    mesh = mi.Mesh(piece.name, len(vertices), len(piece.faces), properties, smooth)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(vertices.ravel())
    parameters["faces"] = mi.UInt32(np.asarray(piece.faces, dtype=np.uint32).ravel())
    if smooth:
        normals = np.asarray(piece.normals, dtype=np.float32)
        parameters["vertex_normals"] = mi.Float(normals.ravel())
    parameters.update()
    return mesh


def _sensor(camera: RayCamera, samples: int) -> dict[str, Any]:
    if camera.equidistant:
        raise RenderError(
            "Mitsuba has no camera with an equidistant projection", hint="Use a perspective camera"
        )
    if camera.distortion is not None:
        raise RenderError(
            "Mitsuba's cameras have no lens distortion", hint="Remove the camera's 'distortion'"
        )
    target = np.asarray(camera.position, float) + np.asarray(camera.direction, float)
    return {
        "type": "perspective",
        "fov": float(camera.fov),
        "fov_axis": "x",
        "near_clip": 1e-3,
        "far_clip": 1e5,
        "to_world": mi.ScalarTransform4f().look_at(
            origin=list(map(float, camera.position)), target=target.tolist(), up=list(camera.up)
        ),
        "sampler": {"type": "independent", "sample_count": samples},
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }


def _emitter(emitter: Emitter, power: NDArray[np.floating]) -> dict[str, Any]:
    if emitter.shape is EmitterShape.POINT:
        return _point(emitter, power)
    if emitter.intensity is not None or emitter.exponent != 1.0:
        raise RenderError(
            "Mitsuba's area lights are Lambertian, and this light is not",
            where=f"group {emitter.group}",
            hint="Use a Lambertian light, or a point light",
        )
    half = np.asarray(emitter.size, float) / 2
    area = 4 * half[0] * half[1]
    kind = "rectangle"
    if emitter.shape is EmitterShape.DISC:
        kind, area = "disk", np.pi * half[0] * half[1]
    return {
        "type": kind,
        "to_world": _pose(emitter, half),
        "bsdf": BLACK,
        "emitter": {"type": "area", "radiance": _rgb(power / (np.pi * area))},
    }


def _point(emitter: Emitter, power: NDArray[np.floating]) -> dict[str, Any]:
    profile = emitter.intensity
    if profile is not None and profile.polar[-1] >= 180.0 and np.ptp(profile.values) == 0.0:
        position = [float(v) for v in emitter.position]
        return {"type": "point", "position": position, "intensity": _rgb(power / (4 * np.pi))}
    if profile is None or profile.polar[-1] > MAX_SPOT_ANGLE:
        raise RenderError(
            f"Mitsuba has no point light that emits at more than {MAX_SPOT_ANGLE:g} degrees from "
            "its axis, except one that emits equally in all directions",
            where=f"group {emitter.group}",
            hint="Use a spot of a smaller angle, or an area light",
        )
    cutoff = float(profile.polar[-1])
    # Mitsuba multiplies the intensity of a spot by a texture on the plane across its axis.
    reach = np.tan(np.radians(cutoff))
    steps = (np.arange(SPOT_PIXELS) + 0.5) * (2 / SPOT_PIXELS) - 1
    x, y = np.meshgrid(steps * reach, steps * reach)
    polar = np.degrees(np.arctan(np.hypot(x, y)))
    image = profile.at(polar, np.degrees(np.arctan2(y, x)))
    cell = (2 * reach / SPOT_PIXELS) ** 2
    total = float((image * cell * np.cos(np.radians(polar)) ** 3).sum())
    bitmap = mi.Bitmap(np.repeat(image[:, :, None], 3, axis=2).astype(np.float32))
    return {
        "type": "spot",
        "to_world": _pose(emitter, np.ones(2)),
        "cutoff_angle": cutoff,
        "beam_width": cutoff * 0.9999,
        "intensity": _rgb(power / total),
        "texture": {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"},
    }


def _pose(emitter: Emitter, half: NDArray[np.floating]) -> Any:
    """Return the transformation from the light's own frame (axis along +z, half sizes 1) to the
    scene.
    """
    frame = emitter.frame
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = frame[0] * half[0], frame[1] * half[1], frame[2]
    matrix[:3, 3] = emitter.position
    return mi.ScalarTransform4f(matrix)
