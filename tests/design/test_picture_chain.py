"""From radiance to the stored picture: each piece of the chain against its closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import optisense as ots
from optisense.design.lenses.blur import GaussianBlur
from optisense.design.lenses.film import PictureWindow, film_places
from optisense.design.lenses.shading import RadialShading
from optisense.design.responses import (
    USUAL_RESPONSE,
    BlackLevel,
    PictureChain,
    SensorNoise,
)
from optisense.design.responses.chain import SoftFocus
from optisense.design.responses.tone_curve import GammaCurve, PointsCurve, SrgbCurve
from optisense.errors import DesignError

HEIGHT, WIDTH = 60, 80

MATRIX = ((1.6, -0.4, -0.2), (-0.3, 1.5, -0.2), (-0.1, -0.5, 1.6))


def field(*levels: float) -> Any:
    """A uniform field of R, G, B."""
    return np.broadcast_to(np.array(levels, dtype=np.float32), (HEIGHT, WIDTH, 3)).copy()


def soft(pixels: float) -> SoftFocus:
    """A blur of a standard deviation in pixels."""
    camera = ots.load("builtin:gelsight-mini-ideal").camera
    return SoftFocus.of(GaussianBlur(width=pixels * camera.resolution[0] / WIDTH), camera)


FULL = PictureChain(
    shading=RadialShading(falloff=0.4, corrected=0.6),
    focus=soft(1.5),
    crosstalk=((0.8, 0.15, 0.05), (0.1, 0.8, 0.1), (0.02, 0.2, 0.78)),
    noise=SensorNoise(full_well=3000.0, read_noise=4.0, gain=2.0),
    black_level=BlackLevel(level=0.0625),
    white_balance=(1.5, 1.0, 1.7),
    colour_matrix=MATRIX,
    tone_curve=GammaCurve(gamma=1.8),
)


def test_a_chain_of_nothing_is_its_response() -> None:
    light = np.random.default_rng(1).random((HEIGHT, WIDTH, 3)).astype(np.float32) * 1.3
    chain = PictureChain()
    assert chain.is_plain and not FULL.is_plain
    assert np.array_equal(chain.respond(light), USUAL_RESPONSE.respond(light))
    assert np.array_equal(chain.encode(light), USUAL_RESPONSE.encode(light))
    assert chain.metered(light) is light
    assert chain.auto_exposure(light) == USUAL_RESPONSE.auto_exposure(light)
    assert chain.reach(640) == USUAL_RESPONSE.reach(640)


def test_a_uniform_field_comes_through_shading_and_tone_curve_as_their_product() -> None:
    curve = PointsCurve(points=[(0.0, 0.0), (0.09375, 0.317), (0.5, 0.837), (1.0, 1.0)])
    lens = RadialShading(falloff=0.5, power=2.0)
    stored = PictureChain(shading=lens, tone_curve=curve)
    level = 0.6 * (1.0 - 0.5 * film_places(HEIGHT, WIDTH).radius ** 2)
    picture = stored.encode(stored.respond(field(0.6, 0.6, 0.6)))
    expected = 255.0 * np.interp(level, [0.0, 0.09375, 0.5, 1.0], [0.0, 0.317, 0.837, 1.0])
    assert np.abs(picture - expected[..., None]).max() <= 0.51


def test_a_corrected_shading_is_a_flat_field_again() -> None:
    light = field(0.3, 0.5, 0.2)
    whole = PictureChain(shading=RadialShading(falloff=0.5, corrected=1.0))
    assert whole.respond(light) == pytest.approx(light, abs=1e-6)
    half = PictureChain(shading=RadialShading(falloff=0.5, corrected=0.5)).respond(light)
    share = 1.0 - 0.5 * film_places(HEIGHT, WIDTH).radius ** 2
    gain = 1.0 + 0.5 * (1.0 / share - 1.0)
    assert half == pytest.approx(light * (share * gain)[..., None], abs=1e-6)


@pytest.mark.parametrize("gain", [1.0, 4.0])
@pytest.mark.parametrize("level", [0.05, 0.4])
def test_noise_has_the_mean_and_variance_of_shot_and_read_noise(level: float, gain: float) -> None:
    noise = SensorNoise(full_well=2000.0, read_noise=5.0, gain=gain, binning=2.0)
    chain = PictureChain(noise=noise, black_level=BlackLevel(level=0.1))
    light = field(level, level, level)
    seen = np.concatenate([chain.respond(light, seed=seed).ravel() for seed in range(40)])
    electrons = 2000.0 / gain
    variance = (level / electrons + (5.0 / electrons) ** 2) / 2.0
    count = seen.size
    assert seen.mean() == pytest.approx(level, abs=5.0 * np.sqrt(variance / count))
    assert seen.var() == pytest.approx(variance, rel=5.0 * np.sqrt(2.0 / count))


def test_a_pixel_far_beyond_full_is_white_and_one_that_is_just_full_is_noisy() -> None:
    noise = SensorNoise(full_well=2000.0, read_noise=5.0, gain=4.0, binning=2.0)
    for black in (None, BlackLevel(level=0.0625)):
        chain = PictureChain(noise=noise, black_level=black)
        assert chain.respond(field(3.0, 3.0, 3.0)).min() == 1.0
        just = chain.respond(field(1.0, 1.0, 1.0))
        assert (just < 1.0).mean() == pytest.approx(0.5, abs=0.02)


def test_the_same_seed_gives_the_same_noise_and_another_one_other_noise() -> None:
    light = field(0.4, 0.4, 0.4)
    first = FULL.respond(light, seed=3)
    assert np.array_equal(FULL.respond(light, seed=3), first)
    apart = FULL.respond(light, seed=4) - first
    assert (
        apart.std() > 0.005
        and np.abs(np.corrcoef(apart[..., 0].ravel()[:-1], apart[..., 0].ravel()[1:])[0, 1]) < 0.05
    )
    calm = FULL.without_noise()
    assert np.array_equal(calm.respond(light, seed=3), calm.respond(light, seed=4))


def test_a_part_of_a_picture_is_what_the_whole_has_there() -> None:
    light = np.random.default_rng(2).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    whole, reach = FULL.respond(light, seed=5), FULL.reach(WIDTH)
    box = slice(20 - reach, 30 + reach), slice(30 - reach, 50 + reach)
    part = FULL.respond(light[box], PictureWindow.part(light.shape, box), 5)
    assert part[reach:-reach, reach:-reach] == pytest.approx(whole[20:30, 30:50], abs=1e-5)
    assert FULL.spreads(light)


def test_a_part_of_a_picture_is_blurred_as_it_is_in_the_whole() -> None:
    light = np.random.default_rng(2).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    chain = PictureChain(focus=SoftFocus(np.linspace(0.0, 3.0 / WIDTH, 48).reshape(6, 8)))
    whole, reach = chain.respond(light), chain.reach(WIDTH)
    box = slice(26 - reach, 34 + reach), slice(36 - reach, 44 + reach)
    part = chain.respond(light[box], PictureWindow.part(light.shape, box))
    assert part[reach:-reach, reach:-reach] == pytest.approx(whole[26:34, 36:44], abs=1e-6)


def test_a_picture_of_another_shape_shows_the_same_place_of_the_film_alike() -> None:
    """Of a camera of 80x60: its rows 15 to 44, and a taller picture, which adds 15 to each side."""
    camera = ots.load("builtin:gelsight-mini-ideal").camera
    camera.shading = RadialShading(falloff=0.8, power=3.0)
    focus = SoftFocus(np.linspace(0.0, 3.0 / WIDTH, 48).reshape(6, 8), HEIGHT / WIDTH)
    chain = replace(camera.picture_chain(), focus=focus)
    light = np.random.default_rng(2).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    whole, flat = chain.respond(light), field(1.0, 1.0, 1.0)
    cut = chain.respond(light[15:45])
    assert cut[13:-13] == pytest.approx(whole[28:32], abs=0.01)
    sharp = camera.picture_chain()
    assert sharp.respond(flat[15:45]) == pytest.approx(sharp.respond(flat)[15:45], abs=1e-6)
    tall = sharp.respond(np.ones((90, WIDTH, 3), dtype=np.float32))
    assert tall[15:75] == pytest.approx(sharp.respond(flat), abs=1e-6)
    assert tall.min() == pytest.approx(0.2, abs=1e-6)  # beyond the film as in its corners


def test_black_that_is_subtracted_is_0_and_black_that_is_not_is_the_level() -> None:
    dark, bright = field(0.0, 0.0, 0.0), field(1.0, 1.0, 1.0)
    given = PictureChain(black_level=BlackLevel(level=0.0625))
    kept = PictureChain(black_level=BlackLevel(level=0.0625, subtracted=0.0))
    assert given.respond(dark).max() == pytest.approx(0.0, abs=1e-7)
    assert kept.respond(dark).min() == pytest.approx(0.0625)
    for chain in (given, kept):
        assert chain.respond(bright) == pytest.approx(1.0)


def test_stray_light_fills_the_whole_sensor_alike_and_is_not_dimmed_by_the_lens() -> None:
    stray = (0.02, 0.05, 0.04)
    chain = PictureChain(shading=RadialShading(falloff=0.9), stray_light=stray)
    assert not chain.is_plain
    dark = chain.respond(field(0.0, 0.0, 0.0))
    assert dark == pytest.approx(np.broadcast_to(stray, dark.shape))
    lit, shaded = field(0.3, 0.3, 0.3), PictureChain(shading=RadialShading(falloff=0.9))
    added = chain.respond(lit) - shaded.respond(lit)
    assert added == pytest.approx(np.broadcast_to(stray, dark.shape), abs=1e-6)


def test_without_a_black_level_noise_in_the_dark_is_cut_off_at_0() -> None:
    """The mean of the positive part of a normal distribution is its deviation over sqrt(2 pi)."""
    noise = SensorNoise(full_well=1000.0, read_noise=10.0)
    cut = PictureChain(noise=noise).respond(field(0.0, 0.0, 0.0))
    assert cut.mean() == pytest.approx(0.01 / np.sqrt(2.0 * np.pi), rel=0.05)


def test_white_balance_and_matrix_make_what_they_say() -> None:
    light = field(0.2, 0.3, 0.25)
    chain = PictureChain(white_balance=(1.5, 1.0, 1.2), colour_matrix=MATRIX)
    expected = np.array(MATRIX) @ [0.3, 0.3, 0.3]
    assert chain.respond(light)[7, 9] == pytest.approx(expected, abs=1e-6)
    white = PictureChain(white_balance=(2.0, 1.0, 2.0)).respond(field(0.2, 0.4, 0.2))
    assert white == pytest.approx(0.4, abs=1e-6)


def test_a_matrix_undoes_the_crosstalk_that_it_is_the_inverse_of() -> None:
    crosstalk: Any = np.linalg.inv(np.array(MATRIX)).tolist()
    light = field(0.5, 0.1, 0.3)
    chain = PictureChain(crosstalk=crosstalk, colour_matrix=MATRIX)
    assert chain.respond(light) == pytest.approx(light, abs=1e-5)
    assert PictureChain(crosstalk=crosstalk).respond(light)[0, 0, 1] > 0.15


def test_a_sensor_overflows_before_its_processor_amplifies() -> None:
    """Red of 0.8 is not full; a gain of 2 cuts it off in the picture without whitening others."""
    chain = PictureChain(white_balance=(2.0, 1.0, 1.0))
    assert chain.respond(field(0.8, 0.2, 0.1))[3, 3] == pytest.approx([1.0, 0.2, 0.1], abs=1e-6)


def test_automatic_exposure_fills_neither_sensor_nor_picture() -> None:
    light = np.random.default_rng(3).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    for chain in (PictureChain(white_balance=(2.0, 1.0, 0.5)), FULL.without_noise()):
        exposed = light * chain.auto_exposure(light)
        level = chain.respond(exposed).max(axis=2)
        assert (level >= 1.0).mean() < 0.02
        assert 0.3 < np.percentile(level, 95) < 0.6


@pytest.mark.parametrize(
    ("changes", "reached"),
    [
        ({"stray_light": (0.4, 0.4, 0.4)}, 0.55),
        ({"stray_light": (0.1, 0.3, 0.2), "white_balance": (1.3, 1.0, 1.2)}, 0.55),
        ({"black_level": BlackLevel(level=0.3, subtracted=0.0)}, 0.55),
        ({"black_level": BlackLevel(level=0.2, subtracted=0.5), "colour_matrix": MATRIX}, 0.55),
        ({"stray_light": (0.6, 0.6, 0.6)}, 0.6 + 0.2 * 0.55),  # a fifth is left for the light
    ],
)
def test_automatic_exposure_counts_what_is_not_light(
    changes: dict[str, Any], reached: float
) -> None:
    light = np.random.default_rng(3).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    chain = PictureChain(**changes)
    level = chain.respond(light * chain.auto_exposure(light)).max(axis=2)
    assert np.percentile(level, 95) == pytest.approx(reached, abs=0.003)


def test_tone_curves_are_what_they_are_called() -> None:
    level = np.linspace(0.0, 1.0, 11)
    assert GammaCurve(gamma=2.0).curve(level) == pytest.approx(np.sqrt(level))
    assert SrgbCurve().curve(np.array([0.0031308, 0.5])) == pytest.approx([0.04045, 0.735357], 1e-4)
    assert SrgbCurve().encode(np.array([0.0, 2.0])).tolist() == [0, 255]


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([(0.0, 0.0), (0.5, 0.7), (0.5, 0.8), (1.0, 1.0)], "does not rise from point 1"),
        ([(0.0, 0.0), (0.5, 0.7), (1.0, 0.6)], "does not rise"),
        ([(0.1, 0.0), (1.0, 1.0)], "runs from 0.1 to 1"),
        ([(0.0, 0.0)], "at least 2 items"),
        ([(0.0, 0.0), (1.0, 1.2)], "less than or equal to 1"),
    ],
)
def test_a_tone_curve_must_rise_from_0_to_1(points: Any, says: str) -> None:
    design = ots.load("builtin:gelsight-mini-ideal")
    camera = design.camera.model_dump(mode="json") | {
        "tone_curve": {"kind": "points", "points": points}
    }
    with pytest.raises(DesignError, match=says):
        ots.set_value(design, "camera", camera)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ({"noise": {"full_well": -1.0}}, "camera.noise.full_well"),
        ({"noise": {"full_well": 5000.0, "gain": 0.0}}, "camera.noise.gain"),
        ({"black_level": {"level": -0.1}}, "camera.black_level.level"),
        ({"white_balance": [1.0, -1.0, 1.0]}, "camera.white_balance"),
        ({"colour_matrix": [[1.0, 0.0, 0.0]] * 3}, "can't be told apart"),
    ],
)
def test_numbers_that_no_camera_has_are_refused(value: dict[str, Any], says: str) -> None:
    design = ots.load("builtin:gelsight-mini-ideal")
    with pytest.raises(DesignError, match=says):
        ots.set_value(design, "camera", design.camera.model_dump(mode="json") | value)
