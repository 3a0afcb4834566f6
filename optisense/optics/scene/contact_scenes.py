"""The ray scenes of one image: the sensor with its contacts, and parts of it."""

from __future__ import annotations

from dataclasses import dataclass

import mitsuba as mi

from optisense.optics.scene.ray_scene import RayScene


@dataclass
class ContactScenes:
    """Ray scenes of one image.

    Attributes:
        full: everything, indenters included.
        fixed: the opaque surfaces without indenters.
        indenters: the indenters alone; None without contacts.
        balls: a bounding ball around each indenter; centre (3) and radius, four floats (mm) each.
        convex: whether every indenter is convex, so that none can shadow itself.
        absorption: coefficient of the gel before the sensing surface, per mm and channel; None
            where it is clear.
    """

    full: RayScene
    fixed: RayScene
    indenters: RayScene | None
    balls: mi.Float
    convex: bool = False
    absorption: mi.Color3f | None = None
