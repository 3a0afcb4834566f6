"""Lights along the outline of a part, and lights at the positions of a pick-and-place file."""

from __future__ import annotations

import fnmatch

import numpy as np
import shapely

from optisense.array_types import FloatArray
from optisense.design import Light
from optisense.design.section import cut
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.near import suggestion
from optisense.sensors.from_meshes._lights import evenly, light
from optisense.sensors.from_meshes._pick_and_place import BoardPart, PartTable
from optisense.sensors.from_meshes.directions import axis_of, radial_vector, vector
from optisense.sensors.from_meshes.recipe_lights import FromTable, LightsAlong

ROUND = 30.0
"""Largest angle between sides of an outline that count as pieces of a curve, degrees; lights on
them point as on the curve."""

MISFIT = 0.2
"""Largest difference between distances of points on the board and in the sensor, mm."""


def along(choice: LightsAlong, mesh: TriangleMesh) -> list[Light]:
    """Return lights along the outline of a part, cut across an axis.

    Raises:
        DesignError: the part does not reach this height.
    """
    axis, sign = axis_of(choice.axis)
    first, second = np.eye(3)[(axis + 1) % 3], sign * np.eye(3)[(axis + 2) % 3]
    middle = mesh.bounds.mean(axis=0)
    height = middle[axis] if choice.height is None else choice.height
    corners = _outline(mesh, axis, height, np.array([first, second]))
    line = shapely.LinearRing(corners)
    way = np.array([vector(choice.start) @ first, vector(choice.start) @ second])
    if np.linalg.norm(way) < 1e-6:
        raise DesignError(
            f"start points along {choice.axis}, so that it meets no point of the outline",
            hint="Give a direction perpendicular to the axis",
        )
    inside = np.array([middle @ first, middle @ second])
    ray = shapely.LineString([inside, inside + 2.0 * line.length * way / np.linalg.norm(way)])
    hits = shapely.get_coordinates(line.intersection(ray))
    if len(hits) == 0:
        raise DesignError(
            "the outline has no point in the direction start", hint="Choose another direction"
        )
    first_hit = hits[np.argmax((hits - inside) @ way)]
    zero = line.project(shapely.Point(first_hit)) + choice.shift
    lights = []
    for offset in evenly(choice.count, choice.pitch, line.length):
        place, out = _on_outline(corners, (zero + offset) % line.length)
        outward = out[0] * first + out[1] * second
        looks = radial_vector(choice.direction, outward)
        spot = place[0] * first + place[1] * second + choice.gap * outward
        spot[axis] = height
        lights.append(light(spot, looks, np.eye(3)[axis]))
    return lights


def _outline(mesh: TriangleMesh, axis: int, height: float, frame: FloatArray) -> FloatArray:
    """Return the largest outline of a section, anticlockwise, in a plane frame, (n, 2) mm."""
    lines = cut(mesh, height * np.eye(3)[axis], np.eye(3)[axis])
    polygons = [shapely.Polygon(line @ frame.T) for line in lines if len(line) > 3]
    if not polygons:
        low, high = mesh.bounds[:, axis]
        raise DesignError(
            f"the part has no outline at height {height:g} mm: along {'xyz'[axis]} it reaches from "
            f"{low:g} to {high:g} mm",
            hint=f"Give a height between these, as {'xyz'[axis]} in the sensor, or leave it out",
        )
    rim = shapely.get_exterior_ring(max(polygons, key=lambda polygon: polygon.area))
    corners = shapely.get_coordinates(rim)
    return np.asarray(corners if shapely.is_ccw(rim) else corners[::-1])


