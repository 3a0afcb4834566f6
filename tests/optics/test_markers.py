"""Dots on the skin: where pictures show them, and how dark they are."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from optisense import OpticalModel, load
from optisense.cli.app import app
from optisense.design import Markers, save_design
from optisense.errors import OptiSenseError
from optisense.geometry import Contact, Sphere
from optisense.optics.imaging.markers import MarkerDots, _between_pixels, ink_factor
from optisense.optics.imaging.tactile_image import TactileImage

SIZE = (160, 120)
BALL = Contact(Sphere(3.0), at=(0.5, 0.0), depth=0.8)


@pytest.fixture(scope="module")
def model() -> OpticalModel:
    design = load("gelsight-mini-ideal")
    design.markers = Markers(grid=(9, 7), pitch=2.0, radius=0.4)
    return OpticalModel(design)


@pytest.fixture(scope="module")
def touched(model: OpticalModel) -> TactileImage:
    return model.render([BALL], SIZE, photons=60_000)


def test_dots_are_where_the_flat_gel_has_them(touched: TactileImage) -> None:
    # The Mini's picture is 18.6 mm wide, u to the right and v up.
    places = touched.markers
    column = 80 + places.coordinates[:, 0] * 160 / 18.6
    row = 60 - places.coordinates[:, 1] * 160 / 18.6
    assert places.before == pytest.approx(np.column_stack([column, row]), abs=0.6)


def test_dots_are_dark_where_the_truth_says(
    model: OpticalModel, plain_mini: OpticalModel, touched: TactileImage
) -> None:
    without = plain_mini.render([BALL], SIZE, photons=60_000)
    left = touched.radiance.sum(axis=2) / without.radiance.sum(axis=2)
    column, row = np.floor(touched.markers.after).astype(int).T
    assert left[row, column] == pytest.approx(0.06, abs=0.02)  # 0.03 over the coating's 0.5
    ratio = ink_factor(model.design.markers, model.design.coating)
    assert left.min() == pytest.approx(ratio[0], abs=1e-3)
    # Dots cover pi 0.4^2 of every 4 mm^2.
    inner = left[int(row.min()) : int(row.max()), int(column.min()) : int(column.max())]
    assert 1 - inner.mean() == pytest.approx(0.94 * np.pi * 0.4**2 / 4.0, rel=0.15)


def test_dots_around_a_contact_move_outward(model: OpticalModel, touched: TactileImage) -> None:
    places = touched.markers
    motion = places.displacement @ np.stack([model.surface.u_axis, model.surface.v_axis], axis=1)
    away = places.coordinates - [0.5, 0.0]
    distance = np.linalg.norm(away, axis=1)
    outward = np.einsum("ni,ni->n", motion, away) / distance
    ring = (distance > 1.0) & (distance < 6.0)
    assert ring.sum() > 10
    assert (outward[ring] > 0.005).all()  # a nearly incompressible gel has to go somewhere
    assert outward.max() < 0.2
    # What moves in mm moves in the picture: 8.6 pixels a mm, rows against v.
    moved = (places.after - places.before) * [18.6 / 160, -18.6 / 160]
    flat = distance > 3.0  # perspective shows deep dots elsewhere
    assert moved[flat] == pytest.approx(motion[flat], abs=0.02)


def test_a_dragged_ball_takes_the_skin_along_u_and_v(model: OpticalModel) -> None:
    ball = Contact(Sphere(3.0), depth=0.5, shift=(0.05, 0.1), twist=2.0)
    pressed = model.pressed([ball])
    surface = model.surface
    axes = np.stack([surface.u_axis, surface.v_axis])
    middle, right = (surface.point_at(u, 0.0) for u in (0.0, 0.5))
    points = np.stack([middle.point, right.point])
    moved = pressed.maps(points, np.stack([middle.inward, right.inward])).displacement
    at_rest = model.pressed([replace(ball, shift=(0.0, 0.0), twist=0.0)])
    moved -= at_rest.maps(points, np.stack([middle.inward, right.inward])).displacement
    assert axes @ moved[0] == pytest.approx([0.05, 0.1], abs=1e-3)
    # Seen from outside, u turned counter-clockwise by 90 degrees is -v.
    turned = axes @ (moved[1] - moved[0])
    assert turned == pytest.approx([0.0, -0.5 * np.radians(2.0)], abs=1e-3)


def test_nothing_moves_without_a_contact(model: OpticalModel) -> None:
    places = model.render([], SIZE, photons=20_000).markers
    assert places.after == pytest.approx(places.before, abs=0.05)
    assert places.displacement == pytest.approx(0.0)


def test_a_table_of_them_is_saved_and_goes_with_them(
    plain_mini: OpticalModel, touched: TactileImage, tmp_path: Path
) -> None:
    touched.save(tmp_path)
    with (tmp_path / "markers.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 63
    assert float(rows[0]["column_after"]) == pytest.approx(touched.markers.after[0, 0], rel=1e-4)
    plain_mini.render([], (32, 24), photons=60_000).save(tmp_path)
    assert not (tmp_path / "markers.csv").exists()


def test_dots_beyond_the_edge_are_left_out_with_a_note(model: OpticalModel, tmp_path: Path) -> None:
    design = model.design.copy()
    design.markers = Markers(places=[(0.0, 0.0), (50.0, 0.0)], radius=0.2)
    assert len(MarkerDots.on(design.markers, model.surface).points) == 1
    notes = OpticalModel(design).render([], (16, 12), photons=2_000).settings["notes"]
    assert notes == ["1 of 2 markers lies off the sensing surface, and no picture has them"]
    assert model.marker_notes() == []
    save_design(design, tmp_path / "dotted")
    run = CliRunner().invoke(app, ["check", str(tmp_path / "dotted")])
    assert f"warning: {notes[0]}" in " ".join(run.stdout.split())
    assert "1 warning" in run.stdout


@pytest.mark.parametrize(
    "fields",
    [{}, {"grid": (2, 2)}, {"pitch": 1.0, "places": [(0, 0)]}, {"grid": (0, 2), "pitch": 1.0}],
)
def test_markers_that_make_no_sense_are_refused(fields: dict[str, object]) -> None:
    design = load("gelsight-mini-ideal").model_dump()
    design["markers"] = {"radius": 0.3, **fields}
    with pytest.raises((OptiSenseError, ValueError), match=r"markers|grid"):
        type(load("gelsight-mini-ideal")).model_validate(design)


@pytest.mark.parametrize("radius", [0.01, 0.04, 0.1, 0.3])
def test_dots_of_any_size_cover_their_area(radius: float) -> None:
    """A pixel is 0.1 mm wide; the smallest dots are a twentieth of it."""
    width, count = 0.1, 60
    grid = (np.arange(count) + 0.5) * width
    x, y = np.meshgrid(grid, grid)
    skin = np.stack([x, y, np.zeros_like(x)], axis=2)
    areas = []
    for shift in np.random.default_rng(1).uniform(0, width, (200, 2)):
        middle = np.array([[*(count * width / 2 + shift), 0.0]])
        dots = MarkerDots(np.zeros((1, 2)), middle, np.array([[0.0, 0.0, 1.0]]), radius)
        areas.append(dots.coverage(skin).sum() * width**2)
    assert np.mean(areas) == pytest.approx(np.pi * radius**2, rel=0.02)


def test_displacements_are_interpolated_between_pixels() -> None:
    rows, columns = np.indices((6, 8)) + 0.5
    moved = np.stack([0.01 * columns, 0.02 * rows, 0.0 * rows], axis=2)
    moved[0, 0] = np.nan
    places = np.array([[3.2, 2.9], [1.9, 1.2], [7.9, 5.9]])
    found = _between_pixels(moved, places)
    assert found[0] == pytest.approx([0.032, 0.058, 0.0])
    assert np.isfinite(found[1]).all()  # the one beside the gap
    assert found[2] == pytest.approx([0.075, 0.11, 0.0])  # half a pixel from the picture's edge
