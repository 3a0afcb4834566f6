"""A sensor design made ready for rays: media, scenes, chief rays, places of contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.design import SensorDesign, set_value
from optisense.design.lens_checks import fold_problems
from optisense.design.problems import raise_problems
from optisense.design.responses import PictureChain
from optisense.design.sensor_design import refuse_no_design
from optisense.errors import OptiSenseError, RenderError
from optisense.geometry import (
    Contact,
    Indenter,
    SensingSurface,
    Sphere,
    TriangleMesh,
    nine_places,
)
from optisense.geometry.contact import place_on_gels
from optisense.geometry.indenter_kinds import FACET_ERROR
from optisense.mechanics import ELASTIC, Gel, PressedSkin, elasticity_of
from optisense.optics.backend.interrupts import lets_ctrl_c_through
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.assembly import Assembly, assemble, coating_surface
from optisense.optics.scene.bsdf import surface_table
from optisense.optics.scene.contact_scenes import (
    ContactScenes,
    SensorPieces,
    bounding_ball,
)
from optisense.optics.scene.emitters import EmitterTable, emitter_table
from optisense.optics.scene.fine_scene import FineScene, fine_scene
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Region, Surface, SurfaceKind, is_coloured
from optisense.optics.transport.apparent_distance import focused_chain
from optisense.optics.transport.chief_rays import (
    MIRROR_BITS,
    ChiefRays,
    pixel_areas,
    sees_nothing,
    shares_by_mirrors,
    trace_chief_rays,
)

if TYPE_CHECKING:
    from optisense.optics.transport.ray_gradient import DifferentiableRays


class RayModel:
    """A sensor that rays can be sent through, whatever its lights give.

    What is made once is kept: the resolved media, the scenes, the surface tables. A changed
    design redoes only what depends on the change.
    """

    facet_error = FACET_ERROR
    """mm, how far indenters' meshes may be off their exact shapes."""
    bends_media = False
    """Whether boundaries between media go along with parts that bend (`Media.bend`)."""

    def __init__(self, design: SensorDesign, variant: str = "auto") -> None:
        """Resolve media and build the scene.

        Args:
            design: the sensor; not changed, and later changes of it are not seen (see
                ``update``). variant: "auto" (what was selected before, else CUDA where there is
                a GPU), "llvm" or "cuda".

        Raises:
            SetupError: the variant is not to be had on this machine.
            DesignError, MeshError, LibraryError: the design can't be built.
        """
        from optisense.optics.backend.variant import use_variant

        refuse_no_design(design)
        self.variant = use_variant(variant)
        self.design = design.copy()
        self._assemble()

    def _assemble(self, before: Assembly | None = None) -> None:
        self._parts = assemble(self.design, before, self.bends_media)
        self._surfaces = [piece.surface for piece in self._parts.pieces]
        self._surfaces += self._pressed_surfaces()
        self._refresh_surfaces()
        self._forget(
            "surface", "_gel", "scene", "_watched", "_fixed", "_fine", "_emitter_table", "_store"
        )
        self._forget("picture_chain")

    @property
    def groups(self) -> list[str]:
        """The names of the light groups, in the order of layers."""
        return self._parts.groups

    @property
    def sensing(self) -> TriangleMesh:
        """The sensing surface in its current shape, with all its triangles."""
        return self._parts.sensing

    @property
    def gels(self) -> list[TriangleMesh]:
        """The elastomers in their current shape."""
        return self._parts.gels

    @property
    def _pieces(self) -> list[Piece]:
        return self._parts.pieces

    @cached_property
    def scene(self) -> RayScene:
        """All that light meets in the sensor, nothing pressed in."""
        return RayScene(self._pieces, table=self._table)

    @cached_property
    def _watched(self) -> RayScene:
        """The same for the camera: a ray that slips through is a black pixel, while of photons it
        is one in millions, and they take a third longer where none does."""
        return RayScene(self._pieces, table=self._table, robust=True)

    @cached_property
    def _fixed(self) -> RayScene:
        opaque = [i for i, p in enumerate(self._pieces) if p.surface.kind is SurfaceKind.OPAQUE]
        return RayScene([self._pieces[i] for i in opaque], opaque, self._table)

    @cached_property
    def _fine(self) -> FineScene:
        fine = self._parts.fine
        return fine_scene([fine.get(i, p) for i, p in enumerate(self._pieces)], self._table)

    @cached_property
    def _emitter_table(self) -> EmitterTable:
        return emitter_table(self._parts.emitters, len(self.groups))

    def _forget(self, *names: str) -> None:
        """Drop cached properties; they are made again when they are needed."""
        for name in names:
            self.__dict__.pop(name, None)

    def _pressed_surfaces(self) -> list[Surface]:
        """The coating where indenters touch it, and where it is bent beside them."""
        return [
            coating_surface(self.design.coating, self._parts.ior_before, region)
            for region in (Region.INDENTER, Region.BENT)
        ]

    def _refresh_surfaces(self) -> None:
        self._table = surface_table(self._surfaces)
        self._coloured = any(is_coloured(surface) for surface in self._surfaces)
        metallic = [
            surface.alpha
            for surface in self._surfaces
            if surface.kind is SurfaceKind.OPAQUE and surface.specularity > 0
        ]
        self._roughness = min(metallic, default=None)

    def update(self, path: str, value: Any) -> None:
        """Change one value of the design by its dotted path, redoing only what depends on it.

        Raises:
            DesignError: there is no such value, or it does not fit.
        """
        self.set_design(set_value(self.design, path, value))

    def set_design(self, design: SensorDesign) -> None:
        """Take on another design, redoing only what depends on the values that differ.

        Fluxes and colours cost nothing, a coating or a camera little; a mirror or blocker that
        touches no transparent part is bent or moved without resolving the media again. A design
        that can't be built leaves the model as it was.

        Args:
            design: most useful when it is like the one before and shares its meshes.

        Raises:
            DesignError, MeshError, LibraryError: the design can't be built.
        """
        old = self.design
        self.design = design.copy()
        if _shapes(old) != _shapes(design) or old.meshes != design.meshes:
            try:
                self._assemble(self._parts)
            except OptiSenseError:
                self.design = old
                raise
            return
        if old.coating != design.coating:
            self._recoat()
        if old.camera != design.camera:
            self._forget("picture_chain")
        if old.camera.view() != design.camera.view():
            self._forget("surface", "_gel", "_store")

    def _recoat(self) -> None:
        coat = coating_surface(self.design.coating, self._parts.ior_before, Region.SENSING)
        self._surfaces = [
            coat if surface.region is Region.SENSING else surface
            for surface in self._surfaces[: len(self._pieces)]
        ] + self._pressed_surfaces()
        self._refresh_surfaces()
        for name in ("scene", "_watched", "_fixed"):
            if name in self.__dict__:
                self.__dict__[name].table = self._table
        self._forget("_fine")

    def camera(self, resolution: tuple[int, int] | None = None) -> RayCamera:
        """The design's camera, at another resolution (width, height) if asked."""
        camera = self.design.camera
        width, height = camera.resolution if resolution is None else resolution
        if width < 1 or height < 1:
            raise RenderError(f"the resolution is {width}x{height}", hint="give e.g. 320x240")
        raise_problems(fold_problems(camera, self.design.where("camera", "distortion")), "camera")
        return RayCamera(
            position=camera.position,
            direction=camera.direction,
            up=camera.up,
            fov=camera.fov,
            width=int(width),
            height=int(height),
            equidistant=camera.projection == "equidistant",
            distortion=camera.distortion,
        )

    @cached_property
    def picture_chain(self) -> PictureChain:
        """What the camera makes of radiance; where its blur depends on depth, with the depths that
        it sees in the untouched sensor."""
        return focused_chain(self.design.camera, lambda: self._fine.scene, self.camera)

    @cached_property
    def surface(self) -> SensingSurface:
        """The sensing surface with coordinates in mm.

        (0, 0) is where the camera's axis meets it (or the middle of what is seen), u runs
        towards the right and v towards the top of the image.
        """
        axes = self.design.camera.axes()
        # Of a lens without distortion, which may show its axis beside the picture's middle.
        straight = replace(self.camera((3, 3)), distortion=None)
        rays = trace_chief_rays(self._fine.scene, straight)
        if rays.hit[1, 1]:
            origin = rays.points[1, 1].astype(float)
        else:
            fine = self.chief_rays((64, 48))
            if not fine.hit.any():
                raise sees_nothing(fine)
            origin = np.median(fine.points[fine.hit].astype(float), axis=0)
        return SensingSurface(self.sensing, origin, axes[0], axes[1])

    @lets_ctrl_c_through
    def chief_rays(
        self,
        resolution: tuple[int, int] | None = None,
        contacts: Sequence[Contact] = (),
        skin: str = ELASTIC,
    ) -> ChiefRays:
        """Where each pixel looks, by ideal refraction and reflection; (h, w, ...) arrays.

        Args:
            resolution: (width, height) pixels; the camera's own by default.
            contacts: what presses in.
            skin: "conforming" or "elastic", as in `OpticalModel.render`. On an elastic skin
                triangles have no numbers.
        """
        camera = self.camera(resolution)
        if not contacts:
            return trace_chief_rays(self._fine.scene, camera, self._fine.sensing_faces)
        if skin == ELASTIC:
            return trace_chief_rays(self._elastic_scenes(contacts).full, camera)
        placed = [self.place(contact) for contact in contacts]
        scene = self._sensor_pieces(fine=True).with_indenters(placed, robust=True)
        return trace_chief_rays(scene, camera, self._fine.sensing_faces)

    def views_by_mirrors(self, resolution: tuple[int, int]) -> dict[frozenset[str], float]:
        """Share of the view that the camera has by each set of mirrors.

        Args:
            resolution: (width, height) of the chief rays.

        Returns:
            For each set of parts that reflect a ray on its way to the sensing surface, its share
            of the rays that arrive there; the empty set stands for those that no mirror reflects.
        """
        rays = self.chief_rays(resolution)
        mirrors = [
            (1 << number % MIRROR_BITS, piece.name)
            for number, piece in enumerate(self._pieces)
            if piece.surface.kind is SurfaceKind.MIRROR
        ]
        return shares_by_mirrors(rays, mirrors)

    def differentiable_rays(
        self,
        moving: Sequence[str] = (),
        resolution: tuple[int, int] | None = None,
    ) -> DifferentiableRays:
        """Chief rays, with derivatives by the shapes of surfaces and by the camera.

        Args:
            moving: parts whose vertices are asked about: mirrors, blockers, sensing surfaces.
            resolution: (width, height) pixels; the camera's own by default.

        Raises:
            RenderError: no ray arrives, or a moving part is no such surface.
        """
        from optisense.optics.transport.ray_gradient import DifferentiableRays

        meshes = self.design.deformed_meshes()
        chosen = {name: meshes[name] for name in moving}
        return DifferentiableRays(self._fine.scene, self.camera(resolution), chosen)

    def nine_contacts(self, indenter: Indenter | None = None, depth: float = 0.8) -> list[Contact]:
        """One contact at each of nine places that cover the visible sensing surface evenly.

        The default indenter is the OptiSense paper's ball of radius 1.5 mm.
        """
        rays = self.chief_rays((96, 72))
        if rays.hit.sum() < 9:
            raise sees_nothing(rays)
        points = rays.points[rays.hit].astype(np.float64)
        # Each pixel stands for the area that its solid angle cuts out of the surface.
        weights = pixel_areas(rays)[rays.hit]
        chosen = nine_places(points, weights)
        ball = indenter if indenter is not None else Sphere(radius=1.5)
        return [
            Contact(ball, point=(float(p[0]), float(p[1]), float(p[2])), depth=depth)
            for p in points[chosen]
        ]

    def place(self, contact: Contact) -> TriangleMesh:
        """The part of an indenter that can touch, where a contact puts it in the design's frame.

        Raises:
            ContactError: the contact is off the surface or deeper than the gel, or no depth takes
                its force.
        """
        contact = self._gel.at_depth(contact)
        return place_on_gels(contact, self.surface, self.gels, self.facet_error)

    @cached_property
    def _gel(self) -> Gel:
        elasticity = elasticity_of(self.design)
        return Gel(self.surface, self.sensing, self.gels, elasticity, self.place)

    def pressed(
        self, contacts: Sequence[Contact], placed: Sequence[TriangleMesh] | None = None
    ) -> PressedSkin:
        """The elastic skin with contacts pressed in: its shape, pressures and forces.

        Args:
            contacts: what presses where.
            placed: their meshes as `place` gives them, if they are known.

        Raises:
            ContactError: a contact is off the surface or deeper than the gel, or its pressure is
                not found.
        """
        return self._gel.pressed(contacts, placed)

    def _scenes(self, contacts: Sequence[Contact], placed: list[TriangleMesh]) -> ContactScenes:
        """The scenes of one image; `placed` are the contacts' meshes."""
        if not contacts:
            return ContactScenes(self._watched, self._fixed, None, mi.Float())
        balls = np.stack([bounding_ball(mesh.vertices) for mesh in placed])
        return ContactScenes(
            self._sensor_pieces().with_indenters(placed, robust=True),
            self._fixed,
            self._indenters(placed),
            mi.Float(balls.ravel().astype(np.float32)),
            all(getattr(contact.indenter, "convex", False) for contact in contacts),
            self._gel_absorption(),
        )

    def _elastic_scenes(
        self, contacts: Sequence[Contact], placed: list[TriangleMesh] | None = None
    ) -> ContactScenes:
        pressed = self._gel.pressed(contacts, placed)
        mesh = self._gel.mesh(contacts)
        return self._sensor_pieces().with_skin(mesh, pressed, self._fixed, self._gel_absorption())

    def _gel_absorption(self) -> mi.Color3f | None:
        absorption = self._parts.absorption_before
        return dr.opaque(mi.Color3f, absorption) if max(absorption) > 0.0 else None

    def _indenters(self, placed: list[TriangleMesh]) -> RayScene:
        """Indenters alone."""
        return self._sensor_pieces().indenters(placed)

    def _sensor_pieces(self, fine: bool = False) -> SensorPieces:
        """The sensor's pieces; ``fine``: with every triangle of its sensing surface."""
        pieces = self._fine.pieces if fine else self._pieces
        return SensorPieces(pieces, self._surfaces, self._table)


def _shapes(design: SensorDesign) -> tuple[Any, ...]:
    """What of a design its geometry and its lights' places depend on."""
    lights = {
        name: (group.model, group.emitter, group.lights) for name, group in design.lights.items()
    }
    return design.parts, design.materials, design.cages, design.dispersion, lights
