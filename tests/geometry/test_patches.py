"""Faces selected by their normals, and across smooth edges."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.geometry import TriangleMesh
from optisense.geometry.patches import (
    angle_to_nearest,
    faces_towards,
    mean_normal,
    middle,
    patches,
    smoothly_joined,
)
from optisense.sensors._shapes import arc, revolve


def fingertip(radius: float = 10.0, height: float = 20.0) -> TriangleMesh:
    """A solid cylinder with a half ball on top."""
    tip = arc((0.0, height), radius, 0.0, 90.0, 24)
    return revolve([[0.0, 0.0], [radius, 0.0], *tip], 96)


def area(mesh: TriangleMesh, faces: np.ndarray) -> float:
    return float(mesh.face_areas[faces].sum())


def test_one_side_of_a_box() -> None:
    box = TriangleMesh.box((0, 0, 0), (10, 8, 4), (3, 4, 5))
    top = faces_towards(box, (0, 0, 2.5), 30.0)
    assert area(box, top) == pytest.approx(80.0)
    assert middle(box, top) == pytest.approx([5, 4, 4])
    assert mean_normal(box, top) == pytest.approx([0, 0, 1])
    assert len(faces_towards(box, (0, 0, 1), 90.0)) == len(box.faces) - len(
        faces_towards(box, (0, 0, -1), 30.0)
    )
    assert angle_to_nearest(box, (1, 1, 1)) == pytest.approx(np.degrees(np.arccos(1 / np.sqrt(3))))


def test_a_cap_of_a_dome_has_the_area_of_a_cap() -> None:
    """A cap up to 60 degrees from the pole of a sphere: 2 pi r^2 (1 - cos 60)."""
    tip = fingertip()
    cap = faces_towards(tip, (0, 0, 1), 60.0)
    assert area(tip, cap) == pytest.approx(2 * np.pi * 100 * 0.5, rel=0.05)


def test_what_goes_on_without_an_edge_is_all_but_the_base() -> None:
    tip = fingertip()
    skin = smoothly_joined(tip, faces_towards(tip, (0, 0, 1), 10.0))
    assert area(tip, skin) == pytest.approx(tip.area - np.pi * 100, rel=1e-3)
    assert not np.isin(faces_towards(tip, (0, 0, -1), 10.0), skin).any()


def test_patches_come_largest_first_and_apart() -> None:
    boxes = [TriangleMesh.box((x, 0, 0), (x + side, side, 1)) for x, side in ((0, 1), (5, 3))]
    both = TriangleMesh.joined(boxes)
    tops = patches(both, faces_towards(both, (0, 0, 1), 5.0))
    assert [area(both, top) for top in tops] == pytest.approx([9.0, 1.0])
    assert middle(both, tops[1]) == pytest.approx([0.5, 0.5, 1.0])


def test_equal_patches_come_in_the_order_of_their_places() -> None:
    leds = TriangleMesh.joined(
        [TriangleMesh.box((x, 0, 0), (x + 2, 2, 1)) for x in (8.0, 0.0, 4.0)]
    )
    tops = patches(leds, faces_towards(leds, (0, 0, 1), 5.0))
    assert [float(middle(leds, top)[0]) for top in tops] == pytest.approx([1.0, 5.0, 9.0])
