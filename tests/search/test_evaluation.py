"""Scoring a point: rules, failures, and a score that depends on nothing else than the point."""

from __future__ import annotations

import math
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from comparing import SCORE_ROUNDING

import optisense as ots
from optisense.design import SensorDesign, set_value
from optisense.design.difference import differences, fingerprint
from optisense.errors import ObjectiveError, SearchError
from optisense.search import Around, SearchSpace, search
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.relit import RelitEvaluator, can_relight
from optisense.search.space.constraints import NoCrossings, UserRule, why_forbidden

LOW = {
    "photons": 60_000,
    "resolution": (160, 120),
    "together": True,
    "places": [[0.0, 0.0], [4.0, 3.0]],
}


class TestScores:
    def test_agree_with_evaluate(self, svelte: SensorDesign) -> None:
        """A shape after others, in one model, scores as it does in a model of its own."""
        space = SearchSpace({"cages.M1.points": Around(0.5)}).bind(svelte)
        evaluator = DesignEvaluator(space, ["aoap"], {"ray_resolution": (96, 72)})
        rng = np.random.default_rng(2)
        points = [space.start, *space.from_unit(rng.random((2, space.size)))]
        found = [evaluator(point, 0).scores["aoap"] for point in points]
        assert len(set(found)) == 3
        for point, score in zip(points, found, strict=True):
            alone = ots.evaluate(space.apply(point), "aoap", ray_resolution=(96, 72))
            assert score == pytest.approx(alone.value, abs=1e-6)
        assert evaluator(points[1], 0).scores["aoap"] == found[1]

    @pytest.mark.slow
    def test_do_not_depend_on_what_came_before(self, mini: SensorDesign) -> None:
        """Rendered, with coatings, cameras, lights and shapes changed in another order: equal."""
        space = SearchSpace(
            {
                "coating.specularity": (0.0, 1.0),
                "lights.red.flux": (1.0, 20.0),
                "lights.red.shift.z": (-0.3, 0.3),
                "camera.position.z": Around(0.5),
            }
        ).bind(mini)
        points = [space.start + [0.2, 2.0, 0.0, 0.0], space.start + [0.0, 0.0, 0.2, -0.4]]
        one = DesignEvaluator(space, ["normdiff"], LOW)
        other = pickle.loads(pickle.dumps(one))
        forth = [one(point, 3).scores["normdiff"] for point in points]
        back = [other(point, 3).scores["normdiff"] for point in reversed(points)][::-1]
        assert all(map(math.isfinite, forth))
        assert forth == pytest.approx(back, rel=SCORE_ROUNDING)

    def test_what_is_rendered_is_told_here_and_not_by_copies(self, mini: SensorDesign) -> None:
        space = SearchSpace({"coating.specularity": (0.0, 1.0)}).bind(mini)
        settings = {"photons": 20_000, "resolution": (40, 30), "places": [[0, 0], [4, 3]]}
        evaluator = DesignEvaluator(space, ["normdiff"], settings)
        heard: list[str] = []
        evaluator.report_progress_to(lambda fraction, text: heard.append(text))
        evaluator(space.start, 0)
        assert "tracing photons" in heard
        assert "press 1 of 2" in heard
        heard.clear()
        copy = pickle.loads(pickle.dumps(evaluator))
        copy(space.start, 0)
        assert not heard

    def test_what_fails_is_told_and_the_rest_scored(self, svelte: SensorDesign) -> None:
        """A camera that looks away sees nothing: no score, but the plain function has one."""
        space = SearchSpace({"camera.turn.x": (-180.0, 180.0)}).bind(svelte)

        def width(design: SensorDesign) -> float:
            return float(design.camera.fov)

        outcome = DesignEvaluator(space, ["aoap", width])(np.array([180.0]), 0)
        assert outcome.failure
        assert math.isnan(outcome.scores["aoap"])
        assert outcome.scores["width"] == svelte.camera.fov

    def test_a_user_objective_in_a_file(self, svelte: SensorDesign, tmp_path: Path) -> None:
        file = tmp_path / "mine.py"
        file.write_text(
            "def seen(evaluation):\n    return float(evaluation.chief_rays.hit.mean())\n"
        )
        space = SearchSpace({"camera.turn.x": (-1.0, 1.0)}).bind(svelte)
        evaluator = DesignEvaluator(space, [f"{file}:seen"])
        again = pickle.loads(pickle.dumps(evaluator))
        assert 0.1 < again(space.start, 0).scores["seen"] <= 1.0


