"""A sensor of one's own: empty, or of CAD files whose bodies are told apart by their names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from recording import draw

from studio.core.mesh_file import Mesh, write
from studio.engine import session
from studio.scene.collections import objects_of
from studio.scene.gather import gather_document
from studio.sensor import cad

QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box(path: Path, low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
    """Write a closed box (mm) to an .obj file."""
    axes = list(zip(low, high, strict=True))
    corners = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    faces = [three for a, b, c, d in QUADS for three in ((a, b, c), (a, c, d))]
    write(Mesh(corners, np.array(faces, dtype=np.int32)), path)


@pytest.fixture
def parts(tmp_path: Path) -> Path:
    box(tmp_path / "my Gel.obj", (-9, -7, -4), (9, 7, 0))
    box(tmp_path / "acrylic.obj", (-9, -7, -7), (9, 7, -4))
    box(tmp_path / "thing.obj", (-12, -9, -34), (12, 9, -30))
    return tmp_path


def files(folder: Path, *names: str) -> dict[str, Any]:
    return {"directory": str(folder), "files": [{"name": name} for name in names]}


def test_several_files_become_a_sensor_after_one_table(scene: Any, parts: Path) -> None:
    chosen = files(parts, "my Gel.obj", "acrylic.obj", "thing.obj")
    assert bpy.ops.optisense.cad_files(**chosen) == {"FINISHED"}
    found = cad.now()
    uses = {each.name: each.use for each in found.bodies}
    assert uses == {"my-Gel": "elastomer", "acrylic": "support", "thing": "blocker"}
    drawn = draw(bpy.types.OPTISENSE_PT_sensor)
    assert "my-Gel  18 x 14 x 4" in drawn.texts
    assert "optisense.make_from_cad" in drawn.operators and "units" in drawn.properties
    found.bodies["thing"].use = "nothing"
    assert bpy.ops.optisense.make_from_cad() == {"FINISHED"}, session.state().problem
    scene = bpy.context.scene
    roles = {each.optisense.key: each.optisense.role for each in objects_of(scene, "PART")}
    assert roles == {"my-Gel": "elastomer", "acrylic": "support", "skin": "sensing_surface"}
    assert objects_of(scene, "LIGHT") and objects_of(scene, "CAMERA")
    assert not scene.optisense.is_saved and not found.bodies
    sources = gather_document(scene)["provenance"]
    assert sources["parts.my-Gel"]["source"] == "CAD file my Gel.obj"
    bpy.ops.optisense.check()
    assert not session.state().problem, session.state().problem


def test_files_without_a_gel_are_told_and_the_table_stays(scene: Any, parts: Path) -> None:
    assert bpy.ops.optisense.cad_files(**files(parts, "thing.obj", "acrylic.obj")) == {"FINISHED"}
    for each in cad.now().bodies:
        each.use = "blocker"
    with pytest.raises(RuntimeError, match="gel"):
        bpy.ops.optisense.make_from_cad()
    assert len(cad.now().bodies) == 2
    assert bpy.ops.optisense.forget_cad() == {"FINISHED"} and not cad.now().bodies


def test_references_come_together_and_know_what_they_are(mini: Any, parts: Path) -> None:
    chosen = files(parts, "my Gel.obj", "acrylic.obj", "thing.obj")
    assert bpy.ops.optisense.add_mesh(**chosen, scale=2.0) == {"FINISHED"}
    found = {each.name: each for each in objects_of(mini, "REFERENCE")}
    kinds = {name: each.optisense.reference for name, each in found.items()}
    assert kinds == {"my-Gel": "elastomer", "acrylic": "support", "thing": "blocker"}
    assert tuple(found["my-Gel"].dimensions) == pytest.approx((36, 28, 8))
    assert {each.name for each in bpy.context.selected_objects} == set(found)


def test_an_empty_sensor_keeps_references_and_says_what_it_lacks(
    mini: Any, parts: Path, select: Callable[..., None]
) -> None:
    assert bpy.ops.optisense.add_mesh(**files(parts, "my Gel.obj")) == {"FINISHED"}
    assert bpy.ops.optisense.new_empty() == {"FINISHED"}
    scene = bpy.context.scene
    assert scene.optisense.title == "my-sensor" and scene.optisense.is_open
    assert not objects_of(scene, "PART", "LIGHT", "CAMERA") and objects_of(scene, "REFERENCE")
    assert not scene.optisense.materials and not scene.optisense.light_groups
    with pytest.raises(RuntimeError, match="no part; add CAD files"):
        bpy.ops.optisense.check()
    select(objects_of(scene, "REFERENCE")[0])
    assert bpy.ops.optisense.set_reference(reference="elastomer") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="no light; add one"):
        bpy.ops.optisense.check()
    assert bpy.ops.optisense.add_light(model="smd-3528", place=(0, 0, -9)) == {"FINISHED"}
    with pytest.raises(RuntimeError, match="no camera; add one"):
        bpy.ops.optisense.check()
    scene.cursor.location = (0, 0, -20)
    assert bpy.ops.optisense.add_camera(model="pi-v2") == {"FINISHED"}
    assert not gather_document(scene)["provenance"], "no sources of another sensor"
    bpy.ops.optisense.check()
    assert "sensing" in session.state().problem, session.state().problem
