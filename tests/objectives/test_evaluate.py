"""Scoring of a sensor: shared images, failures, and validation of settings."""

from __future__ import annotations

import html
import math
import pickle
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from comparing import SCORE_ROUNDING, same_light

from optisense import OpticalModel, Score, evaluate, load
from optisense.design import set_value
from optisense.design.responses import USUAL_RESPONSE
from optisense.errors import ObjectiveError
from optisense.objectives import BUILT_IN, Evaluation, Objective, Press, Settings
from optisense.objectives._exposure import MOST_SATURATED, exposure_for
from optisense.objectives.normdiff import SAMPLE_SHARE, indented_pixels
from optisense.objectives.registry import find, pixels_read
from optisense.objectives.rgb2normal import lines_of
from optisense.objectives.run import IMAGES_SHARE, Scoring
from optisense.objectives.scoring import score_of
from optisense.optics.radiance_cache import store
from optisense.optics.radiance_cache.tracing_limits import MAX_SINGLE_PASS
from optisense.optics.transport.photons import trace_photons

SMALL: dict[str, Any] = {
    "resolution": (160, 120),
    "ray_resolution": (80, 60),
    "photons": 300_000,
    "places": ((0.0, 0.0), (4.0, 3.0)),
}


@pytest.fixture(scope="module")
def evaluation(model: OpticalModel) -> Evaluation:
    return Evaluation(model, Settings(**SMALL))


def own(function: Callable[..., Any]) -> Objective:
    return Objective("own", function, "Own")


def test_all_four_score_a_gelsight_mini(evaluation: Evaluation) -> None:
    scores = evaluate(evaluation, BUILT_IN)
    assert list(scores) == list(BUILT_IN)
    assert all(score.failure is None for score in scores.values())
    assert 0.8 < scores["rgb2normal"].value < 1.0
    assert -90 < scores["normdiff"].value < 0
    # Seen through glass and gel, within 26 degrees of upright at the picture's sides.
    assert np.cos(np.radians(26)) < scores["aoap"].value < 1.01
    assert scores["2to3pw"].value > 10


