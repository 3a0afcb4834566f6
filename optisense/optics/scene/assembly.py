"""The surfaces and emitters of a sensor design, prepared for ray tracing."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from optisense import library
from optisense.design import LightGroup, LightModel, SensorDesign
from optisense.design.arrangement import carved
from optisense.design.materials import CoatingModel, Material, Medium, Reflection
from optisense.design.parts import TRANSPARENT_SOLIDS, Role
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.coplanar import merge_coplanar
from optisense.geometry.shading_normals import is_flat, shaded
from optisense.optics.scene._finishes import ShapeCache, finishes_of, frosted
from optisense.optics.scene._lamp_places import off_faces, window, with_media
from optisense.optics.scene._sheets import media_beside, split_by_media
from optisense.optics.scene._solids import AROUND, Interface, Sheet, Solid
from optisense.optics.scene.emitters import Emitter, EmitterShape
from optisense.optics.scene.media import Media, same_faces
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surfaces import RGB, Region, Surface, SurfaceKind

SMOOTH_METAL = 0.01
"""GGX roughness below which a metal is an ideal mirror. With 0.01, half of the micro-facets tilt by
less than 0.6 degrees, so that reflections blur by about one degree."""


@dataclass(frozen=True)
class Assembly:
    """A design prepared for ray tracing.

    Attributes:
        pieces: all fixed surfaces; flat faces are merged into few triangles.
        sensing: the deformed sensing surface, with all its triangles.
        gels: the elastomers, without what parts of higher priority cut out of them; drafts of parts
            that bend leave it in.
        emitters: all lights; ``group`` counts in the order of ``groups``.
        fine: by number of a piece of the sensing surface, that piece with all its triangles.
        ior_before: refractive index on the inner side of the (first) sensing surface.
        absorption_before: absorption coefficients (1/mm) of the medium on that side at R, G, B.
        media: the resolved boundaries.
        kept: shapes that the assembly of a similar design can reuse.
    """

    pieces: list[Piece]
    sensing: TriangleMesh
    gels: list[TriangleMesh]
    emitters: list[Emitter]
    groups: list[str]
    fine: dict[int, Piece]
    ior_before: float
    absorption_before: RGB
    media: Media
    kept: AssemblyCache


@dataclass
class AssemblyCache(ShapeCache):
    """Shapes computed from meshes, which are recognised by identity, and these meshes."""

    merged: list[tuple[TriangleMesh, TriangleMesh]] = field(default_factory=list)
    pieces: list[tuple[TriangleMesh, Piece]] = field(default_factory=list)
    beside: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    """Numbers (m, 2) of the solids in front of and behind each face of each sheet; -1 for air."""

    def merge(self, mesh: TriangleMesh) -> TriangleMesh:
        """Return a part's mesh with its flat faces merged; unchanged if parts bend and an earlier
        mesh with the same faces had no flat ones.
        """
        earlier = self.earlier.merged
        known = next((merged for old, merged in earlier if old is mesh), None)
        if known is None and self.bend:
            bent = (merged is old and same_faces(old, mesh) for old, merged in earlier)
            known = mesh if any(bent) else None
        self.merged.append((mesh, _merged(mesh) if known is None else known))
        return self.merged[-1][1]

    def media_beside(
        self, mesh: TriangleMesh, solids: list[Solid], each: bool
    ) -> NDArray[np.int64]:
        """Return the numbers (m, 2) of the solids in front of and behind each face of a sheet; -1
        for air. Known ones are reused.

        Args:
            each: whether they are looked up for each smooth patch of faces; else for the largest
                face alone.
        """
        places = [part for solid in solids for part in (solid.mesh, solid.priority)]
        key = ("beside", mesh, each, *places)
        sheet = Surface(SurfaceKind.MIRROR)
        return self.get_or_make(key, lambda: media_beside(_piece("", mesh, sheet), solids, each))

    def split(
        self, mesh: TriangleMesh, beside: NDArray[np.int64]
    ) -> list[tuple[tuple[int, int], TriangleMesh]]:
        """Return the parts of a sheet of `split_by_media`; known ones are reused."""
        key = ("split", mesh, beside.tobytes())
        return self.get_or_make(key, lambda: split_by_media(mesh, beside))

    def piece(self, name: str, mesh: TriangleMesh, surface: Surface, merge: bool = False) -> Piece:
        """Return the piece of a mesh and its surface, reused if it is known.

        Args:
            merge: whether flat faces are merged, as on a flat side of a curved solid.
        """
        known_pieces = (*self.earlier.pieces, *self.pieces)
        pieces = (piece for old, piece in known_pieces if old is mesh)
        known = next(pieces, None)
        if known is None or (known.name, known.surface) != (name, surface):
            known = _piece(name, _merged(mesh) if merge else mesh, surface)
        self.pieces.append((mesh, known))
        return known


def assemble(design: SensorDesign, before: Assembly | None = None, bend: bool = False) -> Assembly:
    """Resolve media, and turn parts and lights into surfaces and emitters.

    Args:
        before: the assembly of a similar design, whose unchanged shapes are reused.
        bend: whether boundaries between media are moved along with parts that bend instead of being
            resolved again, for drafts.

    Raises:
        DesignError: solids overlap without priority, or a light is not in the library.
        MeshError: a solid is not closed.
    """
    meshes = design.deformed_meshes()
    solids, sheets, pieces, fine = [], [], [], {}
    indices: list[float] = []
    absorptions: list[RGB] = []
    kept = AssemblyCache(None if before is None else before.kept, bend=bend)
    for name, part in design.parts.items():
        if name not in meshes:
            raise DesignError(f"part '{name}' has no mesh", where=design.where("parts", name))
        mesh = kept.merge(meshes[name])
        material = design.materials.get(part.material) if part.material else None
        if part.role in TRANSPARENT_SOLIDS:
            medium = _medium(design, name, material)
            seen = medium.indices if design.dispersion else None
            solids.append(
                Solid(
                    name,
                    mesh,
                    part.material or "",
                    medium.ior,
                    medium.roughness,
                    part.priority,
                    medium.absorption,
                    seen,
                )
            )
        elif part.role is Role.INTERFACE:
            medium = _medium(design, name, material)
            pieces.append(kept.piece(name, mesh, _refracting_sheet(medium, design)))
        elif part.role is not Role.INDENTER:
            sheets.append(Sheet(name, mesh, part.role.value))
    frosts, paints = finishes_of(design, meshes, sheets, kept)
    covers = {sheet.name: design.parts[sheet.name].material for sheet in sheets}
    covers |= {paint.sheet.name: paint.material for paint in paints}
    sheets += [paint.sheet for paint in paints]
    if before is not None and before.media.holds_for(solids, sheets):
        media = before.media
    else:
        bent = before.media.bend(solids, sheets) if before is not None and bend else None
        media = Media(solids, sheets) if bent is None else bent
    for whole in media.interfaces:
        for frost, face in frosted(whole, frosts, solids, kept):
            name = "/".join(face.names) + "|" + face.outside + (frost and f":{frost}")
            pieces.append(kept.piece(name, face.mesh, _interface_surface(face), merge=True))
    around = [*solids, AROUND]
    for sheet in sheets:
        is_skin = sheet.kind == Role.SENSING_SURFACE.value
        material = None if is_skin else design.materials.get(covers[sheet.name] or "")
        metal = material is not None and material.reflection().specularity > 0
        beside = kept.earlier.beside.get(sheet.name) if media.bent else None
        if beside is None or len(beside) != len(sheet.mesh.faces):
            beside = kept.media_beside(sheet.mesh, solids, metal)
        kept.beside[sheet.name] = beside
        if is_skin:
            before_it = around[beside[0, 0]]
            indices.append(before_it.ior)
            absorptions.append(before_it.absorption)
            surface = coating_surface(design.coating, before_it.ior, Region.SENSING)
            fine[len(pieces)] = kept.piece(sheet.name, meshes[sheet.name], surface)
            pieces.append(kept.piece(sheet.name, sheet.mesh, surface))
            continue
        for (front, back), mesh in kept.split(sheet.mesh, beside):
            surface = _opaque(material, around[front].ior, around[back].ior)
            pieces.append(kept.piece(sheet.name, mesh, surface))
    sensing = [meshes[name] for name in design.parts_of(Role.SENSING_SURFACE)]
    emitters = off_faces(_emitters(design, solids), pieces)
    for number, emitter in enumerate(emitters):
        if emitter.shape is not EmitterShape.POINT:
            pieces.append(window(number, emitter))
    kept.before = None  # so that it can be freed
    return Assembly(
        pieces=pieces,
        sensing=sensing[0] if len(sensing) == 1 else TriangleMesh.joined(sensing),
        gels=[
            meshes[name] if bend else carved(design, meshes, name)
            for name in design.parts_of(Role.ELASTOMER)
        ],
        emitters=emitters,
        groups=list(design.lights),
        fine=fine,
        ior_before=indices[0],
        absorption_before=absorptions[0],
        media=media,
        kept=kept,
    )


def _medium(design: SensorDesign, part: str, material: Material | None) -> Medium:
    medium = None if material is None else material.medium()
    if medium is None:
        raise DesignError(
            f"part '{part}' must be transparent", where=design.where("parts", part, "material")
        )
    return medium


def coating_surface(coating: CoatingModel, ior: float, region: Region) -> Surface:
    """Return the coating as seen from a medium of refractive index ``ior``."""
    return _reflecting(SurfaceKind.OPAQUE, coating.reflection().in_medium(ior), region)


def _reflecting(kind: SurfaceKind, reflection: Reflection, region: Region) -> Surface:
    return Surface(
        kind,
        alpha=reflection.roughness,
        specularity=reflection.specularity,
        reflectance=reflection.reflectance,
        metal_eta=reflection.eta,
        metal_k=reflection.k,
        region=region,
    )


def indenter_piece(mesh: TriangleMesh, coating: Surface) -> Piece:
    """Return the piece of an indenter that carries the coating."""
    surface = replace(coating, region=Region.INDENTER)
    return Piece("indenter", mesh.vertices, mesh.faces, surface, mesh.normals)


def is_mirror(reflection: Reflection) -> bool:
    """Return whether a surface is a metal smooth enough to reflect images, a mirror."""
    return reflection.is_metal and reflection.roughness < SMOOTH_METAL


def _opaque(material: Material | None, ior: float, ior_behind: float) -> Surface:
    """Return the surface of an opaque sheet between media of two indices, in front and behind."""
    reflection = Reflection() if material is None else material.reflection()
    if reflection.is_black:
        return Surface(SurfaceKind.ABSORBER)
    kind = SurfaceKind.MIRROR if is_mirror(reflection) else SurfaceKind.OPAQUE
    surface = _reflecting(kind, reflection.in_medium(ior), Region.OTHER)
    return replace(surface, eta=ior_behind / ior) if reflection.specularity > 0 else surface


def _interface_surface(face: Interface) -> Surface:
    """Return the surface between two media; one that bends no light scatters none either."""
    bends = face.ior_inside != face.ior_outside or face.etas not in (None, (1.0, 1.0, 1.0))
    return Surface(
        SurfaceKind.DIELECTRIC,
        eta=face.ior_inside / face.ior_outside,
        alpha=face.roughness if bends else 0.0,
        etas=face.etas,
        absorption=face.absorption,
    )


def _refracting_sheet(medium: Medium, design: SensorDesign) -> Surface:
    """Return the surface of a refracting sheet; the unknown medium behind it absorbs nothing."""
    etas = medium.indices if design.dispersion else None
    return Surface(SurfaceKind.DIELECTRIC, eta=medium.ior, alpha=medium.roughness, etas=etas)


def _merged(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh with flat facets merged into few triangles, which are traced faster."""
    # Only flat meshes are merged, as merging drops shading normals; a curved mesh may still have
    # flat walls.
    if not is_flat(shaded(mesh)):
        return mesh
    merged = merge_coplanar(mesh)
    if is_flat(shaded(merged)):
        return merged
    # Vertices that are split without normals say nothing about the edges between their faces.
    if (mesh.rest or mesh).normals is None and not is_flat(mesh.welded().vertex_normals()):
        return merged
    corners = merged.triangles.reshape(-1, 3)
    own = np.repeat(merged.face_normals, 3, axis=0)
    return TriangleMesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3), own)


