"""Drafts that are kept for the next time that a sensor is opened."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from shown_picture import shown
from waiting import until

from studio.sensor import opening
from studio.simulate import drafts, exposure, picture, stored_drafts


def test_a_sensor_that_is_opened_again_shows_its_draft_at_once(
    mini: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "drafts"
    monkeypatch.setattr(stored_drafts, "folder", lambda: place)
    now, settings = bpy.context.window_manager.optisense_picture, mini.optisense_simulation
    assert not stored_drafts.show_kept(mini)
    drafts._opened = True  # as when a window opens a sensor
    until(lambda: place.is_dir() and any(place.glob("*.npy")))
    assert now.is_draft and not now.is_stored and not settings.draft
    fresh = shown()
    assert bpy.ops.optisense.new(sensor="gelsight-mini-ideal") == {"FINISHED"}
    assert now.is_before
    picture.show(np.zeros((4, 4, 4), dtype=np.float32))
    assert stored_drafts.show_kept(mini)
    assert np.array_equal(shown(), fresh)
    assert now.is_stored and not now.is_before and picture.kind(now).startswith("Stored draft")

    mini.optisense.light_groups[0].flux *= 2.0
    assert not stored_drafts.show_kept(mini), "it is another sensor"
    mini.optisense.light_groups[0].flux /= 2.0
    bpy.ops.optisense.add_contact()
    assert not stored_drafts.show_kept(mini), "a ball presses on it"
    bpy.ops.optisense.clear_contacts()
    file = next(place.glob("*.npy"))
    file.write_bytes(b"damaged")
    assert not stored_drafts.show_kept(mini)


def test_a_draft_is_stored_for_the_sensor_that_it_shows(
    mini: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "drafts"
    monkeypatch.setattr(stored_drafts, "folder", lambda: place)
    drafts._opened = True
    drafts._ask()
    mini.optisense.light_groups[0].flux *= 2.0
    assert drafts._open
    until(lambda: all(each.done for each in drafts._open))
    assert not stored_drafts.show_kept(mini)
    mini.optisense.light_groups[0].flux /= 2.0
    assert stored_drafts.show_kept(mini)


def test_a_built_in_sensor_shows_the_draft_of_the_engine_at_once(
    mini: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = bpy.context.window_manager.optisense_picture
    found: list[str | None] = []

    def tell(scene: bpy.types.Scene, draft: str | None) -> None:
        found.append(draft)

    monkeypatch.setattr(opening, "when_opened", [tell])
    assert bpy.ops.optisense.new(sensor="digit") == {"FINISHED"}
    picture.show(np.zeros((4, 4, 4), dtype=np.float32))
    assert found[0] is not None and stored_drafts.show_built_in(mini, found[0])
    assert now.is_stored and not now.is_before
    pixels = picture.enlarged(np.load(found[0]), exposure.shown_size(mini) or (0, 0))
    assert np.allclose(shown(), pixels, atol=1e-6)
    mini.optisense_simulation.auto_exposure = False
    assert not stored_drafts.show_built_in(mini, found[0]), "it has the automatic exposure"
    mini.optisense_simulation.auto_exposure = True

    mini.optisense.light_groups[0].flux *= 2.0
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "own")) == {"FINISHED"}
    assert bpy.ops.optisense.open(filepath=str(tmp_path / "own")) == {"FINISHED"}
    assert not stored_drafts.show_built_in(mini, found[1]), "it is another sensor"
