"""What the skin has on it and what presses on it: markers, forces, drags, and the light there."""

from __future__ import annotations

import json
import re
from typing import Any

import bpy
import numpy as np
import pytest
from recording import draw

from studio.core import ledger as words
from studio.engine import design_transfer, session
from studio.evaluate import ledger
from studio.evaluate.ui import OPTISENSE_PT_evaluate
from studio.looks import markers
from studio.materials.ui import OPTISENSE_PT_materials
from studio.scene.collections import objects_of
from studio.sensor.opening import picture_is_old
from studio.simulate.requests import presses


def test_a_contact_is_pressed_by_force_dragged_and_turned(mini: Any) -> None:
    mini.optisense_simulation.size = "160"
    mini.optisense_simulation.noise = 50.0
    bpy.ops.optisense.add_contact()
    values = objects_of(mini, "CONTACT")[0].optisense
    (given,) = design_transfer.contacts(mini)
    assert not {"force", "shift", "twist"} & set(given)
    values.press_by, values.force = "FORCE", 0.5
    values.shift, values.twist = (0.2, 0.0), 10.0
    (given,) = design_transfer.contacts(mini)
    assert given["force"] == 0.5 and given["shift"] == [0.2, 0.0] and given["twist"] == 10.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    said = bpy.context.window_manager.optisense_picture.summary
    assert re.match(r"160 x 120, noise [\d.]+ % \([\d.]+ % in the worst places\), [\d.]+ s$", said)
    told = bpy.context.window_manager.optisense_picture.presses
    assert told.startswith("contact: 0.5 N at ") and "dragged with" in told
    depth = float(told.removeprefix("contact: 0.5 N at ").partition(" mm")[0])
    assert values.depth == pytest.approx(depth, rel=0.01), "it is drawn as deep as it presses"
    mini.optisense_simulation.skin = "conforming"
    values.press_by = "DEPTH"
    values.shift, values.twist = (0.0, 0.0), 0.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert not bpy.context.window_manager.optisense_picture.presses, "no force is known"


def test_a_draft_tells_no_forces() -> None:
    row = {"force_n": 1.0, "depth_mm": 0.5, "greatest_pressure_mpa": 0.02, "area_mm2": 3.0}
    result = {"settings": {"presses": [row]}}
    assert presses(result, ["ball"]) == "ball: 1 N at 0.5 mm, up to 20 kPa on 3 mm²"
    assert not presses({"draft": True, **result}, ["ball"])


def test_markers_are_printed_drawn_and_taken_off_again(mini: Any) -> None:
    assert markers.of_design(mini) is None
    bpy.ops.optisense.set_markers(columns=3, rows=2, pitch=1.5, radius=0.25)
    assert design_transfer.design(mini)["data"]["markers"] == {
        "grid": [3, 2], "pitch": 1.5, "radius": 0.25,
    }  # fmt: skip
    found = session.ask_and_wait("markers", design=design_transfer.design(mini))
    points = np.load(found["files"]["points"])
    normals = np.load(found["files"]["normals"])
    assert found["count"] == 6 and np.ptp(points, axis=0)[:2] == pytest.approx((3.0, 1.5))
    corners = markers.discs(points, normals, found["radius"]).reshape(-1, 3, 3)
    one, two, three = np.moveaxis(corners, 1, 0)
    area = np.linalg.norm(np.cross(two - one, three - one), axis=1).sum() / 2
    assert area == pytest.approx(2 * 6 * np.pi * 0.25**2, rel=0.03), "on both sides of the skin"
    bpy.context.view_layer.objects.active = next(
        each for each in objects_of(mini, "PART") if each.optisense.role == "sensing_surface"
    )
    assert "Markers: 3 x 2, 1.5 mm apart" in draw(OPTISENSE_PT_materials).texts
    bpy.ops.optisense.remove_markers()
    assert "markers" not in design_transfer.design(mini)["data"]


def test_the_ledger_tells_where_the_light_goes(mini: Any) -> None:
    bpy.ops.optisense.add_contact()
    assert bpy.ops.optisense.ledger() == {"FINISHED"}
    values = bpy.context.window_manager.optisense_ledger
    groups = words.group_rows(json.loads(values.groups))
    assert [title.split(":")[0] for title, _ in groups] == ["red", "green", "blue"]
    for _, lines in groups:
        shares = [float(share.split()[0]) for _, share in lines]
        assert sum(shares) == pytest.approx(100.0, abs=1.5), "all of the light is somewhere"
    (place,) = json.loads(values.places)
    assert len(words.place_text(place)) == 3
    assert session.state().about == ledger.TITLE


def test_the_ledger_of_another_sensor_says_so(mini: Any) -> None:
    emitted = {"emitted": {}, "entries": [], "camera": {"irradiance": {}}}

    def said(scene: Any) -> str:
        with bpy.context.temp_override(scene=scene):
            return " ".join(draw(OPTISENSE_PT_evaluate).texts)

    ledger.take({"ledger": emitted, "places": []}, mini)
    other = bpy.data.scenes.new("Other")
    other.optisense.document = mini.optisense.document
    assert "Light of the" not in said(mini)
    assert f"Light of the sensor of the scene '{mini.name}'" in said(other)
    picture_is_old(other)
    assert "Light of the" not in said(mini)
    picture_is_old(mini)
    assert f"Light of the sensor of the scene '{mini.name}'" in said(other)
    assert "Light of the sensor that was open before" in said(mini)
