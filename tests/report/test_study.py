"""The page of a study shows its trials and escapes their texts."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.design import SensorDesign
from optisense.report import _study_figures as study_figures
from optisense.report._cage_changes import cage_changes
from optisense.report._pictures import figure_uri
from optisense.report.before_after import DesignView, RayFigures
from optisense.report.study import render_study
from optisense.report.trial_pictures import Ball
from optisense.search import Around, CagePoints, SearchResult, Study, search
from optisense.search.study.failures import counted

EVIL = "</table><img src=x onerror=alert(1)>"
SPACE: dict[str, object] = {
    "coating.specularity": (0.0, 1.0),
    "coating.reflectance.r": (0.2, 1.0),
    "lights.*.colour": ["R", "G"],
}


def steep(design: SensorDesign) -> float:
    """Follows the specularity, hardly the reflectance, and fails at one end."""
    if design.coating.specularity > 0.9:
        raise ValueError(EVIL)
    return design.coating.specularity + 0.01 * design.coating.reflectance[0]


def opposite(design: SensorDesign) -> float:
    return -(design.coating.specularity**2)


@pytest.fixture(scope="module")
def result() -> SearchResult:
    mini = ots.load("gelsight-mini-ideal")
    return search(mini, SPACE, [steep, opposite], method="pareto", budget=60, seed=2)


@pytest.fixture(scope="module")
def page(result: SearchResult) -> str:
    picture = np.full((3, 4, 3), 90, dtype=np.uint8)
    ball = Ball(1, 20, (np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 2.0]]),))
    figures = RayFigures(0.5, 0.25, 0.75, 0.5, 4.0, 1.1, 1.5, np.full((3, 4), 1.2))
    looks = {
        "before": DesignView(picture, (ball, Ball(2, 3)), (1.5, 0.3), figures),
        "after": DesignView(figures=replace(figures, evenness=1.0), failure=EVIL),
    }
    return render_study(result.study, looks)


def test_scores_before_and_after_are_told(result: SearchResult, page: str) -> None:
    for trial in (result.start, result.best):
        for name in ("steep", "opposite"):
            assert f">{trial.scores[name]:.4g}<" in page
    assert f"<b>trial {result.best.number}</b>" in page


def test_every_figure_is_there(page: str) -> None:
    """Convergence, both objectives, parameters against each of them, and one picture; all inside
    the page.
    """
    images = re.findall(r'<img [^>]*src="([^"]*)"', page)
    assert len(images) == 5
    assert 'aria-label="parameters against opposite;' in page
    assert "search for steep and opposite</h1>" in page
    assert all(image.startswith("data:image/png;base64,") for image in images)
    assert page.count("<svg") == 3  # two sections, and what lies over the picture
    assert not re.search(r'(src|href)="(?!data:)', page)


def test_trials_and_failures_are_listed(result: SearchResult, page: str) -> None:
    failed = [trial for trial in result.trials if trial.failure is not None]
    assert failed
    for trial in result.trials:
        if trial.failure is None:
            assert f">{trial.scores['steep']:.4g}<" in page
    assert f'<td class="tight">{counted(failed)}</td>' in page
    assert f"trial {failed[0].number}: " in page
    shown = len(result.trials) - len(failed)
    assert result.trials[0].is_start
    assert f"has the best {shown} of {len(result.trials) - 1} trials and the start." in page


def test_it_says_which_balls_can_be_made_out(page: str) -> None:
    assert "1 of the 2 are in view; 2 is hidden, or too small to make out." in page
    assert page.count("<polygon") == 1
    caption = "a number may be at another place of the skin before than after"
    assert caption in " ".join(page.split())


def test_what_got_worse_is_told_where_rays_may_move(page: str) -> None:
    def wide(design: SensorDesign) -> float:
        return design.camera.fov

    mini = ots.load("gelsight-mini-ideal")
    found = search(mini, {"camera.fov": (40.0, 60.0)}, wide, method="random", budget=3)
    figures = RayFigures(0.5, 0.25, 0.75, 0.5, 4.0, 1.1, 1.5, np.full((3, 4), 1.2))
    after = replace(figures, aoap=0.6, evenness=1.0, coverage=0.24)
    text = render_study(
        found.study, {"before": DesignView(figures=figures), "after": DesignView(figures=after)}
    )
    assert "Worse than before: 2to3PW (4 before, 1 after)." in text
    assert text.count('alt="stretching ') == 2
    assert "25.0 %" in text
    assert "<h2>Chief rays</h2>" not in page  # a coating moves no ray
    assert "<h2>Chief rays</h2>" in text


def test_columns_that_an_interruption_leaves_empty_are_left_out(tmp_path: Path) -> None:
    tried = 0

    def stopped(design: SensorDesign) -> float:
        nonlocal tried
        tried += 1
        if tried == 4:
            raise KeyboardInterrupt
        return design.coating.specularity

    mini = ots.load("gelsight-mini-ideal")
    space = {"coating.specularity": (0.0, 1.0)}
    found = search(mini, space, stopped, method="random", budget=9)
    assert found.interrupted
    text = render_study(found.study)
    assert "fresh seeds</th>" not in text
    assert "was interrupted before it scored the best trials with fresh seeds" in text
    done = render_study(search(mini, space, opposite, method="random", budget=3).study)
    assert "after, fresh seeds</th>" in done


def test_the_sections_of_two_designs_are_drawn_whole() -> None:
    """Labels and legend lie in the picture."""
    design = ots.load("digit")
    figure = study_figures.sections(design, design)
    figure_uri(figure)  # draws it once
    drawn = figure.get_tightbbox()
    assert drawn.min.min() >= 0.0
    assert (drawn.max <= figure.get_size_inches()).all()


def test_a_moved_cage_is_drawn_and_not_listed_number_by_number() -> None:
    svelte = ots.load("gelsight-svelte")
    middle = svelte.cages["M1"].current_points()[13]

    def away(design: SensorDesign) -> float:
        return float(design.cages["M1"].current_points()[13, 0] - middle[0])

    space = {"cages.M1.points": CagePoints(Around(1.0), points=(13, 14)), "lights.red.flux": (1, 9)}
    found = search(svelte, space, away, method="random", budget=6)
    text = render_study(found.study)
    assert "2 of 27 control points moved" in text
    assert 'alt="displacements of the control points of M1"' in text
    assert "<code>cages.M1.points" not in text
    assert "<code>lights.red.flux</code>" in text
    (change,) = cage_changes(svelte, found.best.design)
    assert sorted(int(row[0]) for row in change.rows()) == [13, 14]
    assert change.moves[13, 0] == pytest.approx(away(found.best.design))
    assert all(before and after for before, after in change.outlines)  # the mirror, in each layer


def test_nothing_escapes_into_the_page(page: str) -> None:
    assert "onerror=alert(1)" in page  # it is told, ...
    assert "<img src=x" not in page  # ... as text


def test_a_study_without_scores_has_a_page(tmp_path: Path) -> None:
    from optisense.search import Plan, SearchSpace

    plan = Plan(space=SearchSpace({"coating.specularity": (0.0, 1.0)}), goals=["aoap"])
    study = Study.create(tmp_path / "new", ots.load("gelsight-mini-ideal"), plan)
    text = render_study(study)
    study.close()
    assert "No trial has a score yet" in text


def test_the_command_writes_the_page(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    search(ots.load("gelsight-mini-ideal"), SPACE, opposite, method="random", budget=5, out=folder)
    before = {each.name for each in folder.iterdir()}
    done = CliRunner().invoke(app, ["report", str(folder), "--no-pictures"])
    assert done.exit_code == 0, done.output
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "search for opposite" in text and text.rstrip().endswith("</html>")
    assert {each.name for each in folder.iterdir()} - before == {"report.html"}
    missing = CliRunner().invoke(app, ["report", str(tmp_path / "nothing")])
    assert missing.exit_code == 2
    assert "no study in this folder" in missing.output


class TestInfluence:
    def test_the_parameter_that_matters_comes_first(self, result: SearchResult) -> None:
        found = study_figures.influences(result.trials, "steep")
        names = result.study.space.names
        assert names[found[0].number] == "coating.specularity"
        assert found[0].strength > 0.95
        assert len(found) == len(names)

    def test_rank_correlation(self) -> None:
        x = np.array([3.0, 1.0, 2.0, 5.0])
        assert study_figures.rank_correlation(x, np.exp(x)) == pytest.approx(1.0)
        assert study_figures.rank_correlation(x, -(x**3)) == pytest.approx(-1.0)
        assert study_figures.rank_correlation(x, np.ones(4)) == 0.0
        assert study_figures.rank_correlation([1, 2, 3, 4], [2, 1, 4, 3]) == pytest.approx(0.6)

    def test_correlation_ratio(self) -> None:
        """By hand: of groups (0, 2) and (4, 6) 16 of 20 lie between them."""
        assert study_figures.correlation_ratio([0, 0, 1, 1], [0, 2, 4, 6]) == pytest.approx(
            np.sqrt(16 / 20)
        )
        assert study_figures.correlation_ratio([0, 0, 1, 1], [1, 2, 2, 1]) == 0.0
        assert study_figures.correlation_ratio([0, 1], [3, 3]) == 0.0


def test_the_command_renders_the_best_trials(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    space = {"camera.fov": (45.0, 55.0, 2)}
    search(
        ots.set_value(ots.load("gelsight-mini-ideal"), "camera.resolution", (64, 48)),
        space,
        "aoap",
        method="grid",
        settings={"ray_resolution": (64, 48)},
        out=folder,
    ).study.close()
    options = ["--trial-pictures", "1", "--photons", "20000"]
    done = CliRunner().invoke(app, ["report", str(folder), *options])
    assert done.exit_code == 0, done.output
    page = (folder / "report.html").read_text()
    assert page.count("data:image/") >= 3  # before, after, and a trial
