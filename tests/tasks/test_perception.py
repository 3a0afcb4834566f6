"""Perception tasks against pictures that algebra makes, and samples that are kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optisense import OpticalModel
from optisense.design import Markers
from optisense.design.colour import srgb_curve
from optisense.errors import ContactError, TaskError
from optisense.geometry import Contact, Cylinder, TriangleMesh
from optisense.tasks import (
    BallForce,
    BallShear,
    CylinderRadius,
    DatasetSettings,
    Misalignment,
    ReconstructionSettings,
    SampleSettings,
    perceive,
    signal_to_noise,
)
from optisense.tasks._misalignment import plane_contact
from optisense.tasks._perception import collect

QUIET = SampleSettings(count=40, camera_noise=0.0, skin="conforming")
"""Settings for colours from algebra, which does not depend on how the gel deforms; the conforming
skin takes a tenth of the elastic one's time."""
LIGHTS = np.array([[0.8, 0.0, -0.6], [-0.4, 0.69282, -0.6], [-0.4, -0.69282, -0.6]])


def levels(normal: np.ndarray, exposure: float) -> np.ndarray:
    """What the Lambertian sensor's camera stores where the normal is so: (..., 3) of 255."""
    return 255 * srgb_curve(exposure * np.maximum(normal @ LIGHTS.T, 0))


def turned(angle_x: float, angle_y: float) -> np.ndarray:
    """Inward, turned about the indenter's x and then its y axis, which are -x and -y here."""
    x, y = np.radians([angle_x, angle_y])
    about_x = -np.array([0, -np.sin(x), np.cos(x)])
    return np.array([-np.sin(y) * about_x[2], -about_x[1], np.cos(y) * about_x[2]])


@pytest.mark.parametrize("angles", [(0.0, 0.0), (7.0, 0.0), (0.0, 7.0), (-5.0, 9.0)])
def test_the_mean_colour_of_a_tilted_plane_is_what_lambert_says(
    angles: tuple[float, float], lambertian: Any
) -> None:
    plane = plane_contact(lambertian, *angles, 0.8)
    image = lambertian.render([plane], (48, 36), skin="conforming")
    exposure = lambertian.render([], (48, 36)).auto_exposure()
    measured = Misalignment().measure(image.picture(exposure), image)
    assert measured == pytest.approx(levels(turned(*angles), exposure), abs=0.51)


def test_the_plane_passes_at_its_depth_below_the_middle(mini: OpticalModel) -> None:
    for angles in ((0, 0), (8, -6)):
        contact = plane_contact(mini, *angles, 0.8)
        rays = mini.chief_rays((41, 31), [contact], skin="conforming")
        # z from x and y of the touched points, at the middle.
        points = rays.points[rays.region == 2].astype(float)
        fitted, *_ = np.linalg.lstsq(
            np.column_stack([points[:, :2], np.ones(len(points))]), points[:, 2], rcond=None
        )
        assert fitted[2] == pytest.approx(-0.8, abs=5e-4)
        normal = turned(*angles)
        assert fitted[:2] == pytest.approx(-normal[:2] / normal[2], abs=1e-4)


@pytest.mark.parametrize("radius", [1.5, 4.0])
def test_the_spread_of_colours_over_a_cylinder_is_what_lambert_says(
    radius: float, lambertian: Any
) -> None:
    depth = 0.5
    contact = Contact(Cylinder(radius), at=(0, 0), depth=depth)
    image = lambertian.render([contact], (320, 240), skin="conforming")
    exposure = lambertian.render([], (320, 240)).auto_exposure()
    measured = CylinderRadius().measure(image.picture(exposure), image)
    # It lies along x: normals turn about x by the angle whose sine is y / radius.
    half = np.sqrt(2 * radius * depth - depth**2)
    sine = np.linspace(-half, half, 4001) / radius
    normals = np.column_stack([np.zeros_like(sine), sine, -np.sqrt(1 - sine**2)])
    # Perspective shows the flanks a few per cent narrower or wider than they are.
    assert measured == pytest.approx(levels(normals, exposure).std(axis=0), rel=0.05, abs=0.5)


