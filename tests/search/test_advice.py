"""A warning precedes a search whose trials cannot differ."""

from __future__ import annotations

import numpy as np
import pytest

import optisense as ots
from optisense.design import set_value
from optisense.optics import OpticalModel
from optisense.search.study.advice import advice, changes_no_ray, moved_start_note

BRIGHT = [
    "coating.specularity",
    "coating.roughness",
    "lights.red.flux",
    "lights.red.colour",
    "materials.tray.reflectance",
    "coating.library",
]
RAYS = ["camera.fov", "cages.skin.points", "parts.tray.shift.x", "materials.acrylic.ior"]


def test_only_what_is_bright_is_told_from_what_turns_rays() -> None:
    assert all(changes_no_ray(each) for each in BRIGHT)
    assert not any(changes_no_ray(each) for each in [*RAYS, "lights.red.shift.z", "lights.model"])


def test_chief_rays_stay_where_only_brightness_varies() -> None:
    """The paths have the stated effects on rays."""
    design = ots.load("gelsight-mini-ideal")
    model = OpticalModel(design)
    before = model.chief_rays((40, 30)).points
    for path, value in (("coating.specularity", 0.9), ("lights.red.flux", 40.0)):
        assert changes_no_ray(path)
        model.set_design(set_value(design, path, value))
        np.testing.assert_array_equal(model.chief_rays((40, 30)).points, before)
    model.set_design(set_value(design, "camera.fov", 40.0))
    assert not np.allclose(model.chief_rays((40, 30)).points, before)


@pytest.mark.parametrize("objectives", [["aoap"], ["aoap", "2to3pw"], ["aoap + 0.5*coverage"]])
def test_rays_and_brightness_do_not_go_together(objectives: list[str]) -> None:
    text = advice(["coating.specularity", "lights.red.flux"], objectives)
    assert text is not None and "all trials will score alike" in text
    assert "coating.specularity and lights.red.flux do not change" in text
    assert "rgb2normal" in text


def test_nothing_is_said_against_what_may_succeed() -> None:
    assert advice(["coating.specularity", "camera.fov"], ["aoap"]) is None
    assert advice(["coating.specularity"], ["rgb2normal"]) is None
    assert advice(["lights.red.flux"], ["power"]) is None
    assert advice(["lights.*.flux"], ["aoap - 0.01*power"]) is None
    assert advice(["lights.red.colour"], ["power"]) is not None
    assert advice(["coating.specularity"], ["aoap", "normdiff"]) is None
    assert advice(["coating.specularity"], ["mine.py:own"]) is None
    assert advice(["coating.specularity"], ["no-such-objective"]) is None  # told by others


def test_a_design_outside_the_search_space_is_told() -> None:
    """The start is moved to the nearest bound, and from an unknown name to the first option."""
    design = ots.load("gelsight-mini-ideal")
    inside = ots.SearchSpace({"camera.fov": (1.0, 170.0), "cages.skin.points": (-30.0, 30.0)})
    assert moved_start_note(inside.bind(design)) is None
    space = {"camera.fov": (80.0, 90.0), "coating.library": ["semi-specular", "diffuse-grey"]}
    text = moved_start_note(ots.SearchSpace(space).bind(design))
    assert text is not None and "camera.fov begins with 80 (the design has " in text
    assert "coating" not in text
    space = {"coating.library": ["semi-specular", "mirror-like"]}
    text = moved_start_note(ots.SearchSpace(space).bind(design))
    assert text is not None and "begins with semi-specular (the design has diffuse-grey)" in text
    move = ots.SearchSpace({"parts.tray.shift.x": (1.0, 2.0)}).bind(design)
    assert moved_start_note(move) == (
        "the design is not in the search space: parts.tray.shift.x begins with 1 (the design has 0)"
    )
