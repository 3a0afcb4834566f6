"""The ray scenes of one image: the sensor with its contacts, and parts of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh
from optisense.mechanics import PressedSkin, SkinMesh, SkinState
from optisense.optics.scene.assembly import indenter_piece
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Region, Surface


@dataclass
class ContactScenes:
    """Ray scenes of one image.

    Attributes:
        full: everything, indenters or the deformed skin included.
        fixed: the opaque surfaces without indenters.
        indenters: the indenters alone, or the skin that they bend; None without contacts.
        balls: a bounding ball around each of them; centre (3) and radius, four floats (mm) each.
        convex: whether each of them is convex, so that none can shadow itself.
        absorption: coefficient of the gel before the sensing surface, per mm and channel; None
            where it is clear.
    """

    full: RayScene
    fixed: RayScene
    indenters: RayScene | None
    balls: mi.Float
    convex: bool = False
    absorption: mi.Color3f | None = None


@dataclass(frozen=True)
class SensorPieces:
    """The pieces of a sensor, to which contacts are added.

    Attributes:
        pieces: nothing pressed in.
        surfaces: those of the pieces, then the coating where indenters touch it, and where it is
            bent beside them.
        table: of these surfaces.
    """

    pieces: list[Piece]
    surfaces: list[Surface]
    table: mi.Float

    def with_indenters(self, placed: Sequence[TriangleMesh]) -> RayScene:
        """The sensor and coated indenters; the surface that a ray meets first is the one seen."""
        count = len(self.pieces)
        pieces = [indenter_piece(mesh, self.surfaces[count]) for mesh in placed]
        numbers = [*range(count), *[count] * len(pieces)]
        return RayScene([*self.pieces, *pieces], numbers, self.table, robust=True)

    def with_skin(
        self, skin: SkinShapes, fixed: RayScene, absorption: mi.Color3f | None
    ) -> ContactScenes:
        """The sensor with a deformed skin in the place of its sensing surface.

        Args:
            skin: the deformed skin.
            fixed: the opaque surfaces with nothing pressed in.
            absorption: of the gel, as in `ContactScenes`.
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
        """The surface of a deformed skin, and its number, in each `SkinState`."""
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
    """A deformed skin, made ready for ray tracing. It depends on no other part of the sensor.

    Attributes:
        pieces: its parts, one for each state that there is.
        numbers: their surfaces' numbers.
        raised: the parts that are touched or bent; None without any. It has no table of its own.
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
            mesh: the deformed skin.
            pressed: what deforms it.
            surfaces: those of each state (`SensorPieces.skin_surfaces`).
        """
        skin = {}
        for state, (_, surface) in zip(SkinState, surfaces, strict=True):
            part = mesh.part(state)
            if part is not None:
                skin[state] = Piece("skin", part.vertices, part.faces, surface, part.normals)
        numbers = {state: surfaces[state][0] for state in skin}
        raised = [state for state in skin if state is not SkinState.RESTING]
        balls = _balls(mesh.part(SkinState.TOUCHING, SkinState.BENT), pressed)
        return cls(
            list(skin.values()),
            list(numbers.values()),
            RayScene([skin[s] for s in raised], [numbers[s] for s in raised]) if raised else None,
            mi.Float(balls.ravel().astype(np.float32)),
        )


def bounding_ball(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """(4,) centre and radius of a ball around points (n, 3)."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())


def _balls(raised: TriangleMesh | None, pressed: PressedSkin) -> NDArray[np.float64]:
    """A ball around the raised skin that is nearest to each contact."""
    if raised is None:
        return np.zeros((0, 4))
    points = raised.vertices
    middles = np.stack([contact.place.origin for contact in pressed.contacts])
    away = np.linalg.norm(points[:, None] - middles, axis=2)
    nearest = away.argmin(axis=1)
    return np.stack([bounding_ball(points[nearest == k]) for k in np.unique(nearest)])
