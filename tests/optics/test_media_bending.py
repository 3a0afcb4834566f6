"""Boundaries that follow deformed solids, compared with boundaries that are resolved again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from media_chain import ACRYLIC, GEL, area, box

from optisense.geometry import TriangleMesh
from optisense.optics.scene.media import Media, Sheet, Solid

SIZE = (8, 8, 2)
GUIDE = Solid("guide", box((-3, -2, -2), (3, 2, 0), (4, 3, 2)), "acrylic", ACRYLIC)


def bulging(mesh: TriangleMesh, height: float, foot: float = 0.0) -> TriangleMesh:
    """What is above z = 0 raised in the middle, and all of it by `foot`."""
    x, y, z = mesh.vertices.T
    rise = height * np.cos(x / 3) * np.cos(y / 3) * z / 2 + foot
    return mesh.with_vertices(np.column_stack([x, y, z + rise]))


def parts(
    height: float = 0.0, foot: float = 0.0, skin: float | None = None
) -> tuple[list[Solid], list[Sheet]]:
    """A gel whose foot covers a part of a guide, and a skin on the gel's top."""
    gel = box((-1, -3, 0), (4, 1.5, 2), SIZE)
    top = gel.with_faces(gel.faces[gel.triangles[:, :, 2].min(axis=1) > 1.999]).compacted()
    solids = [Solid("gel", bulging(gel, height, foot), "silicone", GEL), GUIDE]
    return solids, [Sheet("skin", bulging(top, height if skin is None else skin, foot))]


@pytest.fixture(scope="module")
def flat() -> Media:
    return Media(*parts())


@pytest.mark.parametrize("height", [0.2, -0.5, 1.0])
def test_a_gel_that_bulges_has_the_boundaries_that_resolving_finds(
    flat: Media, height: float
) -> None:
    solids, sheets = parts(height)
    bent, anew = flat.bend(solids, sheets), Media(solids, sheets)
    assert bent is not None and bent.bent and not anew.bent
    assert [face.names for face in bent.interfaces] == [face.names for face in anew.interfaces]
    for names in (("gel", "guide"), ("gel",), ("guide",)):
        assert area(bent.interfaces, *names) == pytest.approx(area(anew.interfaces, *names))
    assert bent.holds_for(solids, sheets) is False  # so that it is resolved in the end
    assert anew.holds_for(solids, sheets)


def test_bending_on_and_back_leaves_no_trace(flat: Media) -> None:
    there = flat.bend(*parts(1.0))
    assert there is not None
    back = there.bend(*parts())
    assert back is not None
    for one, other in zip(back.interfaces, flat.interfaces, strict=True):
        np.testing.assert_allclose(one.mesh.vertices, other.mesh.vertices, atol=1e-9)
    guide = [face.mesh for face in flat.interfaces if face.names == ("guide",)]
    assert [
        face.mesh for face in there.interfaces if face.names == ("guide",)
    ] == guide  # the very same


def test_a_face_whose_solid_bends_elsewhere_is_the_very_same(flat: Media) -> None:
    bent = flat.bend(*parts(1.0))
    assert bent is not None
    foot, still = (
        next(face.mesh for face in media.interfaces if face.names == ("gel", "guide"))
        for media in (bent, flat)
    )
    assert foot is still


def test_what_comes_apart_is_resolved_anew(flat: Media) -> None:
    assert flat.bend(*parts(0.2, foot=0.1)) is None
    assert flat.bend(*parts(0.2, skin=0.3)) is None


def test_other_things_than_places_are_resolved_anew(flat: Media) -> None:
    solids, sheets = parts(0.2)
    assert flat.bend([replace(solids[0], ior=1.5), solids[1]], sheets) is None
    assert flat.bend(solids[:1], sheets) is None
    assert flat.bend(solids, []) is None
    finer = box((-1, -3, 0), (4, 1.5, 2), (9, 8, 2))
    assert flat.bend([replace(solids[0], mesh=finer), solids[1]], sheets) is None
