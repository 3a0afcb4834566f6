"""The ray scenes of one image: the sensor with its contacts, and parts of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.mechanics import PressedSkin, SkinMesh, SkinState
from optisense.optics.backend.arrays import floats
from optisense.optics.scene.ray_scene import Piece, RayScene, share_scene
from optisense.optics.scene.surfaces import Surface


@dataclass
class ContactScenes:
    """Ray scenes of one image.

    Attributes:
        full: all surfaces, including indenters or the deformed skin.
        fixed: the opaque surfaces without indenters.
        indenters: the indenters alone, or the part of the skin that they bend; None without
            contacts.
        balls: a bounding ball around each indenter; centre (3) and radius, four floats (mm) each.
        convex: whether each indenter is convex and therefore cannot shadow itself.
        absorption: absorption coefficient (1/mm, per channel) of the gel in front of the sensing
            surface; None if it is clear.
    """

    full: RayScene
    fixed: RayScene
    indenters: RayScene | None
    balls: mi.Float
    convex: bool = False
    absorption: mi.Color3f | None = None

    def in_one_scene(self) -> ContactScenes:
        """Return the scenes with their meshes in one of Mitsuba's, for OptiX (`share_scene`)."""
        apart = [self.full, self.fixed, *([] if self.indenters is None else [self.indenters])]
        full, fixed, *indenters = share_scene(apart)
        return replace(self, full=full, fixed=fixed, indenters=next(iter(indenters), None))


@dataclass(frozen=True)
class SkinShapes:
    """A deformed skin prepared for ray tracing, independent of the other parts of the sensor.

    Attributes:
        pieces: its pieces, one for each state that occurs.
        numbers: the numbers of their surfaces.
        raised: the scene of the pieces that are touched or bent; None if there are none. It has no
            table of its own.
        balls: a bounding ball around each contact, as in `ContactScenes`.
    """

    pieces: list[Piece]
    numbers: list[int]
    raised: RayScene | None
    balls: mi.Float

    @classmethod
    def of(
        cls, mesh: SkinMesh, pressed: PressedSkin, surfaces: tuple[tuple[int, Surface], ...]
    ) -> SkinShapes:
        """Prepare a skin.

        Args:
            surfaces: number and surface for each state.
        """
        skin = {}
        for state, (_, surface) in zip(SkinState, surfaces, strict=True):
            part = mesh.part(state)
            if part is not None:
                skin[state] = Piece("skin", part.vertices, part.faces, surface, part.normals)
        numbers = {state: surfaces[state][0] for state in skin}
        raised = [state for state in skin if state is not SkinState.RESTING]
        balls = _balls(mesh, pressed)
        return cls(
            list(skin.values()),
            list(numbers.values()),
            RayScene([skin[s] for s in raised], [numbers[s] for s in raised]) if raised else None,
            floats(balls),
        )


def bounding_ball(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the centre and radius (4,), mm, of a ball around points (n, 3)."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())


def _balls(mesh: SkinMesh, pressed: PressedSkin) -> NDArray[np.float64]:
    """Return a ball for each contact around the raised skin that is nearest to it."""
    raised = np.zeros(len(mesh.vertices), dtype=bool)
    raised[mesh.faces[mesh.state != SkinState.RESTING]] = True
    if not raised.any():
        return np.zeros((0, 4))
    points = mesh.vertices[raised]
    middles = np.stack([contact.place.origin for contact in pressed.contacts])
    # The squared distances, without the square of each point, which all middles share.
    nearest = ((middles**2).sum(axis=1) - 2.0 * points @ middles.T).argmin(axis=1)
    return np.stack([bounding_ball(points[nearest == k]) for k in np.unique(nearest)])
