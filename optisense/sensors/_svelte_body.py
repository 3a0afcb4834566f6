"""Dark body of GelSight Svelte around its mirrors, open at the skin."""

from __future__ import annotations

from typing import Any

import manifold3d
import numpy as np
import shapely

from optisense.array_types import FloatArray
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.sensors._shapes import ribbon
from optisense.sensors._sources import package
from optisense.sensors._svelte_profile import CurvedMirror, FlatMirror, Palm, Points

LED = "smd-3528"
"""Light of the library beside the gel."""

BEHIND_M2 = 1.0
"""Distance between mirror M2 and the body behind it, mm, an assumption; no light passes there."""

BESIDE_MIRROR = 0.5
"""Distance between the edges of the mirrors and the side walls, mm, an assumption."""


def check_mirrors(
    m1: CurvedMirror, sagitta: float, m2: FlatMirror, gel_outline: FloatArray
) -> None:
    """Raise DesignError if M2 is not clear of the gel's closed outline (n, 2), mm, or M1 of M2 and
    of what the camera sees of it.
    """
    flat, curved = shapely.LineString(m2.ends()), shapely.LineString(m1.curve(sagitta))
    crossed = flat.intersection(shapely.Polygon(gel_outline))
    if not crossed.is_empty:
        raise DesignError(
            f"mirror M2 goes through the gel near {_place(crossed)}",
            where="m2_bottom, m2_tilt, m2_length",
            hint="Make m2_length smaller or tilt M2 more, or let palm_outline begin higher",
        )
    sight = shapely.Polygon([(0.0, 0.0), *m2.ends()])
    crossed = curved.intersection(sight)
    if not crossed.is_empty:
        raise DesignError(
            f"mirror M1 stands between the camera and M2 near {_place(crossed)}",
            where="m1_ends",
            hint="Move the lower end of M1 towards the tip, or towards the back",
        )


def housing(
    palm: Palm,
    back_outline: Points,
    m1: CurvedMirror,
    most: float,
    m2: FlatMirror,
    widths: tuple[float, float],
    led_gap: float,
    wall_thickness: float,
) -> dict[str, TriangleMesh]:
    """Return the walls around everything except the palm: `body`, the back and the base, and
    `side-walls`. They are sheets that absorb light, with inward normals.

    Args:
        most: largest sagitta of M1, mm.
        widths: widths of the gel and of the widest mirror, mm.

    Raises:
        DesignError: the outline crosses itself, or a mirror or the camera is not inside.
    """
    back = np.asarray(back_outline, dtype=np.float64).reshape(-1, 2)
    behind = m2.ends() + BEHIND_M2 * np.array([m2.along[1], -m2.along[0]])
    bottom = np.array([[behind[0, 0], min(back[0, 1], behind[0, 1])]])
    rest = np.concatenate([back, palm.points[-1:]])
    base = np.concatenate([palm.points[:1], behind[::-1], bottom, back[:1]])
    outline = np.concatenate([palm.points, rest[-2::-1], base[-2:0:-1]])
    _check_inside(outline, m1, most, m2)
    half = _half_width(widths, led_gap)
    # The sides stand between back and base, which extend to their outer faces.
    wide = half + wall_thickness
    around = TriangleMesh.joined(
        [ribbon(rest, wide, 1).flipped(), ribbon(base, wide, 1).flipped()]
    ).welded()
    sides = TriangleMesh.joined([_wall(outline, half), _wall(outline, -half).flipped()])
    return {"body": around, "side-walls": sides}


def led_covers(
    palm: Palm, inner: FloatArray, widths: tuple[float, float], led_gap: float
) -> TriangleMesh:
    """Return a channel along each side of the gel, with an inner face (n, 2), mm, that hides the
    LEDs in it from the camera: a sheet that absorbs light, with its normals towards the LEDs.
    """
    gel_half, half = 0.5 * widths[0], _half_width(widths, led_gap)
    channel = np.concatenate([palm.points, inner[::-1], palm.points[:1]])
    side = ribbon(channel, 0.5 * (half - gel_half), 1)
    beside = np.array([0.0, 0.5 * (half + gel_half), 0.0])
    return TriangleMesh.joined(
        [side.with_vertices(side.vertices + beside), side.with_vertices(side.vertices - beside)]
    ).welded()


def _half_width(widths: tuple[float, float], led_gap: float) -> float:
    """Return the distance from the middle of the finger to the inside of its walls, mm, which leave
    room for the LEDs beside the gel.
    """
    return max(0.5 * widths[0] + led_gap + package(LED)[2], 0.5 * widths[1] + BESIDE_MIRROR)


def _check_inside(outline: FloatArray, m1: CurvedMirror, most: float, m2: FlatMirror) -> None:
    polygon = shapely.Polygon(outline)
    if not polygon.is_valid:
        raise DesignError(
            f"the outline of the body crosses itself ({shapely.is_valid_reason(polygon)})",
            where="palm_outline, back_outline",
            hint="Give both from base to tip, the back at smaller x",
        )
    things = {
        "m1_ends, m1_sagitta": ("the flat mirror M1", shapely.LineString(m1.curve(0.0))),
        "clearance": ("the most curved mirror M1", shapely.LineString(m1.curve(most))),
        "m2_bottom, m2_tilt, m2_length": ("mirror M2", shapely.LineString(m2.ends())),
        "back_outline": ("the camera's pupil", shapely.Point(0.0, 0.0)),
    }
    for where, (label, thing) in things.items():
        if not polygon.contains(thing):
            outside = thing.difference(polygon)
            raise DesignError(
                f"{label} is not inside the body near "
                f"{_place(thing if outside.is_empty else outside)}",
                where=where,
                hint="Move it inside, or move back_outline or palm_outline outward",
            )


def _wall(outline: FloatArray, y: float) -> TriangleMesh:
    """Return the area inside of the outline at one y; its normal is -y."""
    turned = outline if shapely.LinearRing(outline).is_ccw else outline[::-1]
    faces = np.asarray(manifold3d.triangulate([turned]))
    return TriangleMesh(
        np.column_stack([turned[:, 0], np.full(len(turned), y), turned[:, 1]]), faces
    )


def _place(shape: Any) -> str:
    x, z = shapely.get_coordinates(shape)[0]
    return f"x {x:.1f}, z {z:.1f} mm"
