"""The main built-in sensors at first sight, the camera's footprint and a strip of scores, by mouse.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from PIL import Image

from .bench import Bench
from .test_rows_by_hand import EVALUATE

SENSORS = ("gelsight-mini-ideal", "digit", "gelsight360", "gelsight-svelte")

FILLED = 0.12
"""Share of the free part of the view that a sensor covers at least when it is opened."""

LAMPS = 300
"""Pixels in the colour of lamps, at least."""

OBJECTIVES = ("aoap", "2to3pw", "coverage", "distortion")
SCORES = "manager.optisense_evaluation.scores"
FOOTPRINT = "part('looks.footprint').in_words(scene())"

ABOVE, BELOW = 262, 184
"""Pixels from the button *Evaluate* up to the head of its panel, and down to below four scores."""

SIDE, SHARE_UP, TOOLS = 500, 0.08, 64
"""Size in pixels of one sensor in the picture of all, share of the view above it that is left out,
where there are only words, and width of the tools on its left."""


def test_each_sensor_is_readable_at_first_sight(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    shown = []
    for name in SENSORS:
        bench.new_sensor(name, panels=False)
        bench.over_view()
        view = bench.view()
        view = view[:, : bench.sidebar()[0] - bench.see("place('VIEW_3D', 'WINDOW')")[0]]
        ground = np.median(view[-60:, -200:], axis=(0, 1))
        filled = (abs(view - ground).max(axis=2) > 10).mean()
        assert filled > FILLED, f"{name} covers {filled:.0%} of the view"
        strongest, weakest = view.max(axis=2), view.min(axis=2)
        lamps = np.count_nonzero(strongest - weakest > 120)
        assert lamps > LAMPS, f"{name} has {lamps} pixels of lamps"
        shown.append(view)
    folder = os.environ.get("OPTISENSE_WINDOW_PICTURES")
    if folder:
        whole = Image.new("RGB", (2 * SIDE, 2 * SIDE))
        for number, view in enumerate(shown):
            high, wide = view.shape[:2]
            up, side = round(SHARE_UP * high), round(high * (1 - SHARE_UP))
            across = max(TOOLS, (wide - side) // 2)
            picture = Image.fromarray(view[up:, across : across + side].astype(np.uint8))
            whole.paste(picture.resize((SIDE, SIDE)), (number % 2 * SIDE, number // 2 * SIDE))
        whole.save(Path(folder) / "looks.jpg", quality=85, optimize=True)


def test_the_footprint_shows_what_the_mirror_shows(bench: Bench) -> None:
    bench.press("footprint", across=0.1)
    bench.until(f"'The camera sees' in {FOOTPRINT}")
    bench.over_view()
    red = bench.view()
    bench.photograph("footprint", "WINDOW")
    bench.press("footprint", across=0.1)
    bench.until(f"not {FOOTPRINT}")
    bench.over_view()
    assert (abs(red - bench.view()).max(axis=2) > 20).mean() > 0.02


def test_four_scores_stand_in_a_strip(bench: Bench) -> None:
    bench.only(EVALUATE)
    for name in OBJECTIVES:
        bench.tick(name)
    bench.press("optisense.evaluate")
    bench.until(f"len({SCORES}) == {len(OBJECTIVES)}")
    bench.rest()
    assert bench.see(f"all(each.has_share and each.direction for each in {SCORES})")
    button = bench.find("optisense.evaluate")[1] - bench.sidebar()[1]
    bench.photograph("scores", "UI", button - ABOVE, ABOVE + BELOW)
