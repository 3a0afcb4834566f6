"""The ray scenes of one sensor: complete, in part, and with contacts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.design.materials import CoatingModel
from optisense.geometry import Contact, TriangleMesh
from optisense.mechanics import PressedSkin, SkinMesh, SkinState
from optisense.optics.backend.arrays import floats
from optisense.optics.backend.variant import one_scene_per_kernel
from optisense.optics.scene.assembly import Assembly, coating_surface, indenter_piece
from optisense.optics.scene.contact_scenes import ContactScenes, SkinShapes, bounding_ball
from optisense.optics.scene.emitters import EmitterTable, emitter_table
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surface_table import surface_table
from optisense.optics.scene.surfaces import Region, Surface, SurfaceKind, is_coloured

PILOT_COATING = Surface(
    SurfaceKind.OPAQUE, alpha=1.0, reflectance=(0.5,) * 3, region=Region.SENSING
)
"""The coating that pilot photons meet, regardless of the sensor's own: grey and diffuse, neither so
dark that scattered light would be missing nor so bright that it would dominate."""


class FineScene(NamedTuple):
    """A scene in which flat parts of the sensing surface keep their triangles.

    Attributes:
        scene: the ray scene.
        sensing_faces: number (m,) of the triangle of the sensing surface for each triangle of the
            scene, or -1.
    """

    scene: RayScene
    sensing_faces: NDArray[np.int64]


class _Shapes:
    """The ray scenes of an assembly's shapes, each built on first use.

    Their tables of surfaces are those of the first coating. For another coating, a scene is given
    another table (`RayScene.with_table`), which copies no shape.
    """

    def __init__(self, assembly: Assembly, table: mi.Float, before: _Shapes | None) -> None:
        self._pieces, self._table = assembly.pieces, table
        self.fine_pieces = [assembly.fine.get(i, p) for i, p in enumerate(assembly.pieces)]
        numbers = [i for i, p in enumerate(self._pieces) if p.surface.kind is SurfaceKind.OPAQUE]
        self.opaque = [self._pieces[i] for i in numbers]
        self._opaque_numbers = numbers
        same = (
            before is not None
            and before._opaque_numbers == numbers
            and all(a is b for a, b in zip(before.opaque, self.opaque, strict=True))
        )
        # Scenes of unchanged shapes are passed on from sensor to sensor.
        self.fixed: Callable[[], RayScene]
        self.indenters: Callable[[int, tuple[TriangleMesh, ...]], RayScene]
        self.skin: Callable[[SkinMesh, PressedSkin, tuple[tuple[int, Surface], ...]], SkinShapes]
        if before is not None and same:
            self.fixed = before.fixed
        else:
            opaque = self.opaque
            self.fixed = lru_cache(maxsize=1)(lambda: RayScene(opaque, numbers, table))
        if before is None:
            self.indenters = lru_cache(maxsize=1)(_indenters)
            self.skin = lru_cache(maxsize=1)(SkinShapes.of)
        else:
            self.indenters, self.skin = before.indenters, before.skin

    @cached_property
    def full(self) -> RayScene:
        return RayScene(self._pieces, table=self._table)

    @cached_property
    def robust(self) -> RayScene:
        return RayScene(self._pieces, table=self._table, robust=True)

    @cached_property
    def fine(self) -> FineScene:
        pieces = self.fine_pieces
        sensed = [np.full(len(p.faces), p.surface.region is Region.SENSING) for p in pieces]
        sensing = np.concatenate(sensed)
        faces = np.where(sensing, np.cumsum(sensing) - 1, -1)
        return FineScene(RayScene(pieces, table=self._table, robust=True), faces)


class SensorScenes:
    """A sensor's surfaces and lights, prepared for ray tracing.

    An object never changes: a sensor with another coating is another object (`coated`), which
    shares the shapes.

    Attributes:
        assembly: the surfaces, lights and media.
        surfaces: the surfaces of the assembly's pieces, then the coating where indenters touch it,
            and the coating where it is bent beside them.
        table: the table of these surfaces, on the device.
        coloured: whether any of the surfaces is coloured.
        roughness: GGX alpha of the sharpest metallic lobe; None without metal.
    """

    _shapes: _Shapes

    def __init__(
        self, assembly: Assembly, coating: CoatingModel, before: SensorScenes | None = None
    ) -> None:
        """Prepare the scenes; each is built on first use.

        Args:
            coating: the coating of its sensing surface.
            before: the scenes of a similar design; those of unchanged shapes are reused.
        """
        self.assembly = assembly
        self.surfaces = [
            coating_surface(coating, assembly.ior_before, Region.SENSING)
            if piece.surface.region is Region.SENSING
            else piece.surface
            for piece in assembly.pieces
        ]
        self.surfaces += [
            coating_surface(coating, assembly.ior_before, region)
            for region in (Region.INDENTER, Region.BENT)
        ]
        self.table = surface_table(self.surfaces)
        self.coloured = any(is_coloured(surface) for surface in self.surfaces)
        metallic = [
            surface.alpha
            for surface in self.surfaces
            if surface.kind is SurfaceKind.OPAQUE and surface.specularity > 0
        ]
        self.roughness = min(metallic, default=None)
        known = None if before is None else before._shapes
        same = before is not None and before.assembly is assembly
        self._shapes = known if known and same else _Shapes(assembly, self.table, known)

    def coated(self, coating: CoatingModel) -> SensorScenes:
        """Return the same sensor with another coating."""
        return SensorScenes(self.assembly, coating, self)

    @property
    def pieces(self) -> list[Piece]:
        """All fixed surfaces; flat faces are merged into few triangles."""
        return self.assembly.pieces

    @property
    def opaque(self) -> list[Piece]:
        """The opaque pieces."""
        return self._shapes.opaque

    @cached_property
    def full(self) -> RayScene:
        """All surfaces of the sensor without contacts."""
        return self._shapes.full.with_table(self.table)

    @cached_property
    def robust(self) -> RayScene:
        """All surfaces of the sensor without contacts, in a robust scene for camera rays.

        A camera ray that passes between two triangles gives a black pixel. For photons the effect
        is one in millions, and a robust scene would take a third longer.
        """
        return self._shapes.robust.with_table(self.table)

    @cached_property
    def fixed(self) -> RayScene:
        """The opaque surfaces."""
        return self._shapes.fixed().with_table(self.table)

    @cached_property
    def fine(self) -> FineScene:
        """The sensor with every triangle of its sensing surface."""
        fine = self._shapes.fine
        return fine._replace(scene=fine.scene.with_table(self.table))

    @cached_property
    def pilot(self) -> RayScene:
        """The sensor with `PILOT_COATING`."""
        return self.full.with_table(surface_table(self._pilot_surfaces))

    @cached_property
    def pilot_coloured(self) -> bool:
        """Whether the sensor with `PILOT_COATING` is coloured."""
        return any(is_coloured(surface) for surface in self._pilot_surfaces)

    @property
    def _pilot_surfaces(self) -> list[Surface]:
        return [
            surface if surface.region is Region.OTHER else PILOT_COATING
            for surface in self.surfaces
        ]

    @cached_property
    def emitter_table(self) -> EmitterTable:
        """The lights, on the device."""
        return emitter_table(self.assembly.emitters, len(self.assembly.groups))

    @cached_property
    def lamp_windows(self) -> LampWindows:
        """The emitting faces of the lights."""
        return LampWindows.of(self.assembly.emitters)

    def with_indenters(self, placed: Sequence[TriangleMesh]) -> RayScene:
        """Return the sensor with every triangle of its sensing surface, and coated indenters.

        Args:
            placed: meshes of the indenters in the design's frame, mm.
        """
        return self._with_indenters(self._shapes.fine_pieces, placed)

    def _with_indenters(self, pieces: list[Piece], placed: Sequence[TriangleMesh]) -> RayScene:
        """Return the sensor with coated indenters; rays see the surface that they meet first."""
        count = len(pieces)
        added = [indenter_piece(mesh, self.surfaces[count]) for mesh in placed]
        numbers = [*range(count), *[count] * len(added)]
        return RayScene([*pieces, *added], numbers, self.table, robust=True)

    def touched(self, contacts: Sequence[Contact], placed: Sequence[TriangleMesh]) -> ContactScenes:
        """Return the scenes of an image in which the skin takes the shape of the indenters.

        Args:
            contacts: the contacts; none for the untouched sensor.
            placed: meshes of the indenters in the design's frame, mm.
        """
        if not contacts:
            return _for_renderer(ContactScenes(self.robust, self.fixed, None, mi.Float()))
        balls = np.stack([bounding_ball(mesh.vertices) for mesh in placed])
        indenters = self._shapes.indenters(len(self.pieces), tuple(placed))
        return _for_renderer(
            ContactScenes(
                self._with_indenters(self.pieces, placed),
                self.fixed,
                indenters.with_table(self.table),
                floats(balls),
                all(getattr(contact.indenter, "convex", False) for contact in contacts),
                self._absorption(),
            )
        )

    def deformed(
        self, mesh: SkinMesh, pressed: PressedSkin, fixed: RayScene | None = None
    ) -> ContactScenes:
        """Return the scenes of an image with a deformed skin in place of the sensing surface.

        Args:
            fixed: the scene in which rays are traced behind the deformed skin; that of the opaque
                surfaces if None.
        """
        count = len(self.pieces)
        others = [i for i, p in enumerate(self.pieces) if p.surface.region is not Region.SENSING]
        sensing = next(i for i in range(count) if i not in others)
        number = {
            SkinState.RESTING: sensing,
            SkinState.TOUCHING: count,
            SkinState.BENT: count + 1,
        }
        surfaces = tuple((number[state], self.surfaces[number[state]]) for state in SkinState)
        skin = self._shapes.skin(mesh, pressed, surfaces)
        pieces = [*(self.pieces[i] for i in others), *skin.pieces]
        return _for_renderer(
            ContactScenes(
                RayScene(pieces, [*others, *skin.numbers], self.table, robust=True),
                fixed or self.fixed,
                None if skin.raised is None else skin.raised.with_table(self.table),
                skin.balls,
                absorption=self._absorption(),
            )
        )

    def _absorption(self) -> mi.Color3f | None:
        """Absorption (1/mm, per channel) of the gel before the sensing surface; None if clear."""
        absorption = self.assembly.absorption_before
        return dr.opaque(mi.Color3f, absorption) if max(absorption) > 0.0 else None


def _for_renderer(scenes: ContactScenes) -> ContactScenes:
    """Return the scenes of an image as the current variant needs them."""
    return scenes.in_one_scene() if one_scene_per_kernel() else scenes


def _indenters(number: int, placed: tuple[TriangleMesh, ...]) -> RayScene:
    """Return the scene of indenters alone, whose coating has a number in the surfaces' table."""
    pieces = [indenter_piece(mesh, PILOT_COATING) for mesh in placed]
    return RayScene(pieces, [number] * len(pieces))