def test_images_are_rendered_once_for_all_objectives(
    model: OpticalModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    rendered, traced = [], []
    render, chief_rays = OpticalModel.render, OpticalModel.chief_rays

    def counted(self: OpticalModel, contacts: Any = (), **options: Any) -> Any:
        rendered.append(len(contacts))
        return render(self, contacts, **options)

    def counted_rays(self: OpticalModel, resolution: Any = None, contacts: Any = ()) -> Any:
        traced.append(resolution)
        return chief_rays(self, resolution, contacts)

    monkeypatch.setattr(OpticalModel, "render", counted)
    monkeypatch.setattr(OpticalModel, "chief_rays", counted_rays)
    shared = Evaluation(model, Settings(**SMALL))
    evaluate(shared, ["aoap", "2to3pw"])
    assert rendered == []
    assert traced == [(160, 120), SMALL["ray_resolution"]]  # how much is seen comes first
    evaluate(shared, ["rgb2normal", "normdiff"])
    evaluate(shared, "normdiff", noise=0.1)
    assert sorted(rendered) == [0, 1, 1]


def test_places_in_one_image_score_as_one_by_one(
    model: OpticalModel, evaluation: Evaluation
) -> None:
    together = evaluate(Evaluation(model, Settings(**SMALL, together=True)), "rgb2normal")
    alone = evaluate(evaluation, "rgb2normal")
    for one, other in zip(together.parts["places"], alone.parts["places"], strict=True):
        assert one["pixels"] == other["pixels"]
        assert one["score"] == pytest.approx(other["score"], abs=0.02)


@pytest.mark.parametrize(("specularity", "apart"), [(0.0, SCORE_ROUNDING), (0.6, 0.003)])
def test_pixels_that_are_not_read_make_no_difference(specularity: float, apart: float) -> None:
    """RGB2Normal reads lines across the contacts. The rest of them, rendered roughly where nobody
    reads it, can change no more than the exposure, where highlights bind it.
    """
    sensor = OpticalModel(
        set_value(load("gelsight-mini-ideal"), "coating.specularity", specularity)
    )
    alone = evaluate(sensor, "rgb2normal", **SMALL)
    shared = evaluate(sensor, ["rgb2normal", "aoap", "normdiff"], **SMALL)["rgb2normal"]
    assert alone.value == pytest.approx(shared.value, abs=apart)
    assert alone.parts["worst_line"] == pytest.approx(shared.parts["worst_line"], abs=4 * apart)


def test_lines_are_rendered_in_full_and_the_rest_roughly(model: OpticalModel) -> None:
    """The same samples on the lines as where all is read, and more noise beside them."""
    reads = pixels_read([find("rgb2normal"), find("aoap")], {"rgb2normal": {"directions": 4}})
    careful = Evaluation(model, Settings(**SMALL), reads=reads).presses
    for some, all_of in zip(careful, Evaluation(model, Settings(**SMALL)).presses, strict=True):
        line = np.logical_or.reduce(list(lines_of(all_of, 4).values()))
        assert same_light(some.response[line], all_of.response[line])
        beside = all_of.mask & ~line
        off = some.response[beside] / all_of.response[beside] - 1.0
        assert 0.002 < np.abs(off).mean() < 0.1
        assert np.array_equal(some.mask, all_of.mask)


def test_an_objective_that_does_not_say_what_it_reads_gets_all() -> None:
    assert pixels_read([find("rgb2normal"), own(len)], {}) is None
    assert pixels_read([find("normdiff"), own(len)], {}) is None


def test_each_pixel_gets_the_most_that_any_objective_wants(model: OpticalModel) -> None:
    """Lines get all samples, pixels beside them most, and the flat middle few."""
    press = Evaluation(model, Settings(**SMALL)).presses[0]
    reads = pixels_read([find("rgb2normal"), find("normdiff")], {})
    assert reads is not None
    part = reads(press)
    line = np.logical_or.reduce(list(lines_of(press).values()))
    turned = indented_pixels(press)
    assert (part[line] == 1.0).all()
    assert (part[turned & ~line] == SAMPLE_SHARE).all()
    assert (part[~turned & ~line] == 0.0).all()
    assert 0.5 < SAMPLE_SHARE < 1.0 and (turned & ~line).sum() > 10


def test_contacts_that_overlap_are_not_put_in_one_image(model: OpticalModel) -> None:
    near = {**SMALL, "places": ((0.0, 0.0), (1.5, 0.0))}
    presses = Evaluation(model, Settings(**near, together=True)).presses
    # Each press is whole.
    assert presses[0].mask.sum() == pytest.approx(presses[1].mask.sum(), rel=0.1)


@pytest.mark.parametrize("together", [False, True])
def test_what_the_camera_reads_is_the_whole_image_saturated(
    model: OpticalModel, together: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Near the wells' limit, so that overexposure spreads from the contacts.
    monkeypatch.setattr(Press, "check", lambda press: None)
    settings = {**SMALL, "places": ((0.0, 0.0), (-7.0, 4.0)), "together": together}
    judged = Evaluation(model, Settings(**settings, exposure=1200.0))
    background = judged.untouched.radiance
    overexposed = 0
    pairs = list(judged.each_press())
    monkeypatch.setattr(judged, "each_press", lambda: iter(pairs))  # else they differ by rounding
    for press, (_, image) in zip(judged.presses, pairs, strict=True):
        touched = image.contact_mask[..., None]
        whole = np.where(touched, image.radiance, background) * judged.exposure
        overexposed += int((whole > 1).sum())
        assert np.array_equal(press.response, USUAL_RESPONSE.respond(whole))
    assert overexposed > 10


@pytest.mark.slow
def test_a_gelsight_mini_is_as_linear_as_a_real_one(model: OpticalModel) -> None:
    # Read by these functions, seven published presses of a real one, up to 21 to 34 degrees,
    # score 0.927 to 0.987. A press of 0.2 mm reaches 30 degrees.
    score = evaluate(model, "rgb2normal", depth=0.2, together=True, resolution=(320, 240))
    assert 0.927 < score.value < 0.987


def test_presses_know_where_they_are(evaluation: Evaluation) -> None:
    middle, aside = evaluation.presses
    right, up, _ = evaluation.design.camera.axes()
    assert middle.east == pytest.approx(right, abs=1e-6)
    assert middle.north == pytest.approx(up, abs=1e-6)
    assert (aside.place - middle.place) @ right == pytest.approx(4.0, abs=1e-3)
    for press in (middle, aside):
        seen = press.points[press.mask] - press.centre
        assert np.linalg.norm(seen, axis=1) == pytest.approx(1.5, abs=0.01)
        normals = press.normals[press.mask]
        assert (seen / 1.5 * normals).sum(axis=1).min() > 0.99


def test_one_objective_gives_a_score_and_several_a_dict(evaluation: Evaluation) -> None:
    assert isinstance(evaluate(evaluation, "aoap"), Score)
    assert set(evaluate(evaluation, ["aoap"])) == {"aoap"}


def test_a_design_can_be_scored_without_a_model() -> None:
    score = evaluate(
        load("gelsight-mini-ideal"), "aoap", ray_resolution=(40, 30), coverage_weight=0.0
    )
    assert score.value == score.parts["mean_cosine"]


def raises_in_numpy(evaluation: Evaluation) -> float:
    return float(np.asarray(evaluation.presses[0].colours).std())


def raises(evaluation: Evaluation) -> float:
    raise KeyError("gel")


def test_a_built_in_objective_names_the_line_of_the_users_code_that_failed() -> None:
    """Such as that of a kind of camera whose methods the objective calls."""
    failure = score_of(find("aoap"), lambda: 1 / 0).failure
    assert failure is not None
    assert re.search(r"ZeroDivisionError: .*test_evaluate.py:\d+", failure)


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (raises, r"KeyError: 'gel' .*test_evaluate.py:\d+"),
        (raises_in_numpy, r"TypeError: .*test_evaluate.py:\d+"),
        (lambda evaluation: float("nan"), "returned nan"),
        (lambda evaluation: math.inf, "returned inf"),
        (lambda evaluation: "good", "returned a str"),
        (lambda evaluation: None, "returned a NoneType"),
        (lambda evaluation: True, "returned a bool"),
        (lambda evaluation: np.ones(3), "returned a ndarray"),
        (lambda evaluation: (1.0, [2.0]), "returned a tuple"),
        (lambda evaluation: (1.0, {"model": object()}), "can't be written as JSON"),
        (lambda evaluation: Score("own", math.nan, "no light"), "no light"),
    ],
)
def test_an_objective_that_fails_says_why_and_the_others_go_on(
    evaluation: Evaluation, function: Callable[..., Any], reason: str
) -> None:
    scores = evaluate(evaluation, [own(function), "aoap"])
    failed = scores["own"]
    assert math.isnan(failed.value)
    assert failed.failure is not None
    assert re.search(reason, failed.failure), failed.failure
    assert failed.to_dict()["value"] is None
    assert html.escape(failed.failure) in failed._repr_html_()
    assert failed.figure() is not None
    assert scores["aoap"].failure is None


