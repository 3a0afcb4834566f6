"""Manufacturing errors: percentiles and shares of a linear score are known in closed form."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, truncnorm

import optisense as ots
from optisense.design import SensorDesign, set_value
from optisense.errors import DesignError, ObjectiveError, SearchError
from optisense.search import ToleranceDistribution, search
from optisense.search.evaluation.robust import percentile
from optisense.search.space.manufacturing import TRUNCATION, ManufacturingErrors
from optisense.search.tolerance.analysis import Tolerance, tolerance, usual_errors
from optisense.search.tolerance.sensitivity import paired_errors, percentile_of, total_effect

RED, GREEN, BLUE = (f"coating.reflectance.{letter}" for letter in "rgb")
SIGMA = 0.05
WEIGHTS = {RED: 3.0, GREEN: 1.0, BLUE: 0.0}
WITHIN = truncnorm.std(-TRUNCATION, TRUNCATION)
"""Standard deviation of a standard normal error that is truncated."""


@pytest.fixture(scope="module")
def grey(mini: SensorDesign) -> SensorDesign:
    """A design whose reflectance has room on both sides."""
    return set_value(mini, "coating.reflectance", (0.5, 0.5, 0.5))


def linear(design: SensorDesign) -> float:
    return float(np.dot(list(WEIGHTS.values()), design.coating.reflectance))


def product(design: SensorDesign) -> float:
    """Of two numbers, neither of which has an effect by itself."""
    red, green, _ = design.coating.reflectance
    return (red - 0.5) * (green - 0.5)


@pytest.fixture(scope="module")
def result(grey: SensorDesign) -> Tolerance:
    return tolerance(grey, [linear, product], dict.fromkeys(WEIGHTS, SIGMA), sensors=2400)


def test_percentiles_of_a_linear_score(result: Tolerance) -> None:
    """A weighted sum of Gaussian errors (cut at three deviations) has a known distribution."""
    deviation = SIGMA * WITHIN * math.hypot(*WEIGHTS.values())
    found = result.results["linear"]
    assert found.nominal == pytest.approx(2.0)
    assert found.deviation == pytest.approx(deviation, rel=0.02)
    one = SIGMA * truncnorm.ppf((np.arange(1000) + 0.5) / 1000, -TRUNCATION, TRUNCATION)
    sums = 2.0 + np.add.outer(3.0 * one, one)
    for name, share in (("p10", 0.1), ("p50", 0.5), ("p90", 0.9)):
        expected = float(np.quantile(sums, share))
        assert expected == pytest.approx(2.0 + deviation * norm.ppf(share), abs=0.02 * deviation)
        assert found.percentiles[name].value == pytest.approx(expected, abs=0.04 * deviation)
        assert found.percentiles[name].low < expected < found.percentiles[name].high


def test_shares_of_a_linear_score(result: Tolerance) -> None:
    """Each error's share is its own variance over the sum of all."""
    shares = result.results["linear"].shares
    assert list(shares) == [RED, GREEN, BLUE]  # the largest first
    for path, weight in WEIGHTS.items():
        share = shares[path]
        assert share is not None
        assert share.value == pytest.approx(weight**2 / 10.0, rel=0.1, abs=1e-9)
        assert share.low <= share.value <= share.high


def test_errors_that_only_act_together_each_have_the_whole_share(result: Tolerance) -> None:
    """The total effect of each factor of a product of two centred errors is 1."""
    shares = result.results["product"].shares
    for path in (RED, GREEN):
        assert shares[path].value == pytest.approx(1.0, abs=0.2)  # type: ignore[union-attr]
    assert shares[BLUE].value == 0.0  # type: ignore[union-attr]


def test_intervals_hold_the_truth_nine_times_in_ten() -> None:
    bound = ManufacturingErrors({RED: 0.01, GREEN: 0.02}).bind(
        set_value(ots.load("gelsight-mini-ideal"), "coating.reflectance", (0.5, 0.5, 0.5))
    )
    held_share = held_percentile = 0
    for seed in range(60):
        scores = paired_errors(bound, 40, seed).sum(axis=2)
        share = total_effect(scores, 1)
        assert share is not None
        held_share += share.low <= 0.8 <= share.high
        middle = percentile_of(scores, 0.9)
        held_percentile += middle.low <= 0.01 * math.sqrt(5) * WITHIN * norm.ppf(0.9) <= middle.high
    assert held_share >= 45
    assert held_percentile >= 50


def test_one_source_of_many_numbers(grey: SensorDesign) -> None:
    """A vector is one source; with nothing else its share is all."""
    found = tolerance(
        grey, linear, {"coating.reflectance": ToleranceDistribution(SIGMA, "uniform")}, sensors=400
    )
    spread = found.results["linear"]
    assert spread.shares["coating.reflectance"].value == 1.0  # type: ignore[union-attr]
    assert spread.deviation == pytest.approx(SIGMA * math.sqrt(10 / 3), rel=0.06)
    assert np.ptp(spread.scores) <= 2 * SIGMA * 4.0


