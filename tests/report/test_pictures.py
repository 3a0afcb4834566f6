"""The pictures of the page have the content of the arrays."""

from __future__ import annotations

import base64
import io

import numpy as np
from PIL import Image

from optisense.picture_files import png
from optisense.report._pictures import data_uri, mask_overlay, normal_colours

AXES = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
"""Image right, image up and viewing direction of a camera that looks along +z."""


def test_the_same_pixels_are_read_back() -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (7, 11, 3)).astype(np.uint8)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png(pixels)))), pixels)
    grey = pixels[..., 0]
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png(grey)))), grey)


def test_the_data_uri_holds_the_png() -> None:
    pixels = np.full((2, 3, 3), 9, dtype=np.uint8)
    head, _, body = data_uri(pixels).partition(",")
    assert head == "data:image/png;base64"
    assert base64.b64decode(body) == png(pixels)


def test_a_surface_facing_the_camera_is_the_normal_maps_blue() -> None:
    inward, outward = np.zeros((1, 1, 3)), np.zeros((1, 1, 3))
    inward[..., 2], outward[..., 2] = -1.0, 1.0
    for normals in (inward, outward):
        assert normal_colours(normals, AXES).tolist() == [[[128, 128, 255]]]


def test_normals_lean_to_the_right_in_red_and_up_in_green() -> None:
    lean = np.sqrt(0.5)
    normals = np.array([[[-lean, 0.0, -lean], [0.0, lean, -lean], [0.0, 0.0, 0.0]]])
    right, up, nothing = normal_colours(normals, AXES)[0].astype(int)
    assert right[0] > 200
    assert right[1] == 128
    assert up[1] > 200
    assert up[0] == 128
    assert nothing.tolist() == [0, 0, 0]


def test_the_mask_keeps_its_colours_inside_a_white_outline() -> None:
    picture = np.zeros((9, 9, 3), dtype=np.uint8)
    picture[...] = (200, 100, 50)
    mask = np.zeros((9, 9), dtype=bool)
    mask[2:7, 2:7] = True
    shown = mask_overlay(picture, mask)
    assert shown[4, 4].tolist() == [200, 100, 50]
    assert shown[2, 4].tolist() == [255, 255, 255]
    assert len(set(shown[0, 0].tolist())) == 1  # grey outside
