"""The ray scenes of one image: the sensor with its contacts, and parts of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh
from optisense.mechanics import PressedSkin, SkinMesh, SkinState
from optisense.optics.backend.arrays import floats
from optisense.optics.scene.assembly import indenter_piece
from optisense.optics.scene.ray_scene import Piece, RayScene, share_scene
from optisense.optics.scene.surfaces import Region, Surface


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
        """Return the same ray scenes with their meshes in a single scene of Mitsuba, as OptiX needs
        (`share_scene`).
        """
        apart = [self.full, self.fixed, *([] if self.indenters is None else [self.indenters])]
        full, fixed, *indenters = share_scene(apart)
        return replace(self, full=full, fixed=fixed, indenters=next(iter(indenters), None))


@dataclass(frozen=True)
class SensorPieces:
    """The pieces of a sensor, to which contacts are added.

    Attributes:
        pieces: the pieces of the sensor without contacts.
        surfaces: the surfaces of the pieces, then the coating where indenters touch it, and the
            coating where it is bent beside them.
        table: the table of these surfaces.
    """

    pieces: list[Piece]
    surfaces: list[Surface]
    table: mi.Float

    def with_indenters(self, placed: Sequence[TriangleMesh]) -> RayScene:
        """Return the sensor with coated indenters; rays see the surface that they meet first."""
        count = len(self.pieces)
        pieces = [indenter_piece(mesh, self.surfaces[count]) for mesh in placed]
        numbers = [*range(count), *[count] * len(pieces)]
        return RayScene([*self.pieces, *pieces], numbers, self.table, robust=True)

    def with_skin(
        self, skin: SkinShapes, fixed: RayScene, absorption: mi.Color3f | None
    ) -> ContactScenes:
        """Return the sensor with a deformed skin in place of its sensing surface.

        Args:
            fixed: the opaque surfaces without contacts.
            absorption: absorption coefficient of the gel, as in `ContactScenes`.
        """
        others = [i for i, p in enumerate(self.pieces) if p.surface.region is not Region.SENSING]
        return ContactScenes(
            RayScene(
                [*(self.pieces[i] for i in others), *skin.pieces],
                [*others, *skin.numbers],
                self.table,
                robust=True,
            ),
            fixed,
            None if skin.raised is None else skin.raised.with_table(self.table),
            skin.balls,
            absorption=absorption,
        )

    @property
    def skin_surfaces(self) -> tuple[tuple[int, Surface], ...]:
        """Return, for each `SkinState`, the number and the surface of a deformed skin."""
        count = len(self.pieces)
        sensing = next(i for i, p in enumerate(self.pieces) if p.surface.region is Region.SENSING)
        numbers = {
            SkinState.RESTING: sensing,
            SkinState.BENT: count + 1,
            SkinState.TOUCHING: count,
        }
        return tuple((numbers[state], self.surfaces[numbers[state]]) for state in SkinState)


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
            surfaces: number and surface for each state (`SensorPieces.skin_surfaces`).
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
