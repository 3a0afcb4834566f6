"""Light adds up: presses under other lights, from layers, are those that a camera would see."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from comparing import SCORE_ROUNDING, same_light
from pressed_balls import Presses, pressed_ball

import optisense as ots
from optisense import library
from optisense.design import SensorDesign, set_value
from optisense.errors import ObjectiveError
from optisense.objectives import Evaluation, Press, Settings, evaluate, find
from optisense.objectives.relighting import Relighting
from optisense.optics import OpticalModel

SMALL = Settings(
    resolution=(200, 150), photons=200_000, places=((0.0, 0.0), (3.0, 2.0)), radius=2.0
)
SETTINGS = [
    ("rgb2normal", {}),
    ("rgb2normal", {"half_lines": True, "directions": 3, "colours": "response"}),
    ("normdiff", {}),
    ("normdiff", {"noise": 0.1, "phi_weight": 0.4, "colours": "picture"}),
]


@pytest.fixture(scope="module")
def relighting() -> Relighting:
    return Relighting(Evaluation(OpticalModel(ots.load("gelsight-mini-ideal")), SMALL))


def recoloured(seed: int, brightness: float = 1.0) -> SensorDesign:
    """A GelSight Mini whose groups have other colours and powers."""
    random = np.random.default_rng(seed)
    design = ots.load("gelsight-mini-ideal")
    for name in design.lights:
        design = set_value(design, f"lights.{name}.colour", tuple(random.random(3).tolist()))
        design = set_value(design, f"lights.{name}.flux", brightness * random.uniform(1.0, 9.0))
    return design


def test_presses_are_those_of_a_rendering_under_these_lights(relighting: Relighting) -> None:
    design = recoloured(1)
    rendered = Evaluation(OpticalModel(design), SMALL)
    relit = relighting.relit(design)
    assert relit.exposure == pytest.approx(rendered.exposure, rel=1e-5)
    for one, other in zip(relit.presses, rendered.presses, strict=True):
        assert (one.mask == other.mask).all()
        assert same_light(one.response, other.response)


def test_an_objective_may_render_further_images_with_the_model(relighting: Relighting) -> None:
    design = recoloured(4)
    small = {"resolution": (40, 30), "photons": 20_000}
    usual = relighting.model.render(**small).radiance
    relit = relighting.relit(design).model
    assert relit.design == design
    assert same_light(relit.render(**small).radiance, OpticalModel(design).render(**small).radiance)
    assert same_light(relighting.model.render(**small).radiance, usual)


def test_presses_are_those_of_a_rendering_through_all_that_a_camera_does() -> None:
    """Shading and noise belong to places of the picture, and blur reaches into what is cut."""
    design = library.with_imaging(ots.load("gelsight-mini-ideal"), "pi-v2", focus_distance=24.0)
    evaluation = Evaluation(OpticalModel(design), SMALL)
    relighting = Relighting(Evaluation(evaluation.model, SMALL))
    flux = relighting.flux_of(design)
    assert relighting.exposure(flux) == pytest.approx(evaluation.exposure, rel=1e-5)
    whole, cut = relighting.presses(flux, whole=True), relighting.presses(flux)
    for seen, one, other in zip(evaluation.presses, whole, cut, strict=True):
        assert np.abs(one.response[one.mask] - seen.response[seen.mask]).max() < 1e-3
        assert np.abs(other.response[other.mask] - one.response[one.mask]).max() < 1e-3
    calm = evaluation.model.picture_chain.without_noise().respond(
        evaluation.untouched.radiance * np.float32(evaluation.exposure)
    )
    noise = evaluation.presses[0].response - calm
    assert 0.01 < noise[~evaluation.presses[0].mask].std() < 0.1


@pytest.mark.parametrize("exposure", ["auto", 500.0, 2500.0])
def test_cut_presses_hold_the_same_colours(
    relighting: Relighting, exposure: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where overexposure spreads from beside the contact into it."""
    changed = Settings(**{**vars(SMALL), "exposure": exposure})
    monkeypatch.setattr(relighting, "settings", changed)
    monkeypatch.setattr(Press, "check", lambda press: None)
    flux = relighting.flux_of(recoloured(2))
    whole = relighting.presses(flux, whole=True)
    brightest = np.concatenate([each.response[each.mask].max(axis=1) for each in whole])
    for one, other in zip(relighting.presses(flux), whole, strict=True):
        assert one.mask.sum() == other.mask.sum()
        assert (one.response[one.mask] == other.response[other.mask]).all()
    if exposure == 2500.0:  # else nothing would have spread
        assert 0.05 < (brightest == 1.0).mean() < 0.95


@pytest.mark.parametrize(("name", "own"), SETTINGS)
def test_scores_of_cut_presses_are_those_of_whole_ones(
    relighting: Relighting, name: str, own: dict[str, Any]
) -> None:
    """Also of one light after another, whose presses share what follows from their shape."""
    for seed in range(3, 7):
        design = recoloured(seed)
        whole = evaluate(relighting.relit(design), name, **own)
        cut = evaluate(relighting.relit(design, whole=False), name, **own)
        assert whole.failure is None and cut.failure is None
        assert cut.value == pytest.approx(whole.value, rel=1e-12)
        for one, other in zip(cut.parts["places"], whole.parts["places"], strict=True):
            assert one["score"] == pytest.approx(other["score"], rel=1e-12)


def test_brighter_lights_of_the_same_colours_change_nothing(relighting: Relighting) -> None:
    """Automatic exposure compensates for the power of the lights."""
    design = recoloured(8)
    brighter = design
    for name, group in design.lights.items():
        brighter = set_value(brighter, f"lights.{name}.flux", 7.0 * group.flux)
    for name in ("rgb2normal", "normdiff"):
        one, other = (evaluate(relighting.relit(each), name).value for each in (design, brighter))
        assert one == pytest.approx(other, rel=SCORE_ROUNDING)


def test_one_colour_for_all_pixels_tells_no_normal() -> None:
    press = pressed_ball(lambda n: np.full((len(n), 3), 0.3))
    value, parts, _ = find("rgb2normal")(Presses(press))
    assert (value, parts["worst_line"]) == (0.0, 0.0)


def test_darkness_is_a_failure_and_not_a_score(relighting: Relighting) -> None:
    design = recoloured(9, brightness=1e-12)
    relit = relighting.relit(set_value(design, "name", "dark"))
    assert evaluate(relit, "rgb2normal").failure is None  # the exposure follows
    flux = np.zeros((len(relighting.groups), 3))
    with pytest.raises(ObjectiveError, match="is black"):
        relighting.presses(flux)


def test_other_light_groups_are_refused(relighting: Relighting) -> None:
    design = ots.load("gelsight-mini-ideal")
    del design.lights[next(iter(design.lights))]
    with pytest.raises(ObjectiveError, match="other light groups"):
        relighting.relit(design)