@pytest.mark.parametrize(
    "result",
    [2.0, 2, np.float32(2), np.int64(2), (2.0, {"a": 1}), Score("other", 2.0)],
    ids=repr,
)
def test_what_an_objective_may_return(evaluation: Evaluation, result: Any) -> None:
    score = evaluate(evaluation, own(lambda evaluation: result))
    assert score.value == 2.0
    assert score.objective == "own"


def test_a_score_of_zero_has_no_sign() -> None:
    assert str(score_of(find("aoap"), lambda: -0.0).value) == "0.0"


@pytest.mark.parametrize("wrong", [5, None, ["aoap", 5], lambda evaluation: 1.0])
def test_what_is_no_objective_is_refused(evaluation: Evaluation, wrong: Any) -> None:
    with pytest.raises(ObjectiveError, match="is no objective"):
        evaluate(evaluation, wrong)


def test_ctrl_c_is_not_a_failure(evaluation: Evaluation) -> None:
    def stopped(evaluation: Evaluation) -> float:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate(evaluation, own(stopped))


def test_light_cut_short_by_ctrl_c_gives_no_score(
    model: OpticalModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    traced = 0

    def cut_short(*arguments: Any, **options: Any) -> Any:
        nonlocal traced
        if traced == 1:
            raise KeyboardInterrupt
        traced += 1
        return trace_photons(*arguments, **options)

    monkeypatch.setattr(store, "trace_photons", cut_short)
    with pytest.raises(KeyboardInterrupt):  # after the first of several passes
        evaluate(model, "rgb2normal", **{**SMALL, "photons": 2 * MAX_SINGLE_PASS, "seed": 77})
    assert traced == 1


def test_progress_only_grows(model: OpticalModel) -> None:
    told: list[float] = []
    evaluate(model, "rgb2normal", progress=lambda done, text: told.append(done), **SMALL)
    assert told[0] == 0.0
    assert told[-1] == pytest.approx(1.0)
    assert all(np.diff(told) >= -1e-9)


def test_the_progress_of_several_objectives_has_images_and_their_titles(
    model: OpticalModel,
) -> None:
    told: list[tuple[float, str, str]] = []
    both = [find("rgb2normal"), find("aoap")]
    scores = list(Scoring(model, both, SMALL, lambda *said: told.append(said)))
    assert [score.objective for score in scores] == ["rgb2normal", "aoap"]
    done = [fraction for fraction, _, _ in told]
    assert done[0] == 0.0 and done[-1] == pytest.approx(1.0) and done == sorted(done)
    rendered = max(fraction for fraction, _, step in told if step)
    assert rendered == pytest.approx(IMAGES_SHARE)
    assert told[0][1:] == (both[0].title, "") and told[-1][1:] == (both[1].title, "")


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"places": ((11.0, 9.0),)}, "does not see place 1"),
        ({"places": ((0.0, 0.0), (90.0, 0.0))}, "off the sensing surface"),
        ({"resolution": (16, 12)}, "needs"),
        ({"resolution": (1, 1)}, "in 1 x 1 pixels. Use a higher resolution"),
        ({"exposure": 1e6}, "overexposed"),
        ({"exposure": 1e-9}, "black"),
    ],
    ids=str,
)
@pytest.mark.parametrize("name", ["rgb2normal", "normdiff"])
def test_presses_that_can_not_be_judged_have_a_reason(
    model: OpticalModel, name: str, settings: dict[str, Any], reason: str
) -> None:
    small = {**SMALL, "resolution": (80, 60), "photons": 100_000, **settings}
    score = evaluate(model, name, **small)
    assert score.failure is not None
    assert reason in score.failure