def test_errors_stay_within_what_is_possible(mini: SensorDesign) -> None:
    """A specularity of 0 can't come out lower."""

    def specularity(design: SensorDesign) -> float:
        return design.coating.specularity

    found = tolerance(mini, specularity, {"coating.specularity": 0.1}, sensors=60)
    scores = found.results["specularity"].scores
    assert scores.min() == 0.0
    assert 0.25 < (scores > 0.0).mean() < 0.75


def test_every_light_errs_by_itself(mini: SensorDesign) -> None:
    bound = ManufacturingErrors({"lights.position": 0.1, "lights.angle": 2.0}).bind(mini)
    lights = sum(len(group.lights) for group in mini.lights.values())
    assert bound.size == 6 * lights
    errors = paired_errors(bound, 8, 0)
    made = bound.apply(errors[0, 0])
    moved = [
        np.subtract(one.position, other.position)
        for name, group in mini.lights.items()
        for one, other in zip(made.lights[name].lights, group.lights, strict=True)
    ]
    assert len({tuple(each) for each in moved}) == lights
    assert np.abs(moved).max() <= TRUNCATION * 0.1 + 1e-9
    assert (errors[:, 1, bound.owner == 1] == errors[:, 0, bound.owner == 1]).all()
    assert (errors[:, 1, bound.owner == 0] != errors[:, 0, bound.owner == 0]).all()


def test_failed_sensors_count_as_worse_than_any(grey: SensorDesign) -> None:
    def fragile(design: SensorDesign) -> float:
        red = design.coating.reflectance[0]
        if red < 0.45:
            raise ValueError("too dark")
        return red

    found = tolerance(grey, fragile, {RED: SIGMA}, sensors=400)
    spread = found.results["fragile"]
    part = truncnorm.cdf(-1.0, -TRUNCATION, TRUNCATION)
    assert sum(found.failures.values()) / found.sensors == pytest.approx(part, abs=0.01)
    assert math.isnan(spread.percentiles["p10"].value)
    assert spread.percentiles["p50"].value == pytest.approx(0.5, abs=0.003)
    assert "too dark" in next(iter(found.failures))


def test_the_interval_of_p10_reaches_to_failed_sensors() -> None:
    """With 10 failures in 120, P10 is a failed sensor in a third of the resamples."""
    scores = np.r_[np.full(10, math.nan), np.linspace(0.5, 1.0, 110)][:, None]
    found = percentile_of(scores, 0.1)
    assert found.value == pytest.approx(0.509, abs=0.001)
    assert math.isnan(found.low)
    assert math.isnan(found.error)
    assert found.high == pytest.approx(0.54, abs=0.005)
    most = percentile_of(np.r_[np.full(4, math.nan), scores[:, 0]][:, None], 0.1)
    assert math.isnan(most.value)
    assert 0.5 < most.high < found.high
    middle = percentile_of(scores, 0.5)
    assert middle.low < middle.value < middle.high


def test_results_for_a_seed_and_an_error_of_numpy_are_json(grey: SensorDesign) -> None:
    found = tolerance(
        grey, linear, {RED: np.float32(SIGMA)}, sensors=np.int64(16), seed=np.int64(7)
    )  # type: ignore[arg-type]
    again = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert (again["seed"], again["errors"]) == (7, {RED: ["normal", float(np.float32(SIGMA))]})


def test_results_are_json_and_each_score_has_the_values_that_gave_it(result: Tolerance) -> None:
    again = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert again["sensors"] == result.sensors == 2400
    assert again["objectives"]["linear"]["shares"][RED]["value"] > 0.8
    assert again["seed"] == 0
    assert again["versions"]["optisense"] == ots.__version__
    assert list(result.names) == list(WEIGHTS)
    scores = result.values.reshape(-1, len(WEIGHTS)) @ list(WEIGHTS.values())
    assert scores == pytest.approx(np.asarray(again["objectives"]["linear"]["scores"]))


def test_usual_errors_fit_every_sensor() -> None:
    for name in ("gelsight-mini-ideal", "gelsight360", "gelsight-svelte", "gelbelt"):
        design = ots.load(name)
        errors = usual_errors(design)
        bound = errors.bind(design)
        bound.apply(paired_errors(bound, 8, 0)[0, 0])
        assert {"lights.position", "lights.angle", "coating.specularity"} <= set(errors.sources)
    assert any(
        source.startswith("cages.") for source in usual_errors(ots.load("gelsight-svelte")).sources
    )


@pytest.mark.parametrize(
    ("errors", "kind", "message"),
    [
        ({"coating.specularty": 0.1}, DesignError, "specularity"),
        ({"coating.specularity": -0.1}, SearchError, "not a number above 0"),
        ({"camera.resolution[0]": 1.0}, SearchError, "no manufacturing error"),
        ({"lights.nowhere.position": 0.1}, DesignError, "no light group 'nowhere'"),
        ({}, SearchError, "no manufacturing errors"),
    ],
)
def test_bad_errors_are_told(
    mini: SensorDesign, errors: dict[str, float], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=message):
        tolerance(mini, linear, errors)