class TestBadInput:
    def test_goals(self, mini: SensorDesign) -> None:
        space = SearchSpace({"coating.specularity": (0.0, 1.0)}).bind(mini)
        with pytest.raises(ObjectiveError) as told:
            DesignEvaluator(space, ["aopa"])
        assert "aoap" in str(told.value.hint)
        with pytest.raises(SearchError, match="named twice"):
            DesignEvaluator(space, ["aoap", "aoap"])
        with pytest.raises(SearchError, match="the search has no objective"):
            DesignEvaluator(space, [])
        for wrong in (None, 5, ["aoap", None]):
            with pytest.raises(ObjectiveError, match=r"(None|5) is no objective"):
                search(mini, {"coating.specularity": (0.0, 1.0)}, wrong)  # type: ignore[arg-type]
        with pytest.raises(ObjectiveError) as told:
            DesignEvaluator(space, ["aoap"], {"photns": 3})
        assert "photons" in str(told.value.hint)
        with pytest.raises(SearchError, match="seed is an argument of the study"):
            DesignEvaluator(space, ["aoap"], {"seed": 3})


class TestConstraints:
    def test_parts_that_come_to_cross(self, svelte: SensorDesign) -> None:
        """A mirror pushed forward by ten millimetres is in the skin."""
        space = SearchSpace({"cages.M1.points": Around(10.0)}).bind(svelte)
        apart = NoCrossings(svelte)
        assert apart(svelte) is None
        point = space.start.copy()
        point[[name.endswith(".x") for name in space.names]] += 9.0
        said = apart(space.apply(point))
        assert said is not None
        assert "'M1'" in said
        evaluator = DesignEvaluator(space, ["aoap"])
        assert evaluator(point, 0).failure == said
        free = DesignEvaluator(space, ["aoap"], apart=False)
        assert not any(isinstance(rule, NoCrossings) for rule in free.constraints)

    def test_a_rule_from_a_file(self, mini: SensorDesign, tmp_path: Path) -> None:
        file = tmp_path / "rules.py"
        file.write_text(
            "def cheap(design):\n"
            "    count = sum(len(group.lights) for group in design.lights.values())\n"
            "    return count < 4 or f'{count} lights cost too much'\n"
        )
        rule = pickle.loads(pickle.dumps(UserRule(f"{file}:cheap")))
        assert why_forbidden(mini, [rule]) == "15 lights cost too much"
        with pytest.raises(SearchError, match="no function 'dear'"):
            UserRule(f"{file}:dear")(mini)
        with pytest.raises(SearchError, match="is not a rule"):
            UserRule("rules.py")

    def test_an_edited_rule_is_read_again_even_at_the_same_time_and_size(
        self, mini: SensorDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("sys.dont_write_bytecode", False)
        file = tmp_path / "rules.py"
        for answer in ("'one'", "'two'"):
            file.write_text(f"def rule(design):\n    return {answer}\n")
            os.utime(file, (1e9, 1e9))
            assert f"'{why_forbidden(mini, [UserRule(f'{file}:rule')])}'" == answer
        assert list(tmp_path.iterdir()) == [file]

    def test_what_rules_say(self, mini: SensorDesign) -> None:
        def said(answer: object) -> str | None:
            return why_forbidden(mini, [lambda design: answer])  # type: ignore[arg-type, return-value]

        assert said(True) is None
        assert said(None) is None
        assert said(np.bool_(True)) is None
        assert "does not hold" in str(said(False))
        assert said("no") == "no"
        with pytest.raises(SearchError, match="returned a float"):
            said(1.0)


class TestDifferences:
    def test_say_what_was_edited(self, mini: SensorDesign) -> None:
        edited = set_value(set_value(mini, "coating.specularity", 0.2), "camera.position.x", 1.0)
        assert differences(mini, edited) == [
            "coating.specularity: 0 -> 0.2",
            "camera.position[0]: 0 -> 1",
        ]
        assert differences(mini, mini.copy()) == []

    def test_meshes_are_compared_by_shape(self, mini: SensorDesign) -> None:
        moved = mini.copy()
        moved.meshes["gel"] = mini.meshes["gel"].transformed(
            np.array([[1, 0, 0, 0.01], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        )
        assert differences(mini, moved) == ["mesh of part 'gel': vertices moved by up to 0.01 mm"]
        assert fingerprint(moved) != fingerprint(mini)

    def test_a_saved_design_is_the_same(self, mini: SensorDesign, tmp_path: Path) -> None:
        ots.save_design(mini, tmp_path / "design")
        assert differences(mini, ots.load_design(tmp_path / "design")) == []

    def test_what_is_not_simulated_makes_no_difference(self, mini: SensorDesign) -> None:
        renamed = mini.model_copy(update={"name": "other", "description": "text"})
        assert differences(mini, renamed) == []
        assert fingerprint(renamed) == fingerprint(mini)


@pytest.mark.parametrize(("x", "z"), [(17.375, -4.25), (-12.625, -1.25)])
def test_a_gel_that_is_turned_inside_out_has_no_score(
    mini: SensorDesign, x: float, z: float
) -> None:
    """A corner of the gel, pulled past the other corners, scored better by AOAP than the start."""
    space = SearchSpace(
        {"cages.skin.points[0].x": (-20.0, 20.0), "cages.skin.points[0].z": (-5.0, 0.0)}
    ).bind(mini)
    evaluator = DesignEvaluator(space, ["aoap"], {"ray_resolution": [80, 60]})
    assert evaluator(space.start, 0).failure is None
    outcome = evaluator(np.array([x, z]), 0)
    assert "part 'gel' is turned inside out" in str(outcome.failure)


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("camera.fov", 0.01, "no lens of a sensor sees as little as 0.01 degrees"),
        ("camera.fov", 5.0, "of the sensing surface's area is seen"),
        ("camera.fov", 179.0, "no perspective lens sees 179 degrees"),
        ("camera.position.z", -2.0, "inside the solid part 'gel'"),
        ("camera.position.z", -8.0, "inside the solid part 'guide'"),
        ("camera.position.z", -900.0, "of the pixels see the sensing surface"),
        ("camera.position.z", 100.0, "sees nothing of the sensing surface"),
    ],
)
def test_a_camera_that_sees_nothing_worth_a_score_has_none(
    mini: SensorDesign, path: str, value: float, reason: str
) -> None:
    """Each of these won a search over this one parameter, or could have."""
    other = 52.0 if path == "camera.fov" else -22.0
    space = SearchSpace({path: (min(value, other), max(value, other))}).bind(mini)
    for objective in ("aoap", "2to3pw"):
        evaluator = DesignEvaluator(space, [objective], {"ray_resolution": [80, 60]})
        outcome = evaluator(np.array([value]), 0)
        assert outcome.failure is not None and reason in outcome.failure, objective


def test_trials_over_powers_have_the_scores_of_their_own_renderings(mini: SensorDesign) -> None:
    settings = {"photons": 100_000, "resolution": [160, 120]}
    goals = ["rgb2normal", "reading", "coverage"]
    space = SearchSpace({"lights.*.flux": (1.0, 6.0)}).bind(mini)
    usual = DesignEvaluator(space, goals, settings)
    assert can_relight(usual)
    relit, point = RelitEvaluator(usual), [1.5, 4.0, 2.5]
    rendered = usual(np.array(point), 3).scores
    assert dict(relit(np.array(point), 3).scores) == pytest.approx(rendered, rel=1e-5)


@pytest.mark.parametrize(
    ("path", "goal"),
    [
        ("coating.specularity", "reading"),
        ("lights.red.flux", "shadow"),
        ("lights.red.flux", "aoap"),
    ],
)
def test_other_searches_render_each_trial(mini: SensorDesign, path: str, goal: str) -> None:
    space = SearchSpace({path: (0.5, 1.0)}).bind(mini)
    assert not can_relight(DesignEvaluator(space, [goal]))