def test_colours_that_tell_the_angle_are_read_and_noise_spoils_them(lambertian: Any) -> None:
    task = Misalignment()
    clear = perceive(task, lambertian, QUIET)
    noisy = perceive(task, lambertian, replace(QUIET, camera_noise=150.0))
    assert clear.reading.error < 0.3 * clear.reading.guess
    # Neighbours among 40 samples still differ by some degrees.
    assert clear.snr > 5
    assert noisy.reading.error > 1.5 * clear.reading.error
    assert noisy.snr < 0.5 * clear.snr
    # Even angles over +-10 degrees lie 5 degrees from their mean on average.
    assert clear.reading.guess == pytest.approx(5, rel=0.2)


def test_a_radius_is_read_from_the_spread(lambertian: Any) -> None:
    result = perceive(CylinderRadius(), lambertian, QUIET)
    assert result.reading.error < 0.35 * result.reading.guess
    values = result.to_dict()
    assert values["error_of_target"]["radius"] == pytest.approx(values["mean_absolute_error"])
    assert values["samples"] == 40


def test_samples_are_kept_and_work_continues_where_it_stopped(
    lambertian: Any, tmp_path: Path
) -> None:
    task = Misalignment()
    settings = replace(QUIET, count=14)

    def stop(done: int, count: int) -> None:
        if done == 6:
            raise KeyboardInterrupt

    whole = collect(task, lambertian, settings, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        collect(task, lambertian, settings, tmp_path / "parts", stop)
    before = lambertian.pictures
    parts = collect(task, lambertian, settings, tmp_path / "parts")
    assert lambertian.pictures - before == 8 + 1  # and the untouched sensor
    assert np.array_equal(parts.features, whole.features)
    assert np.array_equal(parts.targets, whole.targets)
    again = lambertian.pictures
    fewer = collect(task, lambertian, replace(QUIET, count=10), tmp_path / "parts")
    assert lambertian.pictures == again
    assert np.array_equal(fewer.features, whole.features[:10])


def test_planes_reach_through_the_layers_of_a_gel(mini: OpticalModel) -> None:
    design = mini.design
    design.cages.clear()
    low, high = design.meshes["gel"].bounds
    design.meshes["gel"] = TriangleMesh.box((*low[:2], -2.0), high)
    design.meshes["low"] = TriangleMesh.box(low, (*high[:2], -2.0))
    design.parts["low"] = design.parts["gel"]
    layered = OpticalModel(design)
    assert plane_contact(layered, 1.0, 0.0, 2.5) == plane_contact(mini, 1.0, 0.0, 2.5)
    with pytest.raises(ContactError, match=r"4\.25 mm thick"):
        plane_contact(layered, 1.0, 0.0, 4.2)


def test_a_folder_of_other_samples_is_left_alone(lambertian: Any, tmp_path: Path) -> None:
    settings = replace(QUIET, count=2)
    collect(Misalignment(), lambertian, settings, tmp_path)
    kept = (tmp_path / "samples.csv").read_bytes()
    with pytest.raises(TaskError, match=r"misalignment\.depth: 0\.8 -> 0\.9"):
        collect(Misalignment(depth=0.9), lambertian, settings, tmp_path)
    with pytest.raises(TaskError, match="task: misalignment -> cylinder-radius"):
        collect(CylinderRadius(), lambertian, settings, tmp_path)
    assert (tmp_path / "samples.csv").read_bytes() == kept


def test_what_cannot_work_is_told_before_any_picture(lambertian: Any) -> None:
    with pytest.raises(ContactError, match="mm deep at a corner"):
        perceive(Misalignment(range=30), lambertian, QUIET)
    with pytest.raises(ContactError, match="thick"):
        perceive(CylinderRadius(least=5, depth=5), lambertian, QUIET)
    with pytest.raises(TaskError, match=r"covers only \d+ % of the crop"):
        perceive(Misalignment(depth=0.05), lambertian, QUIET)
    with pytest.raises(TaskError, match="are impossible"):
        perceive(Misalignment(), lambertian, SampleSettings(count=8))
    with pytest.raises(TaskError, match="are impossible"):
        perceive(Misalignment(), lambertian, QUIET, neighbours=60)
    for kind in (SampleSettings, DatasetSettings, ReconstructionSettings):
        for noise in (-1.0, 256.0, float("nan")):
            with pytest.raises(TaskError, match=r"camera noise is .*Give 0 to 255"):
                kind(camera_noise=noise)
        with pytest.raises(TaskError, match="seed is -1"):
            kind(seed=-1)
    with pytest.raises(TaskError):
        Misalignment(range=0)
    with pytest.raises(TaskError):
        CylinderRadius(least=3, most=2)
    with pytest.raises(TaskError, match=r"0\.2 to 0\.3 mm, pressed 0\.5 mm deep, are impossible"):
        CylinderRadius(least=0.2, most=0.3)
    for kind in (BallForce, BallShear):
        with pytest.raises(TaskError, match="not deeper than the radius"):
            kind(radius=0.5)
    assert lambertian.pictures == 0


def test_a_crop_beyond_the_contact_is_told(lambertian: Any) -> None:
    image = lambertian.render([Contact(Cylinder(0.5), at=(0, 0), depth=0.2)], (48, 36))
    with pytest.raises(TaskError, match="% of the crop"):
        Misalignment().measure(image.picture(1.0), image)
    with pytest.raises(TaskError, match="pixels show the contact"):
        CylinderRadius().measure(image.picture(1.0), lambertian.render([], (48, 36)))


def test_a_force_is_read_from_the_spread(mini: OpticalModel) -> None:
    settings = SampleSettings(count=16, resolution=(48, 36), photons=60_000)
    result = perceive(BallForce(), mini, settings)
    assert result.unit == "N"
    forces = result.samples.targets[:, 0]
    # Hertz: 4/3 E* R^0.5 d^1.5 for a half-space; the layer takes 10 to 30 % more.
    hertz = 4.0 / 3.0 * 0.435 / (1.0 - 0.49**2) * 3.0**0.5
    assert forces.min() > hertz * 0.1**1.5
    assert forces.max() < 1.6 * hertz
    assert result.reading.error < 0.6 * result.reading.guess
    with pytest.raises(TaskError, match="are impossible"):
        BallForce(least=0.5, most=0.4)
    with pytest.raises(ContactError, match="thick"):
        perceive(BallForce(radius=5.0, most=5.0), mini, settings)


def test_the_mean_motion_of_dots_in_pictures_tells_the_shear(
    mini: OpticalModel, tmp_path: Path
) -> None:
    with pytest.raises(TaskError, match="the design has none"):
        perceive(BallShear(), mini, SampleSettings(count=10))
    design = mini.design.copy()
    design.markers = Markers(grid=(7, 5), pitch=2.4, radius=0.5)
    dotted = OpticalModel(design)
    with pytest.raises(ContactError, match="conforming"):
        collect(BallShear(), dotted, SampleSettings(count=8, skin="conforming"), tmp_path)
    assert not list(tmp_path.iterdir())
    samples = collect(BallShear(), dotted, SampleSettings(count=8, photons=60_000))
    along, down = samples.features[:, 0], samples.features[:, 1]
    shear_u, shear_v = samples.targets.T
    # Far from the ball dots move in proportion to the force; v points up and rows run down.
    assert np.corrcoef(along, shear_u)[0, 1] > 0.95
    assert np.corrcoef(down, shear_v)[0, 1] < -0.95
    assert np.abs(samples.targets).max() > 0.1
    with pytest.raises(TaskError, match="is impossible"):
        BallShear(farthest=0.0)


@pytest.mark.slow
def test_a_real_sensor_tells_angles(mini: OpticalModel) -> None:
    settings = SampleSettings(count=16, resolution=(32, 24), photons=60_000, skin="conforming")
    samples = collect(Misalignment(), mini, settings)
    assert signal_to_noise(samples.features, samples.targets) > 2


@pytest.mark.slow
def test_colours_of_a_real_sensor_spread_over_thin_cylinders(mini: OpticalModel) -> None:
    settings = SampleSettings(count=8, resolution=(32, 24), photons=60_000, skin="conforming")
    samples = collect(CylinderRadius(), mini, settings)
    across = samples.features[:, [0, 2]].sum(axis=1)  # red and blue light lie on its two sides
    # At the border of a contact of depth d, normals have a sine of about sqrt(2 d / r).
    assert np.corrcoef(across, samples.targets[:, 0] ** -0.5)[0, 1] > 0.9