@pytest.mark.parametrize("name", ["aoap", "2to3pw"])
def test_a_camera_that_looks_away_has_a_reason(name: str) -> None:
    design = set_value(load("gelsight-mini-ideal"), "camera.direction", [0, 0, -1])
    score = evaluate(OpticalModel(design, "llvm"), name, ray_resolution=(20, 16))
    assert score.failure is not None
    assert "sees" in score.failure


def test_settings_of_a_settled_evaluation_can_not_change(evaluation: Evaluation) -> None:
    with pytest.raises(ObjectiveError, match="settings already: depth"):
        evaluate(evaluation, "aoap", depth=0.2)


def test_scores_travel_to_other_processes(evaluation: Evaluation) -> None:
    for score in evaluate(evaluation, BUILT_IN).values():
        back = pickle.loads(pickle.dumps(score))
        assert back == score
        assert back.to_dict() == score.to_dict()
        assert back.figure() is not None


def test_a_sensor_with_one_colour_confuses_more_than_one_with_three(
    model: OpticalModel, evaluation: Evaluation
) -> None:
    design = model.design
    for name in design.lights:
        design = set_value(design, f"lights.{name}.colour", [1, 1, 1])
    grey = evaluate(OpticalModel(design, "llvm"), "normdiff", **SMALL)
    coloured = evaluate(evaluation, "normdiff")
    assert grey.value < 1.2 * coloured.value < 0


def test_automatic_exposure_leaves_a_contact_its_highlights_and_no_more() -> None:
    """Nothing else changes the exposure: not a contact that is dimmer than the wells are deep."""
    random = np.random.default_rng(1)
    untouched = random.uniform(0.5, 1.0, (40, 50, 3)).astype(np.float32)
    dim = random.uniform(0.0, 1.0, (500, 3)).astype(np.float32)
    usual = USUAL_RESPONSE.auto_exposure(untouched)
    assert exposure_for(untouched, []) == usual
    assert exposure_for(untouched, [dim]) == usual
    shiny, shinier = 8.0 * dim, 30.0 * dim
    found = exposure_for(untouched, [dim, shinier, shiny])
    assert found == exposure_for(untouched, [shinier, dim])
    overexposed = (found * shinier.max(axis=1) > 1.0).mean()
    assert 0.5 * MOST_SATURATED < overexposed <= MOST_SATURATED
