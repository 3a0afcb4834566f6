"""Media where parts are curved, coated or mirrored (see `media_chain`)."""

from dataclasses import replace

import numpy as np
import pytest
from media_chain import ACRYLIC, GEL, area, box, check_chain, first_of

from optisense.geometry import TriangleMesh, cage_points
from optisense.geometry.cage import deformed
from optisense.geometry.rays import ray_hits
from optisense.optics.scene.assembly import AssemblyCache
from optisense.optics.scene.media import Media, Sheet, Solid
from optisense.optics.scene.surfaces import Surface, SurfaceKind


def dome(radius: float, rings: int, sectors: int, floor: float) -> TriangleMesh:
    """The closed upper half of a ball that stands on a cylinder from z = `floor` to 0."""
    polar = np.linspace(0, np.pi / 2, rings + 1)[1:]
    around = np.linspace(0, 2 * np.pi, sectors, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    levels = [
        np.column_stack([circle * r, np.full(sectors, z)])
        for r, z in [
            *zip(radius * np.sin(polar), radius * np.cos(polar), strict=True),
            (radius, floor),
        ]
    ]
    vertices = np.concatenate([*levels, [[0, 0, radius], [0, 0, floor]]])
    top, bottom = len(vertices) - 2, len(vertices) - 1
    faces = []
    for k in range(sectors):
        n = (k + 1) % sectors
        faces.append((top, k, n))
        for level in range(len(levels) - 1):
            a, b = level * sectors, (level + 1) * sectors
            faces += [(a + k, b + k, b + n), (a + k, b + n, a + n)]
        faces.append((bottom, b + n, b + k))
    return TriangleMesh(vertices, np.array(faces))


def test_a_curved_shell_shares_its_inner_surface_with_the_core() -> None:
    core = dome(2.0, 12, 40, -1.0)
    outer = dome(3.0, 16, 52, -1.0)
    shell = Solid("shell", outer, "silicone", GEL, priority=0)
    interfaces = Media([shell, Solid("core", core, "epoxy", 1.54, priority=1)]).interfaces
    assert area(interfaces, "core", "shell") == pytest.approx(
        core.area - core.face_areas[core.face_normals[:, 2] < -0.99].sum()
    )

    def truth(p: np.ndarray) -> float:
        for solid, ior in ((core, 1.54), (outer, GEL)):
            if ray_hits(solid, p, [0.31, 0.22, 0.9]).ray.size % 2:
                return ior
        return 1.0

    check_chain(interfaces, truth, count=300, reach=3.0)


def test_solids_of_one_curved_surface_in_two_tessellations_touch() -> None:
    """Chord errors below the tolerance on both sides: neither film nor overlap is left."""
    floor, ceiling = (
        box((-5, -5, -3), (5, 5, 0), (60, 1, 1)),
        box((-5, -5, 0), (5, 5, 3), (84, 1, 1)),
    )

    def bent(mesh: TriangleMesh) -> TriangleMesh:
        lift = (2.0 - 0.02 * mesh.vertices[:, 0] ** 2) * (np.abs(mesh.vertices[:, 2]) < 1)
        return mesh.with_vertices(mesh.vertices + lift[:, None] * [0, 0, 1])

    lower, upper = bent(floor), bent(ceiling)
    interfaces = Media(
        [Solid("guide", lower, "acrylic", ACRYLIC), Solid("gel", upper, "silicone", GEL)]
    ).interfaces
    top = lower.face_areas[(lower.face_normals[:, 2] > 0.5)].sum()
    assert area(interfaces, "guide", "gel") == pytest.approx(top, rel=1e-6)
    assert sum(f.mesh.area for f in interfaces if f.names == ("gel",)) == pytest.approx(
        upper.area - top, rel=1e-4
    )


def test_a_coating_replaces_the_gel_faces_under_it() -> None:
    mesh = box((-3, -3, 0), (3, 3, 2), (6, 6, 2))
    top = mesh.face_normals[:, 2] > 0.5
    skin = TriangleMesh(mesh.vertices, mesh.faces[top])
    other_skin = TriangleMesh.grid((6, 6), (5, 4), height=2.0).flipped()
    guide = Solid("guide", box((-4, -4, -1), (4, 4, 0)), "acrylic", ACRYLIC)
    truth = first_of(((-3, -3, 0), (3, 3, 2), GEL), ((-4, -4, -1), (4, 4, 0), ACRYLIC))
    for coating in (skin, other_skin):
        interfaces = Media(
            [Solid("gel", mesh, "silicone", GEL), guide], [Sheet("skin", coating)]
        ).interfaces
        assert area(interfaces, "gel") == pytest.approx(4 * 12)
        check_chain(interfaces, truth, stop=skin)


def test_a_mirror_between_two_solids_hides_the_faces_of_both() -> None:
    gel = Solid("gel", box((-3, -3, 0), (3, 3, 2)), "silicone", GEL)
    guide = Solid("guide", box((-3, -3, -2), (3, 3, 0)), "acrylic", ACRYLIC)
    mirror = Sheet("mirror", TriangleMesh.grid((2, 2)), "mirror")
    interfaces = Media([gel, guide], [mirror]).interfaces
    assert area(interfaces, "gel", "guide") == pytest.approx(36 - 4)
    assert area(interfaces, "gel") == area(interfaces, "guide") == pytest.approx(36 + 48)


def test_boundaries_are_known_to_hold_only_while_moving_sheets_touch_no_solid() -> None:
    gel = Solid("gel", box((-3, -3, 0), (3, 3, 2)), "silicone", GEL)
    skin = Sheet("skin", TriangleMesh.grid((6, 6), height=2.0))

    def mirror(height: float) -> Sheet:
        return Sheet("mirror", TriangleMesh.grid((2, 2), height=height), "mirror")

    media = Media([gel], [skin, mirror(-1.0)])
    assert media.holds_for([gel], [skin, mirror(-0.5)])
    assert media.holds_for([gel], [mirror(-0.5), skin])
    assert not media.holds_for([gel], [skin, mirror(0.0)])
    assert not media.holds_for([gel], [mirror(-0.5)])
    assert not media.holds_for([replace(gel, ior=1.5)], [skin, mirror(-1.0)])
    assert not Media([gel], [skin, mirror(0.0)]).holds_for([gel], [skin, mirror(-1.0)])


def test_shading_normals_live_on_in_cut_faces() -> None:
    core = dome(2.0, 12, 40, -1.0).vertex_normals()
    band = box((0, -3, -1), (3, 3, 0.5))
    interfaces = Media(
        [Solid("core", core, "epoxy", 1.54, priority=1), Solid("band", band, "silicone", GEL)]
    ).interfaces
    for face in interfaces:
        if face.names[0] == "core":
            assert face.mesh.normals is not None
            np.testing.assert_allclose(np.linalg.norm(face.mesh.normals, axis=1), 1.0)


def test_a_touching_solid_with_split_vertices_but_without_normals_is_curved() -> None:
    block = box((-10, -5, 0), (10, 5, 1), (8, 1, 1))
    x, y, z = block.vertices.T
    arch = block.with_vertices(np.column_stack([x, y, z * (4 - 0.02 * x**2)]))
    normals = np.round(arch.face_normals, 6)
    facets = [np.flatnonzero((normals == each).all(axis=1)) for each in np.unique(normals, axis=0)]
    split = TriangleMesh.joined([arch.with_faces(arch.faces[each]).compacted() for each in facets])
    beside = Solid("plate", box((-10, -5, -1), (10, 5, 0)), "acrylic", ACRYLIC)
    interfaces = Media([Solid("arch", split, "silicone", GEL), beside]).interfaces
    outside = next(face.mesh for face in interfaces if face.names == ("arch",))
    piece = AssemblyCache().piece("arch", outside, Surface(SurfaceKind.MIRROR), merge=True)
    assert piece.normals is not None


@pytest.mark.parametrize("top", [0.0, 1.0], ids=["touching", "overlapping"])
def test_solids_beside_others_keep_their_creases_and_normals(top: float) -> None:
    block = box((-6, -5, 0), (6, 5, 1), (4, 4, 2))
    x, y, z = block.vertices.T
    heights = z * (3 + (6 - np.abs(x)) * np.tan(np.radians(10)))
    roof = block.with_vertices(np.column_stack([x, y, heights]))
    corners = roof.triangles.reshape(-1, 3)
    own = np.repeat(roof.face_normals, 3, axis=0)
    facets = TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3), own)
    around = roof.bounds + [[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]]
    points = cage_points(around, (3, 3, 3))
    points[14] += 0.3  # above the middle, so that the base remains flat
    beside = Solid("bead", box((-1, -1, -1), (1, 1, top)), "glass", 1.52, priority=1)
    for mesh in (facets, *(deformed(each, around, (3, 3, 3), points) for each in (roof, facets))):
        interfaces = Media([Solid("roof", mesh, "silicone", GEL), beside]).interfaces
        assert area(interfaces, "bead", "roof") == pytest.approx(4.0 + 8.0 * top)
        outside = next(face.mesh for face in interfaces if face.names == ("roof",))
        piece = AssemblyCache().piece("roof", outside, Surface(SurfaceKind.MIRROR), merge=True)
        if piece.normals is None:
            continue  # all faces are flat
        normals = TriangleMesh(piece.vertices, piece.faces).face_normals
        cosine = np.einsum("fci,fi->fc", piece.normals[piece.faces], normals)
        assert cosine.min() > np.cos(np.radians(3.0))  # 10 degrees if the ridge was smoothed
