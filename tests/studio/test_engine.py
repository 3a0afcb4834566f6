"""Pictures, relighting, scores, searches by the real engine; and what happens when it fails."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector
from shown_picture import shown
from waiting import until

from studio.engine import session
from studio.scene.collections import object_of, objects_of
from studio.scene.gather import gather_document
from studio.scene.objects_at import objects_at
from studio.scene.subject import Subject
from studio.sensor import warming
from studio.sensor.warming import warm_up
from studio.simulate import drafts, picture, relight


def small(scene: Any) -> None:
    scene.optisense_simulation.size = "160"
    scene.optisense_simulation.noise = 50.0


def test_a_contact_is_seen_and_relighting_is_exact(mini: Any) -> None:
    small(mini)
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    empty = shown()
    assert empty.shape == (120, 160, 4)
    bpy.ops.optisense.add_contact()
    contact = objects_of(mini, "CONTACT")[0]
    contact.location = (3.0, 2.0, 0.5)  # above the surface: it is held on it
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    difference = np.abs(shown() - empty)[..., :3].sum(axis=2)
    row, column = np.unravel_index(difference.argmax(), difference.shape)
    # Image right is direction x up = -x, row 0 is at the bottom: up and left of the middle.
    assert row > 60 and column < 80
    bright = shown()
    now = bpy.context.window_manager.optisense_picture
    assert picture._previews and picture.IMAGE in picture._previews
    assert now.shown and not now.is_draft and "160 x 120" in now.summary
    for group in ("green", "blue"):
        mini.optisense.light_groups[group].flux = 0.0
        _relit()
    assert now.is_relit
    only_red = shown()
    assert only_red[..., 0].max() > 0.3
    assert only_red[..., 1:3].max() < 0.6 * only_red[..., 0].max()
    for group in ("green", "blue"):
        mini.optisense.light_groups[group].flux = 2.1
        _relit()
    assert np.abs(shown() - bright).max() < 2 / 255
    assert bpy.ops.optisense.report.poll()


def test_an_opened_sensor_warms_the_engine_up_and_the_last_one_counts(mini: Any) -> None:
    first, last = warm_up(mini), warm_up(mini)
    engine = session.engine()
    assert first is not None and last is not None and engine.waiting
    engine.wait(first)
    engine.wait(last)
    assert not session.state().busy and not session.state().problem
    assert bpy.ops.optisense.check() == {"FINISHED"}


def test_a_draft_does_not_wait_for_the_preparation_which_is_made_up_for(mini: Any) -> None:
    preparing = warm_up(mini)
    assert preparing is not None
    try:
        mini.optisense_simulation.draft = True
        until(lambda: bpy.context.window_manager.optisense_picture.is_draft)
        assert preparing.done, "it was cancelled"
        until(lambda: not warming.is_put_off() and not session.engine().waiting)
    finally:
        mini.optisense_simulation.draft = False


def _relit() -> None:
    session.engine().wait(relight._open)


def test_a_simulation_shows_progress_and_can_be_cancelled(mini: Any) -> None:
    mini.optisense_simulation.noise = 0.5
    assert bpy.ops.optisense.simulate(wait=False) == {"FINISHED"}
    now = session.state()
    assert session.is_busy() and now.busy == "Simulating"
    with pytest.raises(RuntimeError, match="The engine is busy"):
        bpy.ops.optisense.simulate()
    assert bpy.ops.optisense.cancel() == {"FINISHED"}
    until(lambda: not session.is_busy(), problem_allowed=True)
    assert now.note == "Cancelled" and not now.problem and not now.busy


def test_requests_larger_than_a_pipe_arrive_and_no_thread_is_needed(mini: Any) -> None:
    engine = session.engine()
    answers: list[Any] = []
    long = "x" * 400_000
    requests = [
        engine.send(long, on_result=answers.append, on_error=answers.append) for _ in range(3)
    ]
    # Blender crashes now and then where a Python thread runs beside it.
    assert threading.enumerate() == [threading.main_thread()]
    for request in requests:
        engine.wait(request)
    assert [each.kind for each in answers] == ["ProtocolError"] * 3
    assert session.ask_and_wait("sensors")["sensors"]


def test_a_picture_of_the_sensor_before_is_not_relit_and_says_so(mini: Any) -> None:
    small(mini)
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    before, now = shown(), bpy.context.window_manager.optisense_picture
    assert not now.is_before and bpy.ops.optisense.report.poll()
    assert bpy.ops.optisense.new(sensor="gelsight-mini-ideal") == {"FINISHED"}
    mini.optisense.light_groups[0].flux = 0.0
    session.ask_and_wait("library", kind="coating")  # a relighting would have come before this
    assert now.is_before and not now.is_relit and np.array_equal(shown(), before)
    assert not bpy.ops.optisense.report.poll()
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert not now.is_before and not np.array_equal(shown(), before)


def test_the_part_that_is_wrong_is_selected(mini: Any, select: Callable[..., None]) -> None:
    select()
    object_of(mini, "PART", "gel").optisense.material = ""
    bpy.ops.optisense.check()
    assert "gel" in session.state().problem
    assert [each.name for each in bpy.context.selected_objects] == ["gel"]


def test_the_light_that_is_wrong_is_selected_and_named(
    mini: Any, select: Callable[..., None]
) -> None:
    lights = [each for each in objects_of(mini, "LIGHT") if each.optisense.group == "green"]
    wall = object_of(mini, "PART", "gel")
    wall.optisense.role, wall.optisense.material = "blocker", ""
    middle = sum((wall.matrix_world @ Vector(corner) for corner in wall.bound_box), Vector()) / 8
    lights[2].location = middle
    select(wall)
    bpy.ops.optisense.check()
    assert "light 2 of group 'green'" in session.state().problem.lower()
    assert list(bpy.context.selected_objects) == [lights[2]]
    assert f"Selected: {lights[2].name}" in session.state().hint


def test_places_in_the_design_are_found_in_the_scene(mini: Any) -> None:
    for path, part, expected in (
        ("lights.red.flux", "", 5),
        ("lights.red.lights[4]", "gel", 1),
        ("lights.red.lights[5]", "", 0),
        ("camera.fov", "", 1),
        ("coating.eta", "", 1),
        ("", "gel", 1),
        ("name", "", 0),
    ):
        assert len(objects_at(Subject(mini), path, part)) == expected, path


def test_shapes_materials_and_lights_make_a_design_in_order(
    mini: Any, select: Callable[..., None], tmp_path: Path
) -> None:
    mirror = tmp_path / "side mirror.obj"
    mirror.write_text("v 5 13 -9\nv 9 13 -9\nv 9 13 -6\nv 5 13 -6\nf 1 2 3\nf 1 3 4\n")
    assert bpy.ops.optisense.add_mesh(filepath=str(mirror)) == {"FINISHED"}
    assert bpy.context.active_object.optisense.kind == "REFERENCE"
    assert bpy.ops.optisense.set_reference(reference="mirror") == {"FINISHED"}
    part = object_of(mini, "PART", "side-mirror")
    select(part)
    choice = bpy.context.window_manager.optisense_material
    choice.kind, choice.material = "material", "acrylic"
    with pytest.raises(RuntimeError, match="needs a material of kind conductor or diffuse"):
        bpy.ops.optisense.apply_material()
    choice.material = "mirror-silver"
    assert bpy.ops.optisense.apply_material() == {"FINISHED"}
    assert part.optisense.material == "mirror-silver"
    select(object_of(mini, "PART", "skin"))
    choice.kind, choice.coating = "coating", "semi-specular"
    assert bpy.ops.optisense.apply_material() == {"FINISHED"}
    assert mini.optisense.coating.library == "semi-specular"
    select()
    mini.cursor.location = (0.0, 13.0, -7.0)
    added = bpy.ops.optisense.add_light(model="smd-3528", group="NEW", name="white", count=2)
    assert added == {"FINISHED"}
    assert bpy.ops.optisense.check() == {"FINISHED"}
    assert not session.state().problem, session.state().problem
    document = gather_document(mini)
    assert document["parts"]["side-mirror"]["role"] == "mirror"
    assert len(document["lights"]["white"]["lights"]) == 2
    choice.kind, choice.material = "material", "acrylic"
    assert bpy.ops.optisense.preview_material() == {"FINISHED"}
    assert Path(choice.preview).read_bytes().startswith(b"\x89PNG")


def test_scores_rays_a_search_and_its_best_design(
    mini: Any, select: Callable[..., None], tmp_path: Path
) -> None:
    manager = bpy.context.window_manager
    manager.optisense_evaluation.chosen = {"aoap"}
    assert bpy.ops.optisense.evaluate() == {"FINISHED"}
    score = manager.optisense_evaluation.scores[0]
    assert score.title == "AOAP" and 0.5 < float(score.value) <= 1.0
    assert "coverage" in score.parts and Path(score.figure).is_file()
    assert bpy.ops.optisense.show_rays() == {"FINISHED"}
    assert "100 % hit" in manager.optisense_evaluation.rays
    rays = next(each for each in mini.objects if each.optisense.key == "ray hit")
    assert len(rays.data.splines) == 16 * 12
    document = gather_document(mini)  # rays are not part of the design
    assert set(document["parts"]) == {"skin", "gel", "tray", "guide"}

    search = mini.optisense_search
    bpy.ops.optisense.vary(text="cages.skin.points[14].z=0:6:3", label="height")
    search.study, search.objective = str(tmp_path / "study"), "aoap"
    search.method, search.budget = "grid", 0
    assert bpy.ops.optisense.search() == {"FINISHED"}
    found = manager.optisense_found
    assert "3 trials" in found.ended
    assert float(found.best) >= float(found.start)
    assert picture._previews and "OptiSense search" in picture._previews
    ghosts = [each.name for each in mini.objects if each.optisense.key.startswith("ghost")]
    assert "ghost skin" in ghosts
    bpy.ops.optisense.add_contact()
    pressed = [each.name for each in mini.objects if each.optisense.kind == "CONTACT"]
    assert bpy.ops.optisense.apply_best() == {"FINISHED"}
    contacts = [each for each in mini.objects if each.optisense.kind == "CONTACT"]
    assert pressed and [each.name for each in contacts] == pressed
    assert contacts[0].constraints[0].target == mini.objects["skin"]  # that of the new design
    best = gather_document(mini)["cages"]["skin"]["points"][14]["z"]
    assert f"{best:.4g}" == found.values.rpartition("= ")[2]
    # Rays are drawn anew, through the new design; the ghost is the design now.
    shown = [each.optisense.key for each in mini.objects if each.optisense.kind == "SHOWN"]
    assert shown and all(each.startswith("ray ") for each in shown)
    assert "hit" in manager.optisense_evaluation.rays
    kept = bpy.ops.optisense.keep_variant(filepath=str(tmp_path / "variant"))
    assert kept == {"FINISHED"} and (tmp_path / "variant" / "design.yaml").is_file()
    assert bpy.ops.optisense.resume() == {"FINISHED"}
    assert bpy.ops.optisense.export(filepath=str(tmp_path / "shop")) == {"FINISHED"}
    assert list((tmp_path / "shop").rglob("*.stl"))
    robot = tmp_path / "robot"
    assert bpy.ops.optisense.export_robot(filepath=str(robot), mass=20.0) == {"FINISHED"}
    assert {path.suffix for path in robot.iterdir()} == {".xml", ".urdf", ""}
    assert '<mass value="0.02" />' in next(robot.glob("*.urdf")).read_text()


def test_an_indenter_from_a_file_is_drawn_as_it_presses(mini: Any, tmp_path: Path) -> None:
    path = tmp_path / "wedge.obj"
    path.write_text(
        "v 4 4 2\nv 6 4 2\nv 5 4 7\nv 4 8 2\nv 6 8 2\nv 5 8 7\n"
        "f 1 2 3\nf 6 5 4\nf 1 4 5\nf 1 5 2\nf 2 5 6\nf 2 6 3\nf 3 6 4\nf 3 4 1\n"
    )
    bpy.ops.optisense.add_contact()
    contact = objects_of(mini, "CONTACT")[0]
    contact.optisense.depth = 0.4
    contact.optisense.scale = 0.5
    contact.optisense.file = str(path)
    contact.optisense.indenter = "mesh"
    until(lambda: len(contact.data.vertices) == 6)
    points = np.array([vertex.co for vertex in contact.data.vertices])
    assert np.allclose(points.min(axis=0), [-0.5, -1.0, -0.4], atol=1e-6)
    assert np.allclose(points.max(axis=0), [0.5, 1.0, 2.1], atol=1e-6)


def test_drafts_follow_a_dragged_light_and_the_last_is_whole(mini: Any) -> None:
    pictures: list[dict[str, Any]] = []
    take, engine = drafts.requests.take, session.engine()
    light, settings = objects_of(mini, "LIGHT")[0], mini.optisense_simulation

    def taken(result: dict[str, Any], subject: Subject, *, draft: bool) -> None:
        pictures.append(result)
        take(result, subject, draft=draft)

    drafts.requests.take, settings.draft = taken, True
    try:
        for wanted in (1, 3):
            while len(pictures) < wanted:  # the mouse goes on moving
                light.location.x += 0.01
                bpy.context.view_layer.update()
                assert len(drafts._open) <= 3
                time.sleep(session._tick() or 0.0)
        assert pictures[-1]["draft"] and pictures[-1]["settings"]["kept_layers"]
        assert bpy.context.window_manager.optisense_picture.is_draft
        until(lambda: not pictures[-1]["settings"]["kept_layers"])
        until(lambda: not engine.waiting)
        came = len(pictures)
        rest = time.monotonic() + 2 * drafts.REST
        until(lambda: time.monotonic() > rest)
        assert len(pictures) == came  # and no more, as nothing moves
    finally:
        drafts.requests.take, settings.draft = take, False