@pytest.mark.parametrize(
    "paths",
    [
        ("camera.position", "camera.position.x"),
        ("lights.position", "lights.red.position"),
        ("lights.*.shift.x", "lights.red.shift"),
    ],
)
def test_a_number_has_one_error_also_within_a_vector(
    mini: SensorDesign, paths: tuple[str, str]
) -> None:
    for given in (paths, paths[::-1]):
        with pytest.raises(SearchError, match="has two manufacturing errors") as caught:
            ManufacturingErrors(dict.fromkeys(given, 0.1)).bind(mini)
        assert caught.value.where == given[1]


def test_a_design_without_a_score_is_told(mini: SensorDesign) -> None:
    def broken(design: SensorDesign) -> float:
        raise ValueError("no such sensor")

    with pytest.raises(SearchError, match="no score: ValueError: no such sensor"):
        tolerance(mini, broken, {RED: 0.01})
    with pytest.raises(ObjectiveError, match="rgb2normal"):
        tolerance(mini, "rgb2norma", {RED: 0.01})


class TestRobust:
    """A search for what nine of ten manufactured sensors reach."""

    def test_it_keeps_away_from_a_cliff(self, grey: SensorDesign) -> None:
        """Beyond 0.7 the score falls to nothing. With even errors of 0.1, nine of ten sensors are
        on the safe side up to 0.62; from 0.6 on P10 does not rise any more.
        """

        def cliff(design: SensorDesign) -> float:
            red = design.coating.reflectance[0]
            return red if red <= 0.7005 else 0.0

        space = {RED: (0.3, 0.9, 61)}
        plain = search(grey, space, cliff, method="grid")
        robust = search(
            grey,
            space,
            cliff,
            method="grid",
            errors={RED: ToleranceDistribution(0.1, "uniform")},
            samples=101,
        )
        assert plain.best.values[RED] == pytest.approx(0.7)
        assert 0.595 < float(robust.best.values[RED]) < 0.6205
        parts = robust.best.parts["cliff"]
        assert parts["p10"] == pytest.approx(robust.best.score)
        assert parts["p10"] < parts["p50"] < parts["p90"]
        assert len(parts["samples"]) == 101

    def test_samples_without_errors_are_refused(self, grey: SensorDesign) -> None:
        with pytest.raises(SearchError, match="without a manufacturing error"):
            search(grey, {RED: (0.3, 0.9)}, "aoap", samples=8)

    def test_one_failure_in_ten_is_a_failure(self, grey: SensorDesign) -> None:
        def fragile(design: SensorDesign) -> float:
            if design.coating.reflectance[0] > 0.7:
                raise ValueError("it breaks")
            return 1.0

        result = search(
            grey,
            {RED: (0.5, 0.7, 3)},
            fragile,
            method="grid",
            errors={RED: ToleranceDistribution(0.1, "uniform")},
        )
        assert [trial.failure is None for trial in result.trials[1:]] == [True, True, False]
        assert "manufactured sensors fail: ValueError: it breaks" in str(result.trials[3].failure)


def test_percentile_by_hand() -> None:
    values = [5.0, 1.0, 3.0, 2.0, 4.0]
    assert percentile(values, 0.5) == 3.0
    assert percentile(values, 0.1) == pytest.approx(1.4)
    assert math.isnan(percentile([*values, math.nan], 0.1))
    assert percentile([*values, math.nan], 0.5) == pytest.approx(2.5)


def test_shares_stay_below_1_and_tell_their_standard_error() -> None:
    """One source makes the whole score. Jansen's formula gives more than 1 for half of all such
    samples of few sensors; cut there, every estimate comes nearer to the truth."""
    rng = np.random.default_rng(1)
    rows, errors, above = 10, [], 0
    for _ in range(40):
        first, second = rng.normal(size=(2, rows))
        scores = np.stack([first, second, first], axis=1)
        raw = 0.5 * np.mean((first - second) ** 2) / np.var(scores)
        found, other = total_effect(scores, 0), total_effect(scores, 1)
        assert found is not None and other is not None
        assert found.value == pytest.approx(min(1.0, raw))
        assert found.low <= found.high <= 1.0
        assert abs(found.value - 1.0) <= abs(raw - 1.0) + 1e-12
        assert other.value == 0.0
        above += raw > 1.0
        errors.append((found.error, raw - 1.0))
    assert 10 <= above <= 30
    told, true = np.mean([each[0] for each in errors]), np.std([each[1] for each in errors])
    assert told == pytest.approx(true, rel=0.5)


def test_errors_that_change_nothing_have_no_share(grey: SensorDesign) -> None:
    result = tolerance(grey, lambda design: 1.0, {"coating.reflectance.r": 0.1}, sensors=8)
    (found,) = result.results.values()
    assert found.deviation == 0.0
    assert [share and share.value for share in found.shares.values()] == [0.0]
    assert found.caveat == "the score does not depend on these errors"


def test_shares_of_mostly_noise_are_said_to_tell_nothing(result: Tolerance) -> None:
    found = next(iter(result.results.values()))
    assert found.caveat == ""
    noisy = replace(found, noise=0.6 * found.deviation)
    assert noisy.noise_share == pytest.approx(0.36)
    assert "36 % of the variance is noise" in noisy.caveat
