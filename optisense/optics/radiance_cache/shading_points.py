"""Visible points, and where each of them reads the radiance cache."""

from __future__ import annotations

from dataclasses import dataclass

import mitsuba as mi

from optisense.optics.scene.bsdf import CoatingBsdf
from optisense.optics.transport.camera_paths import VisiblePoints


@dataclass
class ShadingPoints:
    """Visible points that are to be shaded.

    Attributes:
        seen: the visible points.
        coating: what they are coated with.
        start: mm, where shadow rays from them start.
        cell: the cell where each reads the cache.
        shift: mm, from the point to the place that lies in this cell.
        active: which points count.
        raised: which points lie on an indenter.
    """

    seen: VisiblePoints
    coating: CoatingBsdf
    start: mi.Point3f
    cell: mi.UInt32
    shift: mi.Vector3f
    active: mi.Bool
    raised: mi.Bool
