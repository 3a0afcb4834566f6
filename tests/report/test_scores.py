"""The page of scores escapes all texts of designs and objectives."""

from __future__ import annotations

import math
from typing import Any

import pytest

from optisense.objectives import Evaluation, Objective, Score, Settings
from optisense.objectives.score import Scored
from optisense.optics import OpticalModel
from optisense.report.scores import render_scores
from optisense.sensors import gelsight_mini_ideal

EVIL = "</svg></table><img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def evaluation() -> Evaluation:
    return Evaluation(OpticalModel(gelsight_mini_ideal()), Settings(ray_resolution=(20, 16)))


def page(evaluation: Evaluation, *scores: Score) -> str:
    scored = Scored(evaluation.design)
    scored.add(evaluation).update({score.objective: score for score in scores})

    def explained(evaluation: Any) -> float:
        """What <b>it</b> is."""
        return 0.0

    return render_scores(scored, [Objective(s.objective, explained, s.name) for s in scores])


def test_values_parts_and_summary_are_on_the_page(evaluation: Evaluation) -> None:
    parts = {"spread": 0.125, "places": [{"place": [1.0, 2.0], "score": 0.75}], "deep": {"a": {}}}
    text = page(evaluation, Score("mine", 0.1234567, parts=parts, title="Mine"))
    for words in (
        "Mine",
        "0.1235",
        "spread",
        "0.125",
        "1, 2",
        "0.75",
        "What &lt;b&gt;it&lt;/b&gt;",
    ):
        assert words in text, words


def test_a_share_among_counts_is_a_percentage(evaluation: Evaluation) -> None:
    parts = {"pixels_that_see_the_surface": 1.0, "pixels": 320}
    text = page(evaluation, Score("mine", 0.5, parts=parts))
    assert "<th>pixels that see the surface</th><td>100 %</td>" in text
    assert "<th>pixels</th><td>320</td>" in text


def test_a_failure_is_shown_as_text(evaluation: Evaluation) -> None:
    text = page(evaluation, Score(EVIL, math.nan, EVIL, {EVIL: EVIL}))
    assert "<img src=x" not in text
    assert "onerror" in text


def test_a_drawing_that_fails_leaves_the_score(evaluation: Evaluation) -> None:
    def draw(score: Score) -> Any:
        raise ValueError("no ink")

    text = page(evaluation, Score("mine", 0.5, title="Mine", draw=draw))
    assert "0.5" in text
    assert "data:image/png" not in text


def test_spread_is_that_of_a_sample(evaluation: Evaluation) -> None:
    scored = Scored(evaluation.design)
    for value in (1.0, 2.0, math.nan, 3.0):
        failure = "no light" if math.isnan(value) else None
        scored.add(evaluation)["mine"] = Score("mine", value, failure)
    assert scored.mean("mine") == 2.0
    assert scored.spread("mine") == 1.0
    assert scored.failed()
    assert scored.spread("other") is None
    assert math.isnan(scored.mean("other"))


def test_a_score_is_one_number_in_the_table_and_in_its_heading(evaluation: Evaluation) -> None:
    scored = Scored(evaluation.design)
    for value in (0.9575, 0.9553):
        scored.add(evaluation)["mine"] = Score("mine", value, title="Mine")
    text = render_scores(scored, [])
    assert text.count("0.9564") == 2
    assert "seed 0, which scores 0.9575" in text


def test_a_spread_that_is_rounding_is_none(evaluation: Evaluation) -> None:
    scored = Scored(evaluation.design)
    for value in (0.1, 0.1, 0.1):  # the mean of three equal numbers is not always that number
        scored.add(evaluation)["mine"] = Score("mine", value, title="Mine")
    assert scored.spread("mine") == 0.0
    assert "± 0<" in render_scores(scored, [])
