"""Placement and orientation of the camera."""

from __future__ import annotations

import numpy as np

from optisense import library
from optisense.array_types import FloatArray
from optisense.design import Camera
from optisense.design.limits import refuse_far
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.containment import inside
from optisense.geometry.patches import mean_normal
from optisense.sensors.from_meshes.directions import vector
from optisense.sensors.from_meshes.recipe import CameraChoice

WIDTH = 320
"""Width of a picture if the recipe gives no resolution, pixels; the height follows the camera."""

WIDEST_FIT = 100.0
"""Largest field of view that is used to place a camera, degrees: a wider camera is placed as if it
saw this much, so that its rim is not needed.
"""

CLEARANCE = 1.0
"""Distance that an automatically placed camera keeps from the parts in front of it, mm."""

LARGEST_STEP_BACK = 200.0
"""Largest distance that an automatically placed camera steps back in search of a view, mm; no
tactile sensor is longer.
"""


def make_camera(
    choice: CameraChoice,
    skin: TriangleMesh,
    place: FloatArray | None,
    target: FloatArray,
    parts: dict[str, TriangleMesh],
) -> Camera:
    """Return the camera of a design.

    Args:
        skin: sensing surface with inward normals, mm.
        place: position of the pupil, (3,) mm; None puts it where the skin fills the picture.
        target: point that it looks at, (3,) mm, unless the choice has a direction.
        parts: parts; an automatically placed camera is outside of these.

    Raises:
        LibraryError: there is no such camera.
        DesignError: the camera looks at its own position, `up` is the viewing direction, or the
            camera is more than a metre from the origin.
    """
    model = library.camera(choice.model)
    width, height = choice.resolution or model.size_at(WIDTH)
    fov = model.fov if choice.fov is None else choice.fov
    if place is None:
        way = mean_normal(skin)
        if choice.direction is not None:
            way = -vector(choice.direction)
        if np.linalg.norm(way) < 1e-3:
            raise DesignError(
                "the sensing surface faces all sides, so a place for the camera can't be derived",
                where="camera",
                hint="Give the position of the camera: at: [x, y, z]",
            )
        way = way / np.linalg.norm(way)
        up = upward(choice, -way)
        place = _behind(skin, target, way, up, fov, width / height, parts)
    look = vector(choice.direction) if choice.direction is not None else target - place
    distance = float(np.linalg.norm(look))
    if distance < 1e-6:
        raise DesignError(
            "the camera is at the point that it looks at",
            where="camera",
            hint="Change at, the position, or look_at, the target",
        )
    look = look / distance
    up = upward(choice, look)
    if np.linalg.norm(np.cross(look, up)) < 1e-3:
        raise DesignError(
            "the viewing direction of the camera is parallel to up",
            where="camera.up",
            hint="Choose an up that points to the top of the picture",
        )
    refuse_far("the camera", place)
    x, y, z = (np.round(place, 6) + 0.0).tolist()
    dx, dy, dz = (np.round(look, 9) + 0.0).tolist()
    ux, uy, uz = (up + 0.0).tolist()
    return Camera(
        model=choice.model,
        projection=choice.projection or model.projection,
        fov=fov,
        resolution=(width, height),
        position=(x, y, z),
        direction=(dx, dy, dz),
        up=(ux, uy, uz),
    )


def upward(choice: CameraChoice, look: FloatArray) -> FloatArray:
    """Return the direction to the picture's top: as chosen, else +y, or +z when looking along y."""
    if choice.up is not None:
        return vector(choice.up)
    y, z = np.eye(3)[1], np.eye(3)[2]
    return y if abs(look @ y) < 0.7 else z


def _behind(
    skin: TriangleMesh,
    target: FloatArray,
    way: FloatArray,
    up: FloatArray,
    fov: float,
    aspect: float,
    parts: dict[str, TriangleMesh],
) -> FloatArray:
    """Return the nearest position along `way` from the target from which all of the skin is in the
    picture, outside of all parts.
    """
    right = np.cross(-way, up)
    right /= np.linalg.norm(right)
    top = np.cross(right, -way)
    wide = np.tan(np.radians(min(fov, WIDEST_FIT)) / 2.0)
    points = skin.vertices - target
    ahead = -points @ way
    needed = np.maximum(np.abs(points @ right) / wide, np.abs(points @ top) * aspect / wide)
    distance = float((needed - ahead).max())
    for step in np.arange(0.0, LARGEST_STEP_BACK, 0.5):
        place = target + (distance + step) * way
        probes = np.array([place, place + CLEARANCE * way, place - CLEARANCE * way])
        if not any(m.is_closed and inside(probes, m).any() for m in parts.values()):
            return place
    return np.asarray(target + distance * way)
