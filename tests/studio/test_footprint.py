"""The camera's footprint: what it sees of the skin, kept up to date."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector
from waiting import until

from studio.core import outlines
from studio.engine import session
from studio.looks import drawing, footprint
from studio.scene.collections import object_of, objects_of
from studio.scene.contacts import sensing_surface


def area(corners: np.ndarray) -> float:
    one, two, three = np.moveaxis(corners.reshape(-1, 3, 3), 1, 0)
    return float(np.linalg.norm(np.cross(two - one, three - one), axis=1).sum() / 2)


def text() -> str:
    return str(bpy.context.window_manager.optisense_footprint.text)


def seen_per_cent() -> float:
    request = footprint._request
    until(lambda: request.open is not None and request.open.done and not request.is_wanted)
    return float(text().partition(" %")[0].rpartition(" ")[2])


@pytest.fixture
def shown(mini: Any) -> Any:
    mini.optisense_looks.footprint = True
    seen_per_cent()
    yield mini
    mini.optisense_looks.footprint = False


def test_the_outline_of_a_grid_goes_around_it_and_around_holes() -> None:
    rows, columns = np.mgrid[0:5, 0:6].astype(np.float32)
    points = np.stack([columns, rows, 0 * rows], axis=-1)
    hit = np.ones((5, 6), dtype=bool)
    quads, border = outlines.grid_quads(points, hit)
    assert len(quads) == 20 and len(border) == 2 * (4 + 5)
    hit[2, 2] = False  # its four quads go
    quads, border = outlines.grid_quads(points, hit)
    assert len(quads) == 16 and len(border) == 2 * (4 + 5) + 8
    points[:, 3:] += (100.0, 0.0, 0.0)  # the other side of a mirror's edge
    quads, border = outlines.grid_quads(points, np.ones((5, 6), dtype=bool))
    assert len(quads) == 16 and len(border) == 2 * 2 * (4 + 2)
    assert len(outlines.grid_quads(points, np.zeros((5, 6), dtype=bool))[0]) == 0


def test_what_is_drawn_is_as_much_of_the_skin_as_is_told(shown: Any) -> None:
    skin = footprint.skin_triangles(sensing_surface(shown))
    drawn = footprint._shown["seen"]
    share = area(drawn) / 2 / area(skin)  # it is drawn on both sides
    assert 100 * share == pytest.approx(seen_per_cent(), abs=2.0)
    assert abs(drawn[:, 2]).max() == pytest.approx(footprint.LIFT, abs=1e-3)


def test_it_follows_the_camera_and_the_skin(shown: Any) -> None:
    camera = objects_of(shown, "CAMERA")[0]
    before, border = seen_per_cent(), footprint._shown["border"].copy()
    camera.location += Vector((2.0, 0.0, 0.0))
    bpy.context.view_layer.update()
    after = seen_per_cent()
    moved = footprint._shown["border"].mean(axis=0) - border.mean(axis=0)
    assert moved[0] == pytest.approx(2.0, abs=0.2) and abs(moved[1]) < 0.1
    assert after == pytest.approx(before, abs=2.0)
    camera.optisense.fov = 25.0
    bpy.context.view_layer.update()
    assert seen_per_cent() < 0.6 * before


def test_switched_off_nothing_is_asked_or_drawn(shown: Any) -> None:
    shown.optisense_looks.footprint = False
    assert not footprint._shown and not text()
    objects_of(shown, "CAMERA")[0].location += Vector((1.0, 0.0, 0.0))
    bpy.context.view_layer.update()
    assert footprint._request.open is None and not footprint._request.is_wanted


def test_the_section_cuts_it(shown: Any) -> None:
    looks = shown.optisense_looks
    whole = footprint._shown["seen"]
    looks.cut, looks.axis, looks.share = True, "X", 0.5
    half = drawing.cut(shown, whole, 3)
    assert 0.3 < len(half) / len(whole) < 0.7 and (half[:, 0] > -0.1).all()


def test_a_late_error_does_not_reach_the_next_sensor(shown: Any) -> None:
    request, before = footprint._request, text()
    object_of(shown, "PART", "gel").optisense.material = ""
    footprint.wanted()
    shown.optisense.opening = "another sensor"
    assert request.open is not None and not request.open.done
    session.engine().wait(request.open)
    assert text() == before and footprint._shown


def test_a_sensor_that_can_not_be_built_has_none(shown: Any) -> None:
    bpy.data.objects.remove(objects_of(shown, "CAMERA")[0])
    footprint.wanted()
    until(lambda: text().startswith("No footprint"))
    assert not footprint._shown and "camera" in text()
