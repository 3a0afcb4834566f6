"""A fit finds the numbers of synthetic photographs, and names those that they do not determine."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.calibration import Photographs, photograph_model, save_photographs
from optisense.calibration._body_changes import with_lights_moved, with_single_lights
from optisense.calibration._gauss_newton import LayeredFit
from optisense.calibration._least_squares import Solution
from optisense.calibration.calibrating import _with_exposure, calibrate
from optisense.calibration.families import chosen_families
from optisense.calibration.model_pictures import LayeredPictures, layered_pictures
from optisense.calibration.quantities import designed, quantities_of
from optisense.calibration.realism import Realism, distances
from optisense.calibration.result import (
    ADVICE,
    Calibration,
    fitted_numbers,
    with_known_total,
)
from optisense.calibration.seen_contacts import SeenContact
from optisense.calibration.settings import CalibrationSettings
from optisense.cli import app
from optisense.design import Status, get_value, set_value
from optisense.errors import CalibrationError
from optisense.kept_arrays import KeptArrays
from optisense.sensors import gelsight_mini_ideal

from .conftest import BALLS, PHOTONS, SMALLER, numbers_of_fit, with_pictures

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

CHEAP = ("powers", "colours", "tone", "black", "shading")
"""Families of numbers that are fitted without a rendering."""

HIDDEN = {
    "lights.red.flux": 1.5,
    "lights.blue.flux": 3.2,
    "camera.colour_matrix[0][2]": -0.3,
    "camera.colour_matrix[1][0]": 0.15,
    "camera.tone_curve.gamma": 1.5,
    "camera.stray_light[0]": 0.02,
    "camera.stray_light[1]": 0.06,
    "camera.shading.falloff": 0.35,
    "camera.shading.red_falloff": 0.5,
}
"""Numbers of the photographed sensor that differ from those of the start."""

LOWER_AND_POWERS = "lights.blue.along", "lights.red.flux", "lights.green.flux", "lights.blue.flux"
"""Numbers of a fit that finds the height of a row of lights."""


def hidden_steps(chosen: list) -> np.ndarray:  # type: ignore[type-arg]
    """How far the hidden numbers are from the starts, in plausible ranges."""
    found = []
    for each in chosen:
        value = HIDDEN.get(each.path, each.start)
        off = np.log(value / each.start) if each.logarithmic else value - each.start
        found.append(off / each.plausible_range)
    return np.array(found)


def test_hidden_numbers_are_found_within_their_uncertainties(
    smaller_photographs: Photographs, seen: list[SeenContact], layers: LayeredPictures
) -> None:
    chosen = quantities_of(ots.load("gelsight-mini-ideal"), CHEAP)
    exposure = 250.0
    still = np.zeros((len(seen), 3))
    start = np.zeros(len(chosen))
    truth = hidden_steps(chosen)
    made = LayeredFit(smaller_photographs, seen, layers, chosen, exposure, start, {})
    moved = np.tile([0.25, -0.15, 0.05], (len(seen), 1))
    rng = np.random.default_rng(1)
    pictures = []
    for levels in made.pictures(truth, moved):
        noisy = levels + 2.0 * rng.standard_normal(levels.shape)
        noisy[30:33, 20:24] = 230.0  # dust
        pictures.append(noisy)
    real = with_pictures(smaller_photographs, pictures)
    fit = LayeredFit(real, seen, layers, chosen, exposure, start, {})
    found = fit.solve(start, still)
    deviations = np.sqrt(np.diag(found.covariance))
    assert np.abs(found.steps - truth).max() < 0.15  # of a range of two to each side: below 5 %
    assert (np.abs(found.steps - truth) < 3.0 * deviations).all(), (found.steps - truth, deviations)
    assert np.abs(found.contacts - moved).max() < 0.2
    assert found.errors[1] < 3.5


def test_a_number_leaves_its_limit_where_the_photographs_ask_for_it(
    smaller_photographs: Photographs, seen: list[SeenContact], layers: LayeredPictures
) -> None:
    """Beyond a limit a number has no derivative, so that a fit would stay there."""
    chosen = quantities_of(ots.load("gelsight-mini-ideal"), ["shading"])
    still, start = np.zeros((len(seen), 3)), np.zeros(len(chosen))
    truth, stuck = start.copy(), start.copy()
    truth[0], stuck[0] = (0.6 - 0.2) / chosen[0].plausible_range, chosen[0].limits()[1]
    made = LayeredFit(smaller_photographs, seen, layers, chosen, 250.0, start, {})
    real = with_pictures(smaller_photographs, made.pictures(truth, still))
    fit = LayeredFit(real, seen, layers, chosen, 250.0, start, {})
    found = fit.solve(stuck, still)
    assert chosen[0].value(float(found.steps[0])) == pytest.approx(0.6, abs=0.02)
    assert (found.steps <= [each.limits()[1] for each in chosen]).all()


def test_what_a_change_of_contact_does_is_known_without_rendering(
    mini: OpticalModel,
    smaller_photographs: Photographs,
    seen: list[SeenContact],
    layers: LayeredPictures,
) -> None:
    fit = LayeredFit(smaller_photographs, seen, layers, [], 250.0, np.zeros(0), {})
    moved = [
        SeenContact((place.centre[0] + 0.4, place.centre[1] - 0.2), place.radius * 1.08)
        for place in seen
    ]
    other = layered_pictures(mini, smaller_photographs, moved, PHOTONS, 5)
    again = LayeredFit(smaller_photographs, moved, other, [], 250.0, np.zeros(0), {})
    none = np.zeros(0)
    amount = np.tile([0.4, -0.2, np.log(1.08)], (len(seen), 1))
    rough = fit.pictures(none, amount)
    still = fit.pictures(none, 0.0 * amount)
    exact = again.pictures(none, 0.0 * amount)
    for index, place in enumerate(seen, start=1):
        near = distances(smaller_photographs.background.shape, place) <= 1.6
        change, told = (exact[index] - still[index])[near], (rough[index] - still[index])[near]
        cosine = (change * told).sum() / np.sqrt((change**2).sum() * (told**2).sum())
        length = np.sqrt((told**2).sum() / (change**2).sum())
        assert cosine > 0.6, (cosine, length)
        assert 0.5 < length < 1.5, (cosine, length)


def test_fitted_numbers_become_a_design() -> None:
    design = ots.load("gelsight-mini-ideal")
    chosen = quantities_of(design, [*CHEAP, "view", "place"], [("coating.specularity", 0.0, 0.4)])
    steps = np.linspace(-0.5, 0.5, len(chosen))
    made = designed(design, chosen, steps)
    for each, step in zip(chosen, steps, strict=True):
        if each.change is None:
            assert get_value(made, each.path) == pytest.approx(each.value(float(step)))
    right, up, ahead = design.camera.axes()
    moved = np.array(made.camera.position) - design.camera.position
    assert abs(moved @ ahead) < 1e-9
    assert moved @ right == pytest.approx(chosen[-3].value(float(steps[-3])))
    assert moved @ up == pytest.approx(chosen[-2].value(float(steps[-2])))
    assert design.camera.tone_curve is None


def test_an_uncertain_power_makes_powers_of_a_kept_sum_uncertain() -> None:
    """By the spread of powers that are drawn, and then scaled to the same sum."""
    design = ots.load("gelsight-mini-ideal")
    chosen = quantities_of(design, ["powers", "tone"])
    deviations = np.array([0.002, 0.03, 0.001, 0.05])
    steps = np.array([0.1, -0.2, 0.3, 0.0])
    solution = Solution(steps, np.zeros((0, 3)), np.diag(deviations**2), (0.0, 0.0), np.zeros(0))
    fitted = designed(design, chosen, steps)
    scaled = with_known_total(chosen, solution, fitted)
    numbers = fitted_numbers(chosen, scaled, fitted)
    assert numbers[3].before is None  # the design has no tone curve
    assert numbers[0].before == design.lights["red"].flux
    drawn = steps + deviations * np.random.default_rng(1).standard_normal((20_000, 4))
    powers = np.array(
        [[each.value(row[index]) for index, each in enumerate(chosen[:3])] for row in drawn]
    )
    total = sum(number.after for number in numbers[:3])
    powers *= total / powers.sum(axis=1, keepdims=True)  # as many lights in each group
    assert [n.uncertainty for n in numbers[:3]] == pytest.approx(powers.std(axis=0), rel=0.03)
    assert scaled.covariance[3, 3] == solution.covariance[3, 3]


def test_a_power_with_a_range_counts_once_and_changes_no_other() -> None:
    design = ots.load("gelsight-mini-ideal")
    chosen = quantities_of(design, [], [("lights.red.flux", 1.0, 8.0)])
    assert [each.renders for each in chosen] == [False]  # the layers are mixed by its factor
    fitted, exposure = _with_exposure(design, chosen, np.array([0.5]), 250.0)
    assert exposure == 250.0
    powers = {name: group.flux for name, group in fitted.lights.items()}
    kept = {name: group.flux for name, group in design.lights.items()}
    assert powers == kept | {"red": chosen[0].value(0.5)}
    solution = Solution(np.zeros(1), np.zeros((0, 3)), np.eye(1), (0.0, 0.0), np.zeros(0))
    assert with_known_total(chosen, solution, fitted) is solution
    dark = set_value(design, "lights.red.flux", 0.0)
    with pytest.raises(CalibrationError, match="is 0, and is fitted by factors"):
        quantities_of(dark, [], [("lights.red.flux", 0.0, 8.0)])


@pytest.mark.parametrize(
    ("families", "asked", "words"),
    [
        (["colors"], [], "nothing called 'colors'"),
        ([], [("camera.fov", 60.0, 70.0)], "does not contain its value"),
        (["view"], [("camera.fov", 20.0, 70.0)], "fitted twice"),
        ([], [("camera.projection", 0.0, 1.0)], "is no number"),
    ],
)
def test_what_makes_no_sense_is_refused(
    families: list[str], asked: list[tuple[str, float, float]], words: str
) -> None:
    with pytest.raises(CalibrationError, match=words):
        quantities_of(ots.load("gelsight-mini-ideal"), families, asked)


def test_too_few_photographs_are_refused_before_the_work(photographs: Photographs) -> None:
    design = ots.load("gelsight-mini-ideal")
    with pytest.raises(CalibrationError, match="1 press can't determine"):
        calibrate(design, photographs.subset([0]))
    others = CalibrationSettings(held_out=("press-01.png", "press-02.png"))
    with pytest.raises(CalibrationError, match="1 press can't determine"):
        calibrate(design, photographs, others)
    misspelt = CalibrationSettings(held_out=("press-1.png",))
    with pytest.raises(CalibrationError, match=r"no press 'press-1\.png'") as raised:
        calibrate(design, photographs, misspelt)
    assert "press-01.png" in (raised.value.hint or "")
    empty = replace(photographs.presses[0], name="empty.png", picture=photographs.background)
    more = replace(photographs, presses=(*photographs.presses, empty))
    settings = CalibrationSettings(held_out=("empty.png",))
    with pytest.raises(CalibrationError, match=r"'empty\.png' shows no contact"):
        calibrate(design, more, settings)


def test_a_design_is_fitted_and_marked(small_photographs: Photographs, tmp_path: Path) -> None:
    save_photographs(tmp_path / "photos", small_photographs)
    design = ots.load("gelsight-mini-ideal")
    start = set_value(design, "lights.red.flux", 0.5 * design.lights["red"].flux)
    ots.save_design(start, tmp_path / "start")
    kept = [word for name in ("view", "place", *CHEAP[2:]) for word in ("--keep", name)]
    run = CliRunner().invoke(
        app,
        ["calibrate", str(tmp_path / "start"), str(tmp_path / "photos"), "--rounds", "1", *kept]
        + ["--photons", "60000", "--out", str(tmp_path / "fitted")],
    )
    assert run.exit_code == 0, run.output
    fitted = ots.load(tmp_path / "fitted")
    ratio = fitted.lights["red"].flux / fitted.lights["green"].flux
    assert ratio == pytest.approx(1.0, rel=0.12)
    marked = fitted.provenance["lights.red.flux"]
    assert marked.status is Status.CALIBRATED
    data = json.loads((tmp_path / "fitted" / "calibration.json").read_text("utf-8"))
    assert data["photographs"]["press-02.png"][:12] in marked.source
    assert data["held_out"] == ["press-03.png"]
    assert data["after"]["background"]["ratio"] > data["before"]["background"]["ratio"] + 3.0
    assert "The fitted design predicts the presses held out" in run.output.replace("\n", " ")
    page = (tmp_path / "fitted" / "calibration.html").read_text("utf-8")
    assert data["verdict"] in page
    assert "press-03.png" in page
    assert "<script" not in page


@pytest.mark.parametrize(
    ("unexplained", "ratio", "words"),
    [
        (0.0101, 36.5, "as well as before: 0.010 of their energy is unexplained, 0.010 before."),
        (0.0101, 23.1, "; but the untouched sensor worse: 23.1 dB, 37.0 before. Keep the design"),
        (0.005, 37.0, "better: 0.005"),
        (0.005, 23.1, "; but the untouched sensor worse: 23.1 dB, 37.0 before."),
        (0.02, 37.0, "worse: 0.020 of their energy is unexplained, 0.010 before. Keep the design"),
    ],
)
def test_a_verdict_is_about_the_background_too(
    unexplained: float, ratio: float, words: str
) -> None:
    def side(unexplained: float, ratio: float) -> SimpleNamespace:
        press = SimpleNamespace(name="a", unexplained=unexplained)
        background = SimpleNamespace(ratio=ratio)
        return SimpleNamespace(realism=Realism(background, (press,), 1.0))  # type: ignore[arg-type]

    sides = side(0.01, 37.0), side(unexplained, ratio)
    found = Calibration(gelsight_mini_ideal(), 1.0, (), (), *sides, ("a",), ())  # type: ignore[arg-type]
    assert words in found.verdict()
    assert (ADVICE in found.verdict()) == ("Keep the design" in words)


def test_an_interrupted_calibration_goes_on_where_it_was(
    mini: OpticalModel, small_photographs: Photographs, tmp_path: Path
) -> None:
    """The renderings of the first round are taken again, and the fit is the same."""
    settings = CalibrationSettings(families=("powers",), rounds=1, photons=20_000, held_out=())
    two = small_photographs.subset([0, 1])
    design = mini.design
    kept = KeptArrays(tmp_path / "renderings")

    def stop(what: str, done: int, count: int) -> None:
        if what == "fitting":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        calibrate(design, two, settings, kept=kept, progress=stop)
    files = sorted((tmp_path / "renderings").iterdir())
    assert len(files) == 3  # the background and two presses
    times = [file.stat().st_mtime_ns for file in files]
    whole = files[0].read_bytes()
    files[0].write_bytes(whole[:1000])  # as of a disk that was full
    seen: list[str] = []
    found = calibrate(design, two, settings, kept=kept, progress=lambda what, *_: seen.append(what))
    assert "comparing" in seen
    assert [file.stat().st_mtime_ns for file in files][1:] == times[1:]
    assert files[0].stat().st_size == len(whole)
    kept.remove()
    assert not (tmp_path / "renderings").exists()
    again = calibrate(design, two, settings)
    for one, other in zip(found.numbers, again.numbers, strict=True):
        assert one.after == pytest.approx(other.after, rel=1e-5)  # sums of threads are rounded


def test_a_dim_light_of_a_row_is_found(mini: OpticalModel) -> None:
    # Kernels are compiled for a number of groups: three single lights are as many as other tests
    # have, and compile nothing.
    start = mini.design.model_copy(deep=True)
    row = start.lights["red"]
    start.lights = {"red": row.model_copy(update={"lights": row.lights[::2]})}
    design = with_single_lights(start)
    real = ots.OpticalModel(set_value(design, "lights.red-2.flux", 1.0))
    shown = photograph_model(real, BALLS[:2], resolution=SMALLER, photons=200_000, seed=5)
    kept = ["colours", "tone", "black", "shading", "view", "place"]
    settings = CalibrationSettings(
        families=chosen_families(kept, ["leds"]), rounds=1, photons=200_000, held_out=()
    )
    found = calibrate(start, shown, settings)
    power = {each.path.split(".")[1]: each.after for each in found.numbers}
    others = np.mean([power[f"red-{number}"] for number in (1, 3)])
    assert power["red-2"] / others == pytest.approx(1.0 / 2.1, abs=0.2)
    assert list(found.design.lights) == list(design.lights)


def test_a_power_is_found_relative_to_powers_that_are_kept(
    mini: OpticalModel, small_photographs: Photographs
) -> None:
    """The exposure is fitted along: with that of the start, the other powers would be too large."""
    power = mini.design.lights["red"].flux
    start = set_value(mini.design, "lights.red.flux", 0.4 * power)
    settings = CalibrationSettings(families=(), rounds=1, photons=20_000, held_out=())
    chosen = quantities_of(start, [], [("lights.red.flux", 0.1 * power, 3.0 * power)])
    (found,) = numbers_of_fit(start, small_photographs, chosen, settings)
    assert found.after == pytest.approx(power, rel=0.06)
    assert found.determined


def test_a_row_of_lights_that_lies_lower_is_found(mini: OpticalModel) -> None:
    lower = -0.8  # mm; more than twice the step of the difference quotients
    real = ots.OpticalModel(with_lights_moved("blue", mini.design, lower))
    shown = photograph_model(real, BALLS[:2], resolution=SMALLER, photons=200_000, seed=5)
    settings = CalibrationSettings(
        families=chosen_families([], ["lights"]), rounds=3, photons=200_000, held_out=()
    )
    every = quantities_of(mini.design, settings.families)
    chosen = [each for each in every if each.path in LOWER_AND_POWERS]  # one of a body is enough
    found = numbers_of_fit(mini.design, shown, chosen, settings)
    moved = next(each for each in found if each.path == "lights.blue.along")
    assert moved.after == pytest.approx(lower, abs=0.2)
    assert moved.determined