def _on_outline(corners: FloatArray, distance: float) -> tuple[FloatArray, FloatArray]:
    """Return the point at a distance along a closed outline, (2,) mm, and its outward unit
    normal.
    """
    sides = np.diff(corners, axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    ends = np.cumsum(lengths)
    k = min(int(np.searchsorted(ends, distance, side="right")), len(sides) - 1)
    share = (distance - (ends[k] - lengths[k])) / lengths[k]
    out = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / lengths[:, None]

    before = out[k] + (out[k - 1] if _round(out[k - 1], out[k]) else out[k])
    following = out[(k + 1) % len(out)]
    after = out[k] + (following if _round(following, out[k]) else out[k])
    before, after = before / np.linalg.norm(before), after / np.linalg.norm(after)
    normal = (1.0 - share) * before + share * after
    return corners[k] + share * sides[k], normal / np.linalg.norm(normal)


def _round(one: FloatArray, other: FloatArray) -> bool:
    return bool(one @ other > np.cos(np.radians(ROUND)))


def from_table(choice: FromTable, table: PartTable) -> list[Light]:
    """Return the lights of a pick-and-place file at the position of its board in the sensor.

    Raises:
        DesignError: there is no such designator, the position of a chosen part is unknown, or the
            points do not fit the file.
    """
    wanted = [choice.only] if isinstance(choice.only, str) else choice.only
    chosen = list(table)
    if wanted is not None:
        for name in wanted:
            if not fnmatch.filter(table, name):
                raise _unknown(name, table)
        chosen = [name for name in table if any(fnmatch.fnmatchcase(name, w) for w in wanted)]
    frame, origin = _frame(choice, table)
    lights = []
    for part in (_known(name, table) for name in chosen):
        side = -1.0 if part.bottom else 1.0
        turn = np.radians(part.rotation)
        up = -np.sin(turn) * frame[0] + np.cos(turn) * frame[1]
        normal = side * frame[2]
        place = origin + part.x * frame[0] + part.y * frame[1] + choice.gap * normal
        lights.append(light(place, normal, up))
    return lights


def _frame(choice: FromTable, table: PartTable) -> tuple[FloatArray, FloatArray]:
    """Return the board's x, y and top as rows (3, 3), and the position of its origin (3,), mm."""
    if choice.points is None:
        normal = vector(choice.normal or "+z")
        right = vector(choice.right or "+x")
        right = right - (right @ normal) * normal
        if np.linalg.norm(right) < 1e-6:
            raise DesignError(
                "right and normal are parallel",
                hint="Set right to the direction of the file's x axis",
            )
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(normal, right), normal]), np.array(choice.origin)
    names = list(choice.points)
    parts = [_known(name, table) for name in names]
    board = np.array([(part.x, part.y, 0.0) for part in parts])
    there = np.array([choice.points[name] for name in names])
    for i, one in enumerate(names):
        for j in range(i):
            drawn = float(np.linalg.norm(board[i] - board[j]))
            given = float(np.linalg.norm(there[i] - there[j]))
            if abs(drawn - given) > MISFIT:
                raise DesignError(
                    f"{names[j]} and {one} are {drawn:.3f} mm apart in the file, but "
                    f"{given:.3f} mm by points",
                    hint="Correct the points, or give the file's units",
                )
    given_normal = None if choice.normal is None else vector(choice.normal)
    return _fitted(board, there, given_normal)


def _fitted(
    board: FloatArray, there: FloatArray, normal: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Return the frame that maps two or three points of the board to their positions."""
    side_1, side_2 = board[1] - board[0], there[1] - there[0]
    if normal is None:
        plane = np.cross(side_1, board[2] - board[0])
        normal = np.cross(side_2, there[2] - there[0])
        if min(np.linalg.norm(plane), np.linalg.norm(normal)) < 1e-6:
            raise DesignError(
                "the three points lie on one line",
                hint="Choose another third point, or give two points and normal",
            )
        normal = normal / np.linalg.norm(normal) * np.sign(plane[2])
    x = side_2 - (side_2 @ normal) * normal
    if np.linalg.norm(x) < 0.5 * np.linalg.norm(side_2):
        raise DesignError(
            "normal is parallel to the line through the two points",
            hint="Set normal to the direction of the top of the board",
        )
    x /= np.linalg.norm(x)
    y = np.cross(normal, x)
    angle = np.arctan2(side_1[1], side_1[0])
    right = np.cos(angle) * x - np.sin(angle) * y
    frame = np.array([right, np.cross(normal, right), normal])
    return frame, there.mean(axis=0) - board.mean(axis=0) @ frame


def _known(name: str, table: PartTable) -> BoardPart:
    """Return a part; DesignError if there is none of this name, or its position is unknown."""
    if name not in table:
        raise _unknown(name, table)
    part = table[name]
    if isinstance(part, DesignError):
        raise part
    return part


def _unknown(name: str, table: PartTable) -> DesignError:
    return DesignError(
        f"the file has no part '{name}'", hint=suggestion(name, list(table), limit=12)
    )
