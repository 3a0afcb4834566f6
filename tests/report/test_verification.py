"""The page of a verification says what the numbers say, and shows every object."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from optisense.geometry import Contact
from optisense.geometry.objects import OBJECTS, ObjectIndenter
from optisense.report.verification import (
    change_figure,
    render_verification,
)
from optisense.tasks import Verification, VerificationSettings
from optisense.tasks.press_readings import PressPictures
from optisense.tasks.verification import SensorView

EVIL = "</h1><img src=x onerror=alert(1)>"
AXES = (np.diag([1.0, 1.0, 1.0]), np.diag([1.0, 1.0, 1.0]))
NAMES = tuple(OBJECTS)


def pictures() -> PressPictures:
    normals = np.zeros((60, 80, 3), np.float32)
    normals[..., 2] = -1.0
    angles = np.full((60, 80), np.nan, np.float32)
    angles[20:30, 30:45] = 12.0
    return PressPictures(np.full((60, 80, 3), 90, np.uint8), normals, normals, angles)


@pytest.fixture
def found() -> Verification:
    settings = VerificationSettings(NAMES, places=2, readers=1)
    before = np.random.default_rng(0).uniform(8.0, 16.0, (len(NAMES), 2, 1))
    view = SensorView(coverage=0.5, area=200.0, detail=0.06, stretching=1.02)
    return Verification(
        names=("the start", "trial 7"),
        settings=settings,
        scale=1.0,
        same_places=True,
        normals=(before, before - 4.0),
        depths=(before / 100, before / 100),
        flat=(20.0, 0.4),
        views=(view, replace(view, coverage=0.25)),
        pictures={name: (pictures(), pictures()) for name in NAMES},
        contacts={name: [Contact(ObjectIndenter(name), point=(0.0, 0.0, 0.0))] for name in NAMES},
    )


def test_the_verdict_and_every_number_are_on_the_page(found: Verification) -> None:
    page = render_verification(found, AXES)
    assert "<b>Better</b>" in page
    assert "trial 7 reads better" in page
    assert "-4.0 to -4.0" in page
    assert "50.0 %" in page
    assert "25.0 %" in page
    for relief in OBJECTS.values():
        assert relief.title in page
        assert relief.help in page
    # Four pictures of each object from each sensor, and the figure.
    assert len(re.findall(r'src="data:image/png', page)) == 8 * len(NAMES) + 1
    worse = render_verification(replace(found, normals=found.normals[::-1]), AXES)
    assert "<b>Worse</b>" in worse


def test_names_of_strangers_are_shown_and_not_obeyed(found: Verification) -> None:
    page = render_verification(replace(found, names=(EVIL, "b")), AXES)
    assert "<img src=x" not in page
    assert "&lt;img src=x" in page


def test_notes_are_told(found: Verification) -> None:
    page = render_verification(replace(found, scale=0.5, same_places=False), AXES)
    assert "scaled to 50 %" in page
    assert "sensing surfaces differ" in page
    assert "counts as read flat" not in page
    assert "counts as read flat" in render_verification(found, AXES)
    assert "notice" not in re.sub(
        r"<style>.*?</style>", "", render_verification(found, AXES), flags=re.S
    )


def test_few_balls_for_a_large_skin_are_told_where_a_verdict_lacks(found: Verification) -> None:
    """The noise of the second sensor's errors hides the difference; there are 40 balls."""
    noise = np.random.default_rng(1).normal(0.0, 4.0, found.normals[0].shape)
    unclear = replace(found, normals=(found.normals[0], found.normals[0] + noise))
    assert unclear.verdict == "inconclusive"
    assert not unclear.notes()
    large = tuple(replace(view, area=2000.0) for view in found.views)
    (note,) = replace(unclear, views=large).notes()
    assert "50 mm^2" in note
    assert "--presses 100" in note
    assert not replace(found, views=large).notes()


def test_the_figure_marks_the_mean_change(found: Verification) -> None:
    axes = change_figure(found).axes[0]
    assert [line.get_xdata()[0] for line in axes.lines[-2:-1]] == pytest.approx([-4.0])
    assert axes.get_yticklabels()[-1].get_text() == "all"


def test_the_figure_draws_no_interval_of_one_object(found: Verification) -> None:
    one = replace(
        found,
        settings=replace(found.settings, objects=NAMES[:1]),
        normals=(found.normals[0][:1], found.normals[1][:1]),
    )
    axes = change_figure(one).axes[0]
    assert not [line for line in axes.lines if line.get_linewidth() == 3]
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["object", "mean"]
