"""Materials: chosen from pictures, and kept as one's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy
import pytest
from waiting import until

from studio.engine import catalogue, session
from studio.materials import gallery
from studio.scene.collections import object_of


@pytest.fixture
def own_library(mini: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An engine whose user has a library of their own, which is empty."""
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(tmp_path))
    session.stop()
    session.engine()
    session.ask_and_wait("library", kind="camera")  # answered after all that is asked at the start
    yield tmp_path
    session.stop()
    monkeypatch.undo()
    session.engine()
    session.ask_and_wait("library", kind="camera")


def test_coatings_are_chosen_from_pictures(mini: Any) -> None:
    choice = bpy.context.window_manager.optisense_material
    choice.kind = "coating"
    names = [row["name"] for row in catalogue.entries("coating")]
    choice.coating = names[1]
    assert gallery.missing("coating") == names and not gallery.is_begun("coating")
    assert bpy.ops.optisense.material_pictures() == {"FINISHED"}
    assert gallery.waiting("coating") == len(names)
    assert not bpy.ops.optisense.material_pictures.poll()
    session.ask_and_wait("library", kind="coating")  # answered after the pictures
    assert gallery.waiting("coating") == 0
    for name in names:
        assert Path(gallery.picture("coating", name)).read_bytes().startswith(b"\x89PNG")
    rows = gallery.items("coating")
    assert [(row[0], row[4]) for row in rows] == [(each, n) for n, each in enumerate(names)]
    assert choice.coating == names[1]  # the same one as before there were pictures
    gallery.forget("coating", names[0])
    assert gallery.missing("coating") == names[:1]


def test_what_suits_the_selected_part_is_offered(mini: Any, select: Callable[..., None]) -> None:
    choice = bpy.context.window_manager.optisense_material
    for name, kind in (("skin", "coating"), ("gel", "material"), ("skin", "coating")):
        select(object_of(mini, "PART", name))
        bpy.context.view_layer.update()
        assert choice.kind == kind
    choice.kind = "material"  # by hand, and another update does not take it back
    bpy.context.active_object.location.x += 0.0
    bpy.context.view_layer.update()
    assert choice.kind == "material"


def test_an_own_material_does_not_change_what_is_chosen(
    mini: Any, select: Callable[..., None], own_library: Path
) -> None:
    """It comes before others in the list, and gets a picture where the others have one."""
    choice = bpy.context.window_manager.optisense_material
    choice.kind, choice.material = "material", "pdms-soft"
    bpy.ops.optisense.material_pictures()
    gel = object_of(mini, "PART", "gel")
    select(gel)
    assert bpy.ops.optisense.apply_material() == {"FINISHED"}
    mini.optisense.materials["pdms-soft"].put("ior", 1.43)
    session.ask_and_wait("library", kind="material")  # answered after the pictures
    assert bpy.ops.optisense.keep_material(name="my-gel") == {"FINISHED"}
    assert (own_library / "materials" / "my-gel.yaml").is_file()
    until(lambda: gallery.picture("material", "my-gel"))
    names = [row["name"] for row in catalogue.entries("material")]
    assert names.index("my-gel") < names.index("pdms-soft")
    assert choice.material == "pdms-soft", "as before"
    choice.material = "my-gel"
    assert bpy.ops.optisense.apply_material() == {"FINISHED"}
    assert gel.optisense.material == "my-gel"
    assert mini.optisense.materials["my-gel"].value("ior") == pytest.approx(1.43)
    choice.material = "pdms-soft"
    (own_library / "materials" / "my-gel.yaml").unlink()
    catalogue.refresh_library(session.engine(), "material")
    until(lambda: "my-gel" not in [row["name"] for row in catalogue.entries("material")])
    assert choice.material == "pdms-soft", "the numbers of the others stay as they were"
    assert gallery.picture("material", "my-gel") == "", "nothing is kept of one that has gone"
    with pytest.raises(RuntimeError, match="letter"):  # a name that files can't have
        bpy.ops.optisense.keep_material(name="ü")
    assert not list(own_library.rglob("*.yaml"))
