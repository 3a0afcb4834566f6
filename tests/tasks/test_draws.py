"""Random contacts: drawn evenly, from the seed alone, and tilted about the right axes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optisense as ots
from optisense import Contact, OpticalModel, set_value
from optisense.errors import DesignError, TaskError
from optisense.geometry import Cylinder, Plane, Sphere
from optisense.geometry.indenter_kinds import tilted
from optisense.geometry.rotations import turn_about_axes
from optisense.tasks import Misalignment, generate, perceive, reconstruct
from optisense.tasks._draws import ContactDraw, Places


def test_places_are_even_by_area(cylindrical_mini: OpticalModel) -> None:
    places = Places.of(cylindrical_mini)
    rng = np.random.default_rng(1)
    points = np.array([places.draw(rng)[0] for _ in range(20_000)])
    # The skin is z = 3 (1 - (x / a)^2) with a half width a; its area goes with the arc length.
    half = 25.25 / 2
    x = np.linspace(points[:, 0].min(), points[:, 0].max(), 2001)
    density = np.sqrt(1 + (6 * x / half**2) ** 2)
    share = np.cumsum(density) / density.sum()
    drawn = np.searchsorted(np.sort(points[:, 0]), x) / len(points)
    # Kolmogorov's bound at one in ten thousand, and the rays' spacing of 0.06 mm.
    assert np.abs(drawn - share).max() < 2.2 / np.sqrt(len(points)) + 0.06 / 18
    assert points[:, 1].mean() == pytest.approx(0, abs=0.15)


@pytest.mark.parametrize("size", [(60, 80), (60, 60), (80, 40), (80, 60)])
def test_places_fill_pictures_of_any_shape_and_lie_in_the_middles_of_contacts(
    mini: OpticalModel, size: tuple[int, int]
) -> None:
    # A narrow field of view, so that tall pictures show skin only.
    narrow = set_value(mini.design, "camera.fov", 45.0)
    own = OpticalModel(set_value(narrow, "camera.resolution", list(size)))
    for model, resolution in ((own, None), (OpticalModel(narrow), size)):
        places = Places.of(model, resolution)
        rng = np.random.default_rng(1)
        drawn = [places.draw(rng) for _ in range(1000)]
        spots = np.array([spot for _, spot in drawn])
        assert spots.min(axis=0) == pytest.approx((0, 0), abs=0.02)
        assert spots.max(axis=0) == pytest.approx((1, 1), abs=0.02)
        whole = [each for each in drawn if np.abs(each[1] - 0.5).max() < 0.3][:4]
        for (x, y, z), spot in whole:
            touch = Contact(Sphere(1.5), point=(x, y, z), depth=0.1)
            rows, columns = np.nonzero(model.chief_rays(size, [touch], "conforming").contact_mask)
            middle = columns.mean() + 0.5, rows.mean() + 0.5
            assert middle == pytest.approx(spot * size, abs=0.7)


def test_a_range_leaves_the_draws_of_others_alone(mini: OpticalModel) -> None:
    places = Places.of(mini)
    plain, tilting = ContactDraw(), ContactDraw(tilt=20, depth=(0.3, 0.6))
    one, other = (
        draw.draw(draw.parsed(), places, np.random.default_rng([5, 0])) for draw in (plain, tilting)
    )
    assert one.contact.point == other.contact.point
    assert one.contact.rotation == other.contact.rotation
    # The same fraction of another range.
    assert (one.contact.depth - 0.3) / 0.7 == pytest.approx((other.contact.depth - 0.3) / 0.3)


def test_a_tilted_cylinder_touches_with_its_end() -> None:
    mesh = tilted(Cylinder(2.0, 6.0), 0.0, 10.0).mesh(1.0)
    assert mesh.bounds[0, 2] == pytest.approx(0, abs=1e-9)
    lowest = mesh.vertices[mesh.vertices[:, 2] < 1e-6]
    # The middle of its lowest line stays above the place.
    end = 3 * np.cos(np.radians(10)), 0.0
    assert lowest[:, :2] == pytest.approx(np.broadcast_to(end, lowest[:, :2].shape), abs=1e-9)
    # The other end of the lowest line is higher by the length times the sine.
    along = np.array([np.cos(np.radians(10)), 0, -np.sin(np.radians(10))])
    ends = mesh.vertices @ along
    assert np.ptp(ends) == pytest.approx(6.0)
    assert mesh.bounds[1, 2] == pytest.approx(
        6 * np.sin(np.radians(10)) + 4 * np.cos(np.radians(10)), abs=0.01
    )


def test_a_small_tilt_moves_an_indenter_by_little() -> None:
    upright, tilting = Cylinder(2.0, 6.0), tilted(Cylinder(2.0, 6.0), 0.0, 1e-3)
    assert tilting.mesh(np.inf).vertices == pytest.approx(upright.mesh(np.inf).vertices, abs=1e-3)


def test_balls_stay_and_plates_add_their_tilts() -> None:
    assert tilted(Sphere(1.0), 5, 5) == Sphere(1.0)
    assert tilted(Plane(1.0, 2.0, 8.0), 3.0, 4.0) == Plane(4.0, 6.0, 8.0)


def test_turns_are_about_x_then_y() -> None:
    turned = turn_about_axes(90, 90) @ [0, 0, 1]
    assert turned == pytest.approx([0, -1, 0], abs=1e-12)


@pytest.mark.parametrize(
    "settings",
    [
        {"indenters": ()},
        {"indenters": ("plane", "sphere:1", "plane")},
        {"depth": (0.0, 1.0)},
        {"depth": (1.0, 0.5)},
        {"depth": 0.3},
        {"depth": "0.3"},
        {"depth": (0.1, 0.2, 0.3)},
        {"rotation": (0.0, None)},
        {"tilt": 90.0},
    ],
    ids=str,
)
def test_senseless_ranges_are_refused(settings: dict) -> None:
    with pytest.raises(TaskError):
        ContactDraw(**settings)


def test_indenters_are_no_single_text() -> None:
    with pytest.raises(TaskError, match=r"Write \('sphere:1.5',\)"):
        ContactDraw("sphere:1.5")  # type: ignore[arg-type]


def test_a_design_is_no_model(tmp_path: Path) -> None:
    design = ots.load("gelsight-mini-ideal")
    model: Any = design
    for call in (
        lambda: generate(model, tmp_path / "dataset", 1),
        lambda: perceive(Misalignment(), model),
        lambda: reconstruct(model),
    ):
        with pytest.raises(DesignError, match="an optical model is needed"):
            call()
