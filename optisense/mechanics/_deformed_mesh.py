"""The mesh of a skin under contacts, refined where it bends and unchanged elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh
from optisense.geometry.refinement import refine
from optisense.mechanics._displacement_field import DECAY
from optisense.mechanics._pressed_skin import PressedSkin

EDGE_IN_CONTACT = 1.5
"""Smallest value of the greatest edge length in a contact, in units of the pitch of its grid:
smaller triangles would show no more than the grid holds."""
SMOOTH_EDGE = 3.0
"""Largest value of the greatest edge length in a contact, in units of the pitch of its grid: some
twenty triangles across a contact, which follow the outline of a smooth indenter."""
FACET_TILT = 0.01
"""Error of slopes between the corners of a triangle in a contact, above which triangles are
smaller: half a degree, which is not visible as shading normals vary linearly over triangles."""
EDGE_AT_RIM = 0.8
"""Greatest edge length within `RIM` of a contact's rim, in units of the grid's pitch. Slopes jump
at the rim, and larger triangles would make it jagged; half of it changes its light by 0.9 %."""
RIM = 1.5
"""Distance from the rim, in units of the grid's pitch, within which triangles are finer: the slope
jumps between two points of the grid, which lie within it."""
GROWTH = 0.3
"""Increase of the greatest edge length with the distance from a contact: displacements change over
lengths of about that distance."""
LONGEST_EDGE = 0.25
"""Greatest edge length in displaced parts of the skin, in thicknesses of the gel: bulges are as
wide as the gel is thick, and get four triangles."""
MAX_FACES = 600_000
"""Largest number of triangles of a deformed skin, which take some 100 MB; finer detail of contacts
is left out."""
BENT_SHARE = 0.1
"""Share of the greatest depth of a contact from which on inward-displaced skin around it counts as
bent. Bent skin casts shadows and is lit like indenters."""


class SkinState(IntEnum):
    """The state of a triangle of the deformed skin."""

    RESTING = 0  # displaced by little or nothing
    BENT = 1  # beside a contact, and displaced by much
    TOUCHING = 2


@dataclass(frozen=True, eq=False)
class _Origin:
    """Where the triangles of a deformed skin come from on the undeformed one.

    Attributes:
        near: (k,) mask of the undeformed faces that were refined.
        face: (m,) number, among these, of the face that each refined face lies in.
        shares: (m, 3, 3) barycentric coordinates of the corners of each refined face in it.
        displacement: (n, 3) displacements of the vertices, mm.
        tilt: (m, 3, 3) vectors that tilt the normals of the corners.
    """

    near: NDArray[np.bool_]
    face: NDArray[np.int64]
    shares: FloatArray
    displacement: FloatArray
    tilt: FloatArray


@dataclass(frozen=True, eq=False)
class SkinMesh:
    """A deformed sensing surface.

    Attributes:
        vertices: (n, 3) positions, mm; faces share them.
        faces: (m, 3) rows of ``vertices``, wound like those of the sensing surface.
        corner_normals: (m, 3, 3) unit shading normals of the corners, into the gel.
        state: (m,) the `SkinState` of each face.
        origin: where its triangles come from; None if that is not known.
    """

    vertices: FloatArray
    faces: NDArray[np.int64]
    corner_normals: FloatArray
    state: NDArray[np.uint8]
    origin: _Origin | None = None

    def carried(self, skin: TriangleMesh) -> SkinMesh:
        """Return the mesh on a sensing surface that was moved since, with the same displacements.

        Args:
            skin: the undeformed surface in its new shape, with the same faces.

        Raises:
            ValueError: the origin of the mesh is not known.
        """
        origin = self.origin
        if origin is None:
            raise ValueError("the origin of this mesh on the undeformed skin is not known")
        smooth = skin.vertex_normals()
        assert smooth.normals is not None
        corners = np.concatenate([skin.triangles, smooth.normals[smooth.faces]], axis=2)
        fine = np.einsum("fcb,fbk->fck", origin.shares, corners[origin.near][origin.face])
        whole = np.concatenate([corners[~origin.near], fine])
        vertices, normals = np.zeros_like(self.vertices), whole[..., 3:]
        vertices[self.faces] = whole[..., :3]
        normals[-len(fine) :] += origin.tilt
        vertices += origin.displacement
        normals = _on_side_of_faces(normals, vertices, self.faces)
        return SkinMesh(vertices, self.faces, normals, self.state, origin)

    def part(self, *states: SkinState) -> TriangleMesh | None:
        """Return the triangles in any of the states, with shading normals; None without any."""
        chosen = np.isin(self.state, states)
        if not chosen.any():
            return None
        corners = self.vertices[self.faces[chosen]].reshape(-1, 3)
        count = 3 * int(chosen.sum())
        normals = self.corner_normals[chosen].reshape(-1, 3)
        return TriangleMesh(corners, np.arange(count, dtype=np.int32).reshape(-1, 3), normals)


def skin_mesh(skin: TriangleMesh, pressed: PressedSkin, edge_scale: float = 1.0) -> SkinMesh:
    """Return the deformed mesh of the sensing surface.

    The border of the surface does not move, as it is joined to other parts.

    Args:
        skin: the undeformed sensing surface, with face normals into the gel.
        pressed: the solved contacts.
        edge_scale: factor on the greatest edge lengths.
    """
    smooth = skin.vertex_normals()
    assert smooth.normals is not None
    normals = smooth.normals[smooth.faces]
    whole = skin.welded()
    same_faces = len(whole.faces) == len(normals)
    if not same_faces:  # welding dropped faces without area
        smooth = whole.vertex_normals()
        assert smooth.normals is not None
        normals = smooth.normals[smooth.faces]
    faces = whole.faces.astype(np.int64)
    near = _near(whole, pressed)
    count = int(near.sum())
    own = np.broadcast_to(np.arange(count)[:, None, None], (count, 3, 1))
    corners = np.broadcast_to(np.eye(3), (count, 3, 3))
    vertices, fine, traits = refine(
        whole.vertices,
        faces[near],
        np.concatenate([normals[near], corners, own], axis=2),
        lambda p: edge_scale * _wanted(p, pressed),
        MAX_FACES,
    )
    fine_normals = traits[..., :3]
    used = np.unique(fine)
    inward = np.zeros_like(vertices)
    np.add.at(inward, fine.ravel(), fine_normals.reshape(-1, 3))
    inward[used] /= np.linalg.norm(inward[used], axis=1, keepdims=True)
    moved = pressed.displaced(vertices[used], inward[used])
    free = ~_on_border(fine, len(vertices))[used]
    displacement = np.zeros_like(vertices)
    displacement[used[free]] = moved.displacement[free]
    tilt = np.zeros_like(vertices)
    tilt[used] = moved.tilt
    touching = np.zeros(len(vertices), dtype=bool)
    touching[used] = moved.touching & free
    bent = np.zeros(len(vertices), dtype=bool)
    deepest = max(float(each.place.overlap.max()) for each in pressed.contacts)
    into = np.einsum("vi,vi->v", moved.displacement, inward[used])
    bent[used] = free & (into > BENT_SHARE * deepest)
    state = np.where(
        touching[fine].sum(axis=1) >= 2,  # so that areas are neither too large nor too small
        SkinState.TOUCHING,
        np.where(bent[fine].any(axis=1), SkinState.BENT, SkinState.RESTING),
    )
    origin = None
    if same_faces:
        face = traits[:, 0, 6].astype(np.int64)
        origin = _Origin(near, face, traits[..., 3:6], displacement, tilt[fine])
    fine_normals = fine_normals + tilt[fine]
    vertices, faces = vertices + displacement, np.concatenate([faces[~near], fine])
    resting = np.full(int((~near).sum()), SkinState.RESTING)
    return SkinMesh(
        vertices,
        faces,
        _on_side_of_faces(np.concatenate([normals[~near], fine_normals]), vertices, faces),
        np.concatenate([resting, state]).astype(np.uint8),
        origin,
    )


def _on_side_of_faces(
    normals: FloatArray, vertices: FloatArray, faces: NDArray[np.int64]
) -> FloatArray:
    """Return unit normals (m, 3, 3) of corners on the side of the faces' normals.

    Where the slope jumps, the normal of a corner may point against a steep face beside it; it is
    then replaced by that of the face.
    """
    normals = normals / np.linalg.norm(normals, axis=2, keepdims=True)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face, corner = np.nonzero(np.einsum("fck,fk->fc", normals, across) < 0.0)
    normals[face, corner] = across[face] / np.linalg.norm(across[face], axis=1, keepdims=True)
    return normals


def _near(mesh: TriangleMesh, pressed: PressedSkin) -> NDArray[np.bool_]:
    """Return a mask of the faces that a contact may displace."""
    near = np.zeros(len(mesh.faces), dtype=bool)
    for contact in pressed.contacts:
        place = contact.place
        local = place.local(mesh.vertices)[mesh.faces]
        reach = DECAY * place.thickness
        low, high = local.min(axis=1), local.max(axis=1)
        facing = mesh.face_normals @ place.axes[:, 2] < 0.0
        near |= (
            facing
            & (high[:, 0] > place.x[0] - reach)
            & (low[:, 0] < place.x[-1] + reach)
            & (high[:, 1] > place.y[0] - reach)
            & (low[:, 1] < place.y[-1] + reach)
        )
    return near


def _wanted(points: FloatArray, pressed: PressedSkin) -> FloatArray:
    """Return the greatest edge length (mm) at points of the skin."""
    result = np.full(len(points), np.inf)
    for contact in pressed.contacts:
        place = contact.place
        local = place.local(points)
        away, from_rim, bend = contact.field.nearby(local[:, 0], local[:, 1])
        # Slopes of second difference b deviate by b n^2 / 8 from a straight line over n pitches.
        straight = np.sqrt(8.0 * FACET_TILT / np.maximum(bend, FACET_TILT / SMOOTH_EDGE**2))
        inside = np.clip(straight, EDGE_IN_CONTACT, SMOOTH_EDGE)
        finest = np.where(from_rim < RIM * place.pitch, EDGE_AT_RIM, inside) * place.pitch
        length = np.minimum(finest + GROWTH * away, LONGEST_EDGE * place.thickness)
        result = np.minimum(result, np.where(away < DECAY * place.thickness, length, np.inf))
    return result


def _on_border(faces: NDArray[np.int64], count: int) -> NDArray[np.bool_]:
    """Return a mask (count,) of the vertices on edges that belong to a single face."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, times = np.unique(ends[:, 0] * count + ends[:, 1], return_counts=True)
    border = np.zeros(count, dtype=bool)
    alone = edges[times == 1]
    border[alone // count] = border[alone % count] = True
    return border
