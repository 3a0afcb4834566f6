"""The errors that the benchmark of patches finds in images whose true errors are known."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from benchmarks import patch_references
from benchmarks.light_tracing import FilmMap
from benchmarks.patch_references import USUAL, Referee, ray_offset_shift
from benchmarks.patches import PatchCase, compare
from optisense import OpticalModel

PATCHES = 20
TRIALS = 100
NOISE = np.array([0.02, 0.02, 0.1])
"""Standard deviation of each channel of one image, as where one colour is weak."""

LEFT = 0.02
"""Difference between found and true error. The RMS noise is 0.047; squares below 0, which noise
also causes, are taken as 0."""


@pytest.mark.parametrize("error", [0.0, 0.02, 0.05])
def test_noise_is_no_error_and_the_limit_contains_the_true_error(error: float) -> None:
    random = np.random.default_rng(1)
    patch = np.arange(PATCHES)[None]
    squares, limits = [], []
    for _ in range(TRIALS):
        off = random.normal(size=(1, PATCHES, 3))
        off *= error / np.sqrt((off**2).mean())
        truth, images = (1 + NOISE * random.normal(size=(n, 1, PATCHES, 3)) for n in (8, 2))
        found = compare(images + off, truth, patch, np.ones(3))
        squares.append(found["rms"] ** 2)
        limits.append(found["limit"])
    assert np.mean(np.array(limits) >= error) > 0.95
    assert np.sqrt(np.mean(squares)) == pytest.approx(error, abs=LEFT)


@pytest.mark.parametrize(
    ("sensor", "shift"), [("gelsight-mini-ideal", 0.0), ("gelsight-svelte", -0.0625)]
)
def test_the_path_tracer_sees_the_skin_behind_mirrors_shifted(sensor: str, shift: float) -> None:
    case = PatchCase(sensor, 1.0)
    model = OpticalModel(case.design(), "llvm")
    seen = model.chief_rays(case.resolution, [case.contact(model)], "conforming").contact_mask
    assert ray_offset_shift(model, seen) == pytest.approx((shift, 0.0), abs=0.002)


def test_light_tracing_keeps_the_photons_on_the_tip_of_a_ball() -> None:
    case = PatchCase("gelsight-mini-ideal-cylindrical", 0.0, depth=0.3)
    model = OpticalModel(case.design(), "llvm")
    contact = case.contact(model)
    rays = model.chief_rays(case.resolution, [contact], "conforming")
    points = rays.points[case.reference(model).window].reshape(-1, 3)
    vertices = model.place(contact).vertices
    tip = vertices[vertices[:, 2].argmin()]
    # The tip lies between the points that the middles of pixels see, beyond all of them.
    assert tip[2] < points[:, 2].min() - 0.001
    film = FilmMap.fit(points, np.zeros((len(points), 2)))
    assert all(film.contains(mi.Point3f(*map(float, tip))))


def test_pictures_of_paths_of_different_lengths_are_kept_apart(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = [USUAL.name(referee) for referee in Referee]
    monkeypatch.setattr(patch_references, "PATH_DEPTH", 64)
    path, light = (USUAL.name(referee) for referee in Referee)
    assert path != names[0] and light == names[1]
