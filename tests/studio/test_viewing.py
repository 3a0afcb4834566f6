"""How the picture is looked at: channels, false colours, against a pinned picture."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from recording import Recording

from studio.core import viewing as core
from studio.simulate import picture, viewing


def made(height: int = 6, width: int = 8, seed: int = 1) -> np.ndarray:
    pixels = np.random.default_rng(seed).random((height, width, 4), dtype=np.float32)
    pixels[..., 3] = 1.0
    return pixels


def shown(name: str) -> np.ndarray:
    image = bpy.data.images[name]
    values = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


def test_a_channel_is_grey_and_the_mean_is_of_all_three() -> None:
    now = made()
    for name, column in (("RED", 0), ("GREEN", 1), ("BLUE", 2)):
        found = core.viewed(now, channel=name)
        assert np.array_equal(found[..., :3], np.repeat(now[..., [column]], 3, axis=2))
    mean = core.viewed(now, channel="MEAN")
    assert np.allclose(mean[..., 0], now[..., :3].mean(axis=2))
    assert (mean[..., 3] == 1.0).all()


def test_false_colours_grow_brighter_with_the_picture() -> None:
    ramp = np.ones((1, 64, 4), dtype=np.float32)
    ramp[0, :, :3] = np.linspace(0.0, 1.0, 64)[:, None]
    found = core.viewed(ramp, false_colour=True)[0, :, :3]
    luminance = found @ (0.2126, 0.7152, 0.0722)
    assert (np.diff(luminance) > 0.0).all()
    assert len(np.unique(found.round(6), axis=0)) == 64


def test_a_wipe_has_the_pinned_picture_left_of_the_seam() -> None:
    now, before = made(6, 400), made(3, 200, seed=2)
    found = core.viewed(now, before, compare="WIPE", wipe=0.25)
    assert np.array_equal(found[:, 110:], now[:, 110:])
    assert np.array_equal(found[::2, 0:90:2], before[:, :45])
    assert np.array_equal(core.viewed(now, before, compare="WIPE", wipe=0.0)[:, 3:], now[:, 3:])


def test_a_difference_is_grey_where_nothing_changed_and_signed_elsewhere() -> None:
    now = np.full((4, 4, 4), 0.5, dtype=np.float32)
    before = now.copy()
    before[0, 0, :3], before[1, 1, :3] = 0.4, 0.6
    found = core.viewed(now, before, compare="DIFFERENCE", gain=4.0)
    assert np.allclose(found[2:, 2:, :3], 0.5)
    assert np.allclose(found[0, 0, :3], 0.7) and np.allclose(found[1, 1, :3], 0.3)
    coloured = core.viewed(now, before, compare="DIFFERENCE", gain=4.0, false_colour=True)
    assert coloured[0, 0, 0] > coloured[0, 0, 2] and coloured[1, 1, 2] > coloured[1, 1, 0]


def test_the_picture_itself_stays_as_it_is(mini: Any) -> None:
    values = bpy.context.window_manager.optisense_view
    first, second = made(), made(seed=2)
    picture.show(first)
    assert bpy.ops.optisense.pin_picture() == {"FINISHED"}
    assert values.compare == "WIPE"
    assert not mini.optisense_simulation.auto_exposure, "else all differs where one light changes"
    picture.show(second)
    values.compare = "DIFFERENCE"
    values.gain = 1.0
    kept, looked_at = shown(picture.IMAGE), shown(viewing.IMAGE)
    # Images have 256 levels.
    assert np.allclose(kept[..., :3], second[..., :3], atol=1 / 255)
    wanted = 0.5 + 0.5 * (second - first)[..., :3]
    assert np.allclose(looked_at[..., :3], wanted, atol=1 / 255)
    assert any("Minus the pinned" in line for line in _words())
    assert bpy.ops.optisense.unpin_picture() == {"FINISHED"}
    assert viewing.is_plain() and not values.pinned
    assert mini.optisense_simulation.auto_exposure
    with pytest.raises(RuntimeError, match="No picture is pinned"):
        bpy.ops.optisense.unpin_picture()


def _words() -> list[str]:
    bpy.context.window_manager.optisense_picture.shown = True
    return viewing.words(bpy.context)


def test_the_header_has_what_the_picture_needs(mini: Any) -> None:
    values = bpy.context.window_manager.optisense_view
    layout = Recording()
    viewing.draw_header(layout, bpy.context)
    assert layout.properties == ["auto_exposure", "exposure", "channel", "false_colour"]
    assert layout.operators == ["optisense.pin_picture"]
    picture.show(made())
    bpy.ops.optisense.pin_picture()
    for compare, slider in (("WIPE", "wipe"), ("DIFFERENCE", "gain")):
        values.compare = compare
        layout = Recording()
        viewing.draw_header(layout, bpy.context)
        assert layout.properties[-2:] == ["compare", slider]
    bpy.ops.optisense.unpin_picture()


def test_a_packed_picture_is_not_modified_and_the_next_replaces_it(mini: Any) -> None:
    for size in ((6, 8), (6, 8), (12, 16)):
        pixels = made(*size)
        image = picture.show(pixels)
        assert image.is_dirty
        picture.pack()
        assert not image.is_dirty, "else Blender 5.2 asks about it whenever the file is saved"
        np.testing.assert_allclose(shown(picture.IMAGE), pixels, atol=1 / 255)
