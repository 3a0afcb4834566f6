"""A design prepared for ray tracing, without its light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from optisense.design import SensorDesign, set_value
from optisense.design.problems import kind_problems, raise_problems
from optisense.design.responses import PictureChain
from optisense.design.sensor_design import refuse_no_design
from optisense.geometry import Contact, Indenter, SensingSurface, TriangleMesh
from optisense.geometry.contact import refuse_no_contacts
from optisense.mechanics import ELASTIC, PressedSkin
from optisense.optics._skin_view import SkinView, ray_camera
from optisense.optics.backend.interrupts import reraise_interrupts
from optisense.optics.backend.memory import keep_freed_memory
from optisense.optics.camera.projection import RayCamera, refuse_numpy
from optisense.optics.scene.assembly import Assembly, assemble
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.scene.sensor_scenes import SensorScenes
from optisense.optics.scene.surfaces import SurfaceKind
from optisense.optics.transport.apparent_distance import focused_chain
from optisense.optics.transport.chief_rays import (
    MIRROR_BITS,
    ChiefRays,
    shares_by_mirrors,
    trace_chief_rays,
)

if TYPE_CHECKING:
    from optisense.optics.transport.ray_gradient import DifferentiableRays

MOST_RECENT = 4
"""Number of designs whose assemblies are kept for further models. They take a few MB each."""
_recent: dict[str, Assembly] = {}
"""The assemblies of the latest models, by the names of their designs. Another model of such a
design, or of a similar one of that name, takes over the shapes that have the same meshes."""


class RayModel:
    """A sensor prepared for ray tracing, without its light.

    The scenes of a design and the camera's view of them never change; another design replaces those
    that depend on the values that differ.
    """

    bends_media = False
    """Whether boundaries between media are moved along with parts that bend (`Media.bend`)."""
    view_type: type[SkinView] = SkinView
    """The class of the camera's view of a shape."""

    def __init__(
        self, design: SensorDesign, variant: str = "auto", before: RayModel | None = None
    ) -> None:
        """Resolve media and build the scene.

        Args:
            design: the sensor. It is not modified, and later changes of it have no effect (see
                ``update``).
            variant: "auto" (the variant selected before, else CUDA if there is a GPU), "llvm" or
                "cuda".
            before: a model of the same or a similar design, whose media and shapes are reused.

        Raises:
            SetupError: the variant is not available on this machine.
            DesignError, MeshError, LibraryError: the design can't be built.
        """
        from optisense.optics.backend.variant import use_variant

        refuse_no_design(design)
        self.variant = use_variant(variant)
        keep_freed_memory()
        self._design = design.copy()
        _refuse_impossible_kinds(self._design, None if before is None else before._design)
        known = None if before is None else before.scenes
        assembly = self._assembled(None if known is None else known.assembly)
        self.scenes: SensorScenes = SensorScenes(assembly, self._design.coating, known)
        self._view = self.view_type(self._design, self.scenes)
        self._chain: PictureChain | None = None

    def _assembled(self, before: Assembly | None) -> Assembly:
        """Return the assembly of the design, with unchanged shapes of the one before."""
        if self.bends_media:  # its shapes are approximate
            return assemble(self._design, before, True)
        name = self._design.name
        assembly = assemble(self._design, _recent.pop(name, None) if before is None else before)
        _recent[name] = assembly
        while len(_recent) > MOST_RECENT:
            del _recent[next(iter(_recent))]
        return assembly

    def _set(self, design: SensorDesign, scenes: SensorScenes, view: SkinView) -> None:
        """Adopt a design with its scenes and its view."""
        if view is not self._view or design.camera != self._design.camera:
            self._chain = None
        self._design, self.scenes, self._view = design, scenes, view

    @property
    def design(self) -> SensorDesign:
        """A copy of the design; edits of it have no effect until `set_design` adopts it."""
        return self._design.copy()

    @property
    def groups(self) -> list[str]:
        """The names of the light groups, in the order of layers."""
        return self.scenes.assembly.groups

    @property
    def sensing(self) -> TriangleMesh:
        """The sensing surface in its current shape, with all its triangles."""
        return self.scenes.assembly.sensing

    @property
    def gels(self) -> list[TriangleMesh]:
        """The elastomers in their current shape."""
        return self.scenes.assembly.gels

    @property
    def scene(self) -> RayScene:
        """All surfaces of the sensor without contacts."""
        return self.scenes.full

    def update(self, path: str, value: Any) -> None:
        """Change one value of the design by its dotted path, and recompute only what depends on it.

        Raises:
            DesignError: there is no such value, or it does not fit.
        """
        self.set_design(set_value(self._design, path, value))

    def set_design(self, design: SensorDesign) -> None:
        """Adopt another design, and recompute only what depends on the values that differ.

        Changes of fluxes and colours take no time, changes of a coating or a camera little. A
        mirror or blocker that touches no transparent part is bent or moved without resolving the
        media again. A design that can't be built leaves the model unchanged.

        Args:
            design: the design; the more meshes it shares with the current one, the more is reused.

        Raises:
            DesignError, MeshError, LibraryError: the design can't be built.
        """
        refuse_no_design(design)
        new, old = design.copy(), self._design
        _refuse_impossible_kinds(new, old)
        if _shapes(old) != _shapes(new) or old.meshes != new.meshes:
            assembly = assemble(new, self.scenes.assembly, self.bends_media)
            scenes = SensorScenes(assembly, new.coating, self.scenes)
        elif old.coating != new.coating:
            scenes = self.scenes.coated(new.coating)
        else:
            scenes = self.scenes
        self._set(new, scenes, self._view_of(new, scenes))

    def _view_of(self, design: SensorDesign, scenes: SensorScenes) -> SkinView:
        """Return the current view if the camera and all shapes are unchanged, else a new one."""
        same = scenes.assembly is self.scenes.assembly
        if same and design.camera.view() == self._design.camera.view():
            return self._view
        return self.view_type(design, scenes)

    def camera(self, resolution: tuple[int, int] | None = None) -> RayCamera:
        """Return the design's camera, at the given resolution (width, height) if there is one."""
        return ray_camera(self._design, resolution)

    @property
    def picture_chain(self) -> PictureChain:
        """The camera's picture chain; if its blur depends on depth, with the depths of the
        untouched sensor.
        """
        if self._chain is None:
            self._chain = focused_chain(
                self._design.camera, lambda: self.scenes.fine.scene, self.camera
            )
        return self._chain

    @property
    def surface(self) -> SensingSurface:
        """The sensing surface with coordinates in mm.

        (0, 0) is where the camera's axis meets it (or the middle of what is seen), u runs
        towards the right and v towards the top of the image.
        """
        return self._view.surface

    @reraise_interrupts
    def chief_rays(
        self,
        resolution: tuple[int, int] | None = None,
        contacts: Sequence[Contact] = (),
        skin: str = ELASTIC,
    ) -> ChiefRays:
        """Trace the chief ray of each pixel, with ideal refraction and reflection.

        Args:
            resolution: (width, height) pixels; the camera's own by default.
            skin: "conforming" or "elastic", as in `OpticalModel.render`. On an elastic skin
                triangles have no numbers.

        Raises:
            ContactError: as in `OpticalModel.render`.
            RenderError: the resolution is invalid.
        """
        refuse_no_contacts(contacts)
        camera, fine = self.camera(resolution), self.scenes.fine
        if not contacts:
            return trace_chief_rays(fine.scene, camera, fine.sensing_faces)
        if skin == ELASTIC:
            return trace_chief_rays(self._deformed_scenes(contacts).full, camera)
        placed = [self.place(contact) for contact in contacts]
        return trace_chief_rays(self.scenes.with_indenters(placed), camera, fine.sensing_faces)

    def views_by_mirrors(self, resolution: tuple[int, int]) -> dict[frozenset[str], float]:
        """Return the shares of the camera's view by set of mirrors.

        Args:
            resolution: (width, height) of the chief rays.

        Returns:
            The share of the rays that arrive at the sensing surface by each set of parts that
            reflect them; the empty set stands for the rays that no mirror reflects.
        """
        rays = self.chief_rays(resolution)
        mirrors = [
            (1 << number % MIRROR_BITS, piece.name)
            for number, piece in enumerate(self.scenes.pieces)
            if piece.surface.kind is SurfaceKind.MIRROR
        ]
        return shares_by_mirrors(rays, mirrors)

    def differentiable_rays(
        self,
        moving: Sequence[str] = (),
        resolution: tuple[int, int] | None = None,
    ) -> DifferentiableRays:
        """Trace chief rays, with derivatives with respect to the shapes of surfaces and the camera.

        Args:
            moving: names of the parts with respect to whose vertices derivatives are computed:
                mirrors, blockers, sensing surfaces.
            resolution: (width, height) pixels; the camera's own by default.

        Raises:
            RenderError: no ray arrives, or a moving part is no such surface.
        """
        from optisense.optics.transport.ray_gradient import DifferentiableRays

        meshes = self._design.deformed_meshes()
        chosen = {name: meshes[name] for name in moving}
        return DifferentiableRays(self.scenes.fine.scene, self.camera(resolution), chosen)

    def nine_contacts(
        self,
        indenter: Indenter | None = None,
        depth: float = 0.8,
        resolution: tuple[int, int] | None = None,
    ) -> list[Contact]:
        """Return one contact at each of nine places that cover the visible sensing surface evenly.

        The default indenter is the OptiSense paper's ball of radius 1.5 mm.

        Args:
            resolution: (width, height), pixels, of the picture that shows the places, of which only
                the aspect ratio matters; the camera's own by default.
        """
        return self._view.nine_contacts(indenter, depth, resolution)

    def place(self, contact: Contact) -> TriangleMesh:
        """Return the part of an indenter that can touch the skin, placed by a contact in the
        design's frame (mm).

        Raises:
            ContactError: the contact is off the surface or deeper than the gel, or no depth gives
                its force.
        """
        return self._view.place(contact)

    def pressed(
        self, contacts: Sequence[Contact], placed: Sequence[TriangleMesh] | None = None
    ) -> PressedSkin:
        """Solve for the elastic skin under contacts: its shape, pressures and forces.

        Args:
            placed: their meshes from `place`, if they are known.

        Raises:
            ContactError: a contact is off the surface or deeper than the gel, or its pressure does
                not converge.
        """
        refuse_no_contacts(contacts)
        return self._view.gel.pressed(contacts, placed)

    def _deformed_scenes(self, contacts: Sequence[Contact]) -> ContactScenes:
        """Return the scenes of one image on an elastic skin."""
        pressed = self.pressed(contacts)
        return self.scenes.deformed(self._view.gel.mesh(contacts), pressed)


def _refuse_impossible_kinds(design: SensorDesign, before: SensorDesign | None) -> None:
    """Raise an error if a value that is not that of the design ``before`` can't be simulated."""
    raise_problems(kind_problems(design, before), f"design '{design.name}'")
    lens = design.camera.distortion
    if lens is not None and (before is None or before.camera.distortion != lens):
        refuse_numpy(lens)


def _shapes(design: SensorDesign) -> tuple[Any, ...]:
    """Return the values of a design that its geometry and the positions of its lights depend on."""
    lights = {
        name: (group.model, group.emitter, group.lights) for name, group in design.lights.items()
    }
    return design.parts, design.materials, design.cages, design.dispersion, lights