def _piece(name: str, mesh: TriangleMesh, surface: Surface) -> Piece:
    smooth = shaded(mesh)
    if is_flat(smooth):
        return Piece(name, mesh.vertices, mesh.faces, surface)
    return Piece(name, smooth.vertices, smooth.faces, surface, smooth.normals)


def _emitters(design: SensorDesign, solids: list[Solid]) -> list[Emitter]:
    emitters = []
    for number, group in enumerate(design.lights.values()):
        if group.emitter is None and not library.is_own("light", group.model):
            lamp = _built_in_lamp(group.model)
        else:
            lamp = _lamp(library.emitter(group))
        for light in group.lights:
            emitters.append(
                replace(
                    lamp,
                    group=number,
                    position=light.position,
                    direction=light.direction,
                    up=light.up,
                )
            )
    if not emitters:
        raise DesignError("the design has no lights", where=design.where("lights"))
    return with_media(emitters, solids)


@lru_cache(maxsize=64)
def _built_in_lamp(name: str) -> Emitter:
    return _lamp(library.emitter(LightGroup.model_construct(model=name, emitter=None)))


def _lamp(model: LightModel) -> Emitter:
    """Return a light of a model, at the origin."""
    window, power = model.window(), model.cosine_power()
    lamp = Emitter(
        group=0,
        position=(0.0, 0.0, 0.0),
        direction=(0.0, 0.0, 1.0),
        exponent=1.0 if power is None else power,
        intensity=model.intensity() if power is None else None,
    )
    if window is None:
        return lamp
    return replace(lamp, shape=EmitterShape[window.shape.upper()], size=window.size)
