"""Lights emit what their profile says: chi-square tests of samples against densities."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from reference_scenes import isotropic
from scipy import stats

import optisense as ots
import optisense.library
from optisense.design.emitters import IesEmitter, Intensity, SpotEmitter
from optisense.design.ies import read_ies
from optisense.optics import OpticalModel
from optisense.optics.backend.sequences import sequence_4d
from optisense.optics.scene.emitters import (
    Emitter,
    EmitterShape,
    EmitterTable,
    emit,
    emitter_table,
)
from optisense.optics.scene.surfaces import RAY_OFFSET
from optisense.optics.transport.emission_guide import (
    GUIDE_CELLS,
    MIN_DENSITY,
    guide_from_density,
    uniform_guide,
    warp,
)

SIGNIFICANCE = 0.001
"""Seeds are fixed: a right sampler that happened to fail would fail always, and be seen once."""

SAMPLES = 200_000
LAMP = Path(optisense.library.__file__).parent / "lights" / "osram-topled-black-30.ies"

LOPSIDED = Intensity(
    np.array([0.0, 15.0, 30.0, 50.0, 75.0]),
    np.array([0.0, 60.0, 90.0, 180.0, 270.0, 360.0]),
    np.array(
        [
            [5.0, 6.0, 3.0, 1.0, 0.2],
            [5.0, 2.0, 4.0, 2.0, 0.5],
            [5.0, 7.0, 1.0, 1.0, 0.1],
            [5.0, 3.0, 2.0, 3.0, 1.0],
            [5.0, 4.0, 6.0, 0.5, 0.3],
            [5.0, 6.0, 3.0, 1.0, 0.2],
        ]
    ),
)
RING = Intensity(
    np.array([0.0, 30.0, 40.0, 60.0, 70.0]), np.zeros(1), np.array([[0.0, 0.0, 1.0, 1.0, 0.0]])
)
CONES = Intensity(
    np.array([0.0, 15.0, 20.0, 50.0, 55.0, 70.0]),
    np.zeros(1),
    np.array([[1.0, 1.0, 0.0, 0.0, 1.0, 1.0]]),
)
BACKWARD = Intensity(
    np.array([90.0, 95.0, 120.0, 180.0]), np.zeros(1), np.array([[0.0, 1.0, 1.0, 1.0]])
)
SECTORS = Intensity(
    np.array([0.0, 60.0]),
    np.array([0.0, 60.0, 90.0, 150.0, 180.0, 240.0, 270.0, 300.0, 360.0]),
    np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0])[:, None] * [1.0, 1.0],
)


def ies_lamp() -> Intensity:
    profile = read_ies(LAMP)
    return Intensity(profile.vertical_angles, np.zeros(1), profile.candela[:1])


def flux(intensity: Intensity) -> float:
    """Integral over directions by a fine midpoint rule."""
    reach = np.radians(intensity.polar[-1])
    polar = (np.arange(4000) + 0.5) * reach / 4000
    around = (np.arange(120) + 0.5) * 3.0
    grid = intensity.at(*np.meshgrid(np.degrees(polar), around, indexing="ij"))
    return float((grid.mean(axis=1) * np.sin(polar)).sum() * reach / 4000 * 2 * np.pi)


def upright(**values: object) -> EmitterTable:
    """A light that shines along +z with its width along +x."""
    return emitter_table([Emitter(0, (0, 0, 0), (0, 0, 1), (0, 1, 0), **values)], 1)  # type: ignore[arg-type]


def directions(table: EmitterTable) -> Callable[..., mi.Vector3f]:
    def sample(values: mi.Point2f) -> mi.Vector3f:
        return emit(table, dr.zeros(mi.UInt32, dr.width(values)), values, mi.Point2f(0.5))[1]

    return sample


def fits(
    sample: Callable[..., mi.Vector3f], density: Callable[..., np.ndarray], widest: float = 180.0
) -> bool:
    """Chi-square test over 40 polar and 12 azimuthal cells; density (1/sr) of angles in degrees."""
    rng = np.random.default_rng(11)
    x, y, z = np.asarray(sample(mi.Point2f(*(mi.Float(rng.random(SAMPLES)) for _ in range(2)))))
    polar = np.degrees(np.arctan2(np.hypot(x, y), z))
    around = np.mod(np.degrees(np.arctan2(y, x)), 360)
    cells, fine = (40, 12), (100, 60)
    found, _, _ = np.histogram2d(polar, around, cells, [[0, widest], [0, 360]])
    # Midpoints of a grid in polar angle and azimuth within every cell.
    p = (np.arange(cells[0] * fine[0]) + 0.5) * widest / (cells[0] * fine[0])
    a = (np.arange(cells[1] * fine[1]) + 0.5) * 360 / (cells[1] * fine[1])
    step = np.radians(widest / len(p)) * np.radians(360 / len(a))
    mass = density(p[:, None], a[None]) * np.sin(np.radians(p))[:, None] * step
    mass = np.broadcast_to(mass, (len(p), len(a)))
    expected = SAMPLES * mass.reshape(cells[0], fine[0], cells[1], fine[1]).sum(axis=(1, 3))
    if abs(expected.sum() / SAMPLES - 1) > 1e-3 or found.sum() < SAMPLES * (1 - 1e-5):
        return False
    thick = expected >= 5
    rest = found[~thick].sum(), expected[~thick].sum()
    statistic = ((found - expected)[thick] ** 2 / expected[thick]).sum()
    if rest[1] > 0:
        statistic += (rest[0] - rest[1]) ** 2 / max(rest[1], 1.0)
    return bool(stats.chi2.sf(statistic, thick.sum()) > SIGNIFICANCE)


@pytest.mark.parametrize("shape", [EmitterShape.RECTANGLE, EmitterShape.DISC])
@pytest.mark.parametrize("exponent", [1.0, 6.5])
def test_flat_lights_radiate_as_a_power_of_the_cosine(shape: EmitterShape, exponent: float) -> None:
    table = upright(shape=shape, size=(2.0, 1.0), exponent=exponent)

    def density(polar: np.ndarray, around: np.ndarray) -> np.ndarray:
        cosine = np.maximum(np.cos(np.radians(polar)), 0)
        return (exponent + 1) / (2 * np.pi) * cosine**exponent

    assert fits(directions(table), density, 90.0)


@pytest.mark.parametrize(
    "intensity",
    [
        ies_lamp(),
        LOPSIDED,
        SpotEmitter(cutoff=40, beam=20).intensity(),
        SpotEmitter(cutoff=12, beam=12).intensity(),
        isotropic(),
        RING,
        CONES,
        BACKWARD,
        SECTORS,
    ],
    ids=[
        "ies",
        "asymmetric ies",
        "spot",
        "hard spot",
        "isotropic",
        "dark axis",
        "dark between cones",
        "backward",
        "dark between sectors",
    ],
)
def test_tabulated_lights_radiate_as_their_table(intensity: Intensity) -> None:
    total = flux(intensity)

    def density(polar: np.ndarray, around: np.ndarray) -> np.ndarray:
        azimuth = around - 90.0  # azimuth 0 is at the light's `up`, which is +y
        return intensity.at(*np.broadcast_arrays(polar, azimuth)) / total

    assert fits(directions(upright(intensity=intensity)), density, float(intensity.polar[-1]))


LOBES = """IESNA:LM-63-2002
TILT=NONE
1 -1 1 3 5 1 2 0 0 0 1 1 1
0 45 90
0 90 180 270 360
0 10 0  0 5 0  0 0 0  0 0 0  0 10 0
"""


def test_a_lamp_with_lobes_shines_towards_its_up(tmp_path: Path) -> None:
    """A lobe at azimuth 0, and one of half the power at azimuth 90: direction x `up`."""
    design = ots.load("gelsight-mini-ideal")
    (tmp_path / "lobes.ies").write_text(LOBES)
    lamp = IesEmitter(file="lobes.ies").located(tmp_path)
    for group, up in (("red", (0.0, 1.0, 0.0)), ("green", (1.0, 0.0, 0.0))):
        design.lights[group].emitter = lamp
        light = design.lights[group].lights[0]
        pose = {"position": (0.0, 0.0, -12.0), "direction": (0.0, 0.0, 1.0), "up": up}
        design.lights[group].lights = [light.model_copy(update=pose)]
    image = OpticalModel(design).render([], resolution=(40, 30), photons=50_000)
    points = np.nan_to_num(image.points)

    def middle(group: str) -> np.ndarray:
        light = image.layers[group].sum(axis=2)
        return np.einsum("ij,ijk->k", light, points) / light.sum()

    x, y, _ = middle("red")
    assert y > 2.0 and -0.9 * y < x < -0.2 * y
    x, y, _ = middle("green")
    assert x > 2.0 and 0.2 * x < y < 0.9 * x


def test_the_chi_square_test_notices_a_wrong_profile() -> None:
    table = upright(shape=EmitterShape.RECTANGLE, size=(1.0, 1.0), exponent=1.1)
    assert not fits(directions(table), lambda p, a: np.cos(np.radians(p)) / np.pi, 90.0)


def places(shape: EmitterShape) -> np.ndarray:
    rng = np.random.default_rng(1)
    table = upright(shape=shape, size=(3.0, 1.0))
    u = mi.Point2f(*(mi.Float(rng.random(SAMPLES)) for _ in range(2)))
    point = emit(table, dr.zeros(mi.UInt32, SAMPLES), mi.Point2f(0.5), u)[0]
    return np.asarray(point)


def evenly_filled(counts: np.ndarray) -> bool:
    expected = counts.sum() / counts.size
    statistic = ((counts - expected) ** 2 / expected).sum()
    return bool(stats.chi2.sf(statistic, counts.size - 1) > SIGNIFICANCE)


def test_a_rectangle_emits_evenly_over_its_face() -> None:
    x, y, z = places(EmitterShape.RECTANGLE)
    counts, _, _ = np.histogram2d(x, y, bins=20, range=[[-1.5, 1.5], [-0.5, 0.5]])
    assert counts.sum() == SAMPLES
    assert evenly_filled(counts)
    assert np.allclose(z, RAY_OFFSET)


def test_a_disc_emits_evenly_over_its_face() -> None:
    x, y, _ = places(EmitterShape.DISC)
    square = (x / 1.5) ** 2 + (y / 0.5) ** 2
    turn = np.arctan2(y / 0.5, x / 1.5)
    counts, _, _ = np.histogram2d(square, turn, bins=20, range=[[0, 1], [-np.pi, np.pi]])
    assert counts.sum() == SAMPLES
    assert evenly_filled(counts)


def test_the_pose_turns_positions_and_directions_alike() -> None:
    lamp = Emitter(3, (1, 2, 3), (2, 0, 0), (0, 0, 1), EmitterShape.RECTANGLE, (4.0, 2.0))
    table = emitter_table([lamp], 4)
    corner, way, group, _ = emit(
        table, mi.UInt32([0, 0]), mi.Point2f([0, 0.3], [0, 0.1]), mi.Point2f([1, 0.5], [1, 0.5])
    )
    # Shining along +x with +z up, the width axis is up x direction = +y.
    assert np.allclose(np.asarray(corner)[:, 0], (1 + RAY_OFFSET, 4, 4), atol=1e-5)
    assert np.allclose(np.asarray(way)[:, 0], (1, 0, 0), atol=1e-5)
    assert np.asarray(way)[0, 1] > 0
    assert np.allclose(np.linalg.norm(np.asarray(way), axis=0), 1, atol=1e-5)
    assert set(np.asarray(group)) == {3}


def test_the_flux_of_an_ies_light_is_its_files_lumens() -> None:
    profile = read_ies(LAMP)
    assert flux(ies_lamp()) == pytest.approx(profile.lumens, rel=1e-4)
    # The header says 2.034 lm for this lamp; its table has steps of some degrees.
    assert profile.lumens == pytest.approx(2.034, rel=0.01)
    # Samples of equal power: their sum within a cone is the table's integral over that cone.
    rng = np.random.default_rng(2)
    u = mi.Point2f(*(mi.Float(rng.random(SAMPLES)) for _ in range(2)))
    z = np.asarray(directions(upright(intensity=ies_lamp()))(u))[2]
    candela = ies_lamp()
    for cone in (5.0, 10.0, 20.0, 40.0):
        keep = candela.polar < cone
        cut = Intensity(
            np.append(candela.polar[keep], cone),
            np.zeros(1),
            np.append(candela.values[0][keep], candela.at(np.array(cone), np.array(0.0)))[None],
        )
        share = (z > np.cos(np.radians(cone))).mean()
        noise = np.sqrt(share * (1 - share) / SAMPLES)
        assert abs(share * profile.lumens - flux(cut)) < (4 * noise + 1e-3) * profile.lumens


def test_a_guides_weights_make_up_for_where_it_sends_photons() -> None:
    rng = np.random.default_rng(3)
    density_table = rng.random((2, GUIDE_CELLS, GUIDE_CELLS)) ** 4
    guide = guide_from_density(density_table)
    u = rng.random((2, SAMPLES))
    for light in range(2):
        moved, weight, cell = warp(
            guide,
            dr.full(mi.UInt32, light, SAMPLES),
            mi.Point2f(mi.Float(u[0]), mi.Float(u[1])),
        )
        x, y = np.asarray(moved)
        weights = np.asarray(weight)
        # Weights times density integrate to 1, as a whole and over every part of the square.
        assert weights.mean() == pytest.approx(1.0, abs=4 * weights.std() / np.sqrt(SAMPLES))
        index = np.floor(x * GUIDE_CELLS).astype(int) * GUIDE_CELLS + np.floor(
            y * GUIDE_CELLS
        ).astype(int)
        assert (index == np.asarray(cell)).mean() > 0.9999  # rounding at borders of cells
        share = np.bincount(np.asarray(cell), weights, GUIDE_CELLS * GUIDE_CELLS) / SAMPLES
        noise = (
            np.sqrt(np.bincount(np.asarray(cell), weights**2, GUIDE_CELLS * GUIDE_CELLS)) / SAMPLES
        )
        assert np.abs((share - GUIDE_CELLS**-2) / noise).max() < 4.5  # 256 cells
        assert weights.max() <= 1.0001 / MIN_DENSITY


def test_an_even_guide_moves_nothing() -> None:
    u = np.random.default_rng(4).random((2, 1000)).astype(np.float32)
    moved, weight, _ = warp(
        uniform_guide(1), dr.zeros(mi.UInt32, 1000), mi.Point2f(mi.Float(u[0]), mi.Float(u[1]))
    )
    assert np.abs(np.asarray(moved) - u).max() < 1e-5
    assert np.asarray(weight) == pytest.approx(1.0, abs=1e-5)


def test_the_photon_sequence_integrates_better_than_random_points() -> None:
    count, streams = 10_000, 32
    index = dr.arange(mi.UInt32, count)
    errors = []
    for stream in range(streams):
        points = sequence_4d(index, mi.UInt32(stream), mi.UInt32(7))
        values = np.prod([1 + 1.5 * (np.asarray(p, dtype=float) - 0.5) for p in points], axis=0)
        errors.append(values.mean() - 1)
    deviation = np.sqrt((1 + 1.5**2 / 12) ** 4 - 1)  # of one random point
    assert np.sqrt(np.mean(np.square(errors))) < 0.3 * deviation / np.sqrt(count)
    assert len(np.unique(errors)) == streams
