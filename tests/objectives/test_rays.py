"""AOAP, 2to3PW, coverage and distortion of pinholes and planes against integrals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import dblquad

from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.objectives import Evaluation
from optisense.objectives._aoap import aoap, coverage
from optisense.objectives._footprints import distortion, footprints
from optisense.objectives._projection_warping import projection_warping, triangle_areas
from optisense.objectives.view import View, view_of
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Region, Surface, SurfaceKind
from optisense.optics.transport.chief_rays import ChiefRays, RayOutcome, trace_chief_rays

DISTANCE, FOV = 10.0, 60.0
SLOPE = np.tan(np.radians(FOV) / 2)
PIXELS = (160, 120)

PIXEL_MIDDLES = 2e-4
"""Relative error of a mean over pixel centres, compared with the integral over the picture."""


class PlateModel:
    """A pinhole over a plate of triangles; only what objectives of rays look at."""

    def __init__(self, plate: TriangleMesh, others: Sequence[Piece] = ()) -> None:
        self.sensing = plate
        self.others = others

    def chief_rays(self, resolution: tuple[int, int]) -> ChiefRays:
        camera = RayCamera((0, 0, DISTANCE), (0, 0, -1), (0, 1, 0), FOV, *resolution, False)
        coating = Surface(SurfaceKind.OPAQUE, reflectance=(0.5,) * 3, region=Region.SENSING)
        piece = Piece("plate", self.sensing.vertices, self.sensing.faces, coating)
        scene = RayScene([piece, *self.others])
        return trace_chief_rays(scene, camera, np.arange(len(self.sensing.faces)))

    def share(self, resolution: tuple[int, int] = (320, 240)) -> float:
        """The share of the plate that is seen."""
        return view_of(self.chief_rays(resolution), self.sensing).skin


class RaysOf:
    """Stands for an evaluation whose rays are given or traced."""

    def __init__(self, plate: TriangleMesh, rays: ChiefRays | None = None) -> None:
        self.model = PlateModel(plate)
        self.chief_rays = self.checked_rays = rays or self.model.chief_rays(PIXELS)
        self.sensing_faces = len(plate.faces)

    @property
    def view(self) -> View:
        return view_of(self.chief_rays, self.model.sensing)


def evaluation(plate: TriangleMesh, rays: ChiefRays | None = None) -> Any:
    stand_in: Any = RaysOf(plate, rays)
    assert hasattr(Evaluation, "checked_rays")
    assert hasattr(Evaluation, "sensing_faces")
    assert hasattr(Evaluation, "view")
    return stand_in


def plate(size: float = 40.0, divisions: int = 20, tilt: float = 0.0) -> TriangleMesh:
    """A square plate, turned by `tilt` degrees about the y axis."""
    a = np.radians(tilt)
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    return TriangleMesh.grid((size, size), (divisions, divisions)).transformed(turn)


def test_aoap_of_a_flat_plate_under_a_pinhole_is_the_integral() -> None:
    value, parts, _ = aoap(evaluation(plate(size=20)), coverage_weight=0.01)
    tall = SLOPE * PIXELS[1] / PIXELS[0]
    integral, _ = dblquad(lambda y, x: 1 / np.sqrt(1 + x * x + y * y), -SLOPE, SLOPE, -tall, tall)
    mean = integral / (4 * SLOPE * tall)
    assert parts["mean_cosine"] == pytest.approx(mean, rel=PIXEL_MIDDLES)
    # Of 20 rows of quads (1 mm) those within 5.77 and 4.33 mm of the middle are seen.
    seen = 12 * 10 * 2
    assert parts["triangles"] == 800
    assert parts["coverage"] == pytest.approx(seen / 800, abs=0.01)
    assert value == pytest.approx(mean + 0.01 * parts["coverage"], rel=PIXEL_MIDDLES)


def test_rays_that_miss_count_as_nothing() -> None:
    narrow = TriangleMesh.grid((100.0, 100.0), (1, 1))
    half = TriangleMesh(narrow.vertices + [50.0, 0, 0], narrow.faces)
    whole = aoap(evaluation(plate()))[1]
    missed = aoap(evaluation(half))[1]
    assert missed["pixels_that_see_the_surface"] == pytest.approx(0.5)
    assert missed["mean_cosine"] == pytest.approx(whole["mean_cosine"] / 2, rel=1e-3)
    assert missed["mean_cosine_of_rays_that_arrive"] == pytest.approx(
        whole["mean_cosine"], rel=1e-3
    )


def test_coverage_weighs_as_much_as_asked() -> None:
    seen = evaluation(plate())
    low, parts, _ = aoap(seen, coverage_weight=0.0)
    high, _, _ = aoap(seen, coverage_weight=0.5)
    assert high - low == pytest.approx(0.5 * parts["coverage"])


WIDE, TALL = 2 * DISTANCE * SLOPE, 2 * DISTANCE * SLOPE * PIXELS[1] / PIXELS[0]
"""Size (mm) of the rectangle that the pinhole sees of a plate: 11.55 x 8.66."""


@pytest.mark.parametrize("divisions", [1, 7, 80])
@pytest.mark.parametrize("resolution", [(80, 60), (160, 120), (640, 480)])
def test_coverage_is_the_area_in_view_for_any_triangles_and_rays(
    divisions: int, resolution: tuple[int, int]
) -> None:
    found = PlateModel(plate(20, divisions)).share(resolution)
    assert found == pytest.approx(WIDE * TALL / 20**2, rel=0.02)


def test_coverage_of_a_surface_that_is_wholly_in_view_is_one() -> None:
    assert PlateModel(plate(7, 1)).share() == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("divisions", [(3, 2), (60, 40)])
def test_coverage_of_a_coarse_or_fine_cylinder_is_its_arc_in_view(
    divisions: tuple[int, int],
) -> None:
    """A trough of radius 8 mm along y, of which the camera sees all angles within its picture."""
    radius, half = 8.0, np.radians(80.0)
    grid = TriangleMesh.grid((2.0 * half, 4.0), (60, divisions[1]))
    angle, along = grid.vertices[:, 0], grid.vertices[:, 1]
    bent = np.stack([radius * np.sin(angle), along, radius * (1.0 - np.cos(angle))], axis=1)
    trough = TriangleMesh(bent, grid.faces)
    # The picture's side, x = (DISTANCE - z) * SLOPE, meets the cylinder at this angle.
    angles = np.linspace(0.0, half, 100_000)
    seen = radius * np.sin(angles) <= (DISTANCE - radius * (1.0 - np.cos(angles))) * SLOPE
    assert PlateModel(trough).share() == pytest.approx(angles[seen].max() / half, rel=0.02)


def test_coverage_leaves_out_what_a_part_hides() -> None:
    """A blocker at half the distance hides twice its width and height."""
    black = Surface(SurfaceKind.OPAQUE, reflectance=(0.0,) * 3)
    screen = TriangleMesh.grid((2.0, 3.0), (1, 1))
    raised = Piece("screen", screen.vertices + [1.0, 0.5, 5.0], screen.faces, black)
    found = PlateModel(plate(20, 1), [raised]).share()
    assert found == pytest.approx((WIDE * TALL - 4.0 * 6.0) / 20**2, rel=0.02)


def plate_at_a_mirror() -> PlateModel:
    """A mirror upright at x = 3 mm shows the camera the places left of it a second time."""
    shiny = Surface(SurfaceKind.MIRROR, reflectance=(1.0,) * 3)
    flat = TriangleMesh.grid((9.0, 30.0), (1, 1))
    wall = np.stack(
        [0 * flat.vertices[:, 0] + 3.0, flat.vertices[:, 1], flat.vertices[:, 0] + 4.51], 1
    )
    return PlateModel(plate(20, 1), [Piece("mirror", wall, flat.faces, shiny)])


def test_triangles_across_the_foot_of_a_mirror_are_left_out() -> None:
    """Their edges are as short as others, but lead to the mirror image of the plate."""
    rays = plate_at_a_mirror().chief_rays((320, 240))
    assert (rays.reflections > 0).any()
    assert np.array_equal(rays.reflections > 0, rays.mirrors > 0)
    found = triangle_areas(rays.points, rays.hit, rays.reflections)
    assert triangle_areas(rays.points, rays.hit).discontinuous == 0
    # The foot of the mirror runs along one column of quads.
    assert found.discontinuous == 2 * 239
    folded = triangle_areas(rays.points, rays.hit).areas[~np.isfinite(found.areas)]
    assert np.nanmin(folded) < 0.9 * np.nanmin(found.areas)


def test_coverage_counts_what_a_mirror_shows_again_once() -> None:
    model = plate_at_a_mirror()
    rays = model.chief_rays((320, 240))
    twice = rays.hit & (rays.mirrors > 0)
    assert 0.15 < twice.mean() < 0.3
    seen = (0.5 * WIDE + 3.0) * TALL  # and nothing behind the mirror
    assert model.share() == pytest.approx(seen / 20**2, rel=0.02)


@pytest.mark.parametrize("tilt", [10.0, 30.0])
def test_warping_of_a_tilted_plane_is_the_closed_form(tilt: float) -> None:
    value, parts, _ = projection_warping(evaluation(plate(size=400, divisions=1, tilt=tilt)))
    # A pixel of solid angle dx dy / |d|^3 covers an area of (n . d)^-3, d = (x, y, 1): its powers
    # integrate in closed form along x.
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))

    def mean_of_power(p: int) -> float:
        near, far = (c - s * SLOPE) ** (1 - p), (c + s * SLOPE) ** (1 - p)
        return float((near - far) / ((p - 1) * 2 * s * SLOPE))

    first, second = mean_of_power(3), mean_of_power(6)
    assert value == pytest.approx(first / np.sqrt(second - first**2), rel=0.02)
    assert parts["triangles"] == 2 * 159 * 119


def test_the_finer_the_picture_the_nearer_the_closed_form() -> None:
    model = PlateModel(plate(size=400, divisions=1, tilt=20.0))
    c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
    powers = [
        ((c - s * SLOPE) ** (1 - p) - (c + s * SLOPE) ** (1 - p)) / ((p - 1) * 2 * s * SLOPE)
        for p in (3, 6)
    ]
    exact = powers[0] / np.sqrt(powers[1] - powers[0] ** 2)
    off = []
    for pixels in ((40, 30), (160, 120), (640, 480)):
        rays = model.chief_rays(pixels)
        areas = triangle_areas(rays.points, rays.hit).areas.astype(np.float64)
        off.append(abs(areas.mean() / areas.std() / exact - 1))
    assert off[0] > off[1] > off[2]
    assert off[2] < 0.005


def test_a_plane_parallel_to_the_picture_is_even_up_to_rounding() -> None:
    value, _, _ = projection_warping(evaluation(plate(400, 1)))
    assert value > 1e3


@pytest.mark.parametrize("scale", [0.01, 7.0])
def test_warping_does_not_depend_on_the_scale(scale: float) -> None:
    plane = plate(400, 1, 25.0)
    rays = PlateModel(plane).chief_rays(PIXELS)
    larger = ChiefRays(**{**rays.__dict__, "points": (scale * rays.points).astype(np.float32)})
    one, other = (projection_warping(evaluation(plane, each))[0] for each in (rays, larger))
    assert one == pytest.approx(other, rel=1e-3)


def test_areas_add_up_to_the_surface_seen() -> None:
    rays = PlateModel(plate()).chief_rays((41, 31))
    found = triangle_areas(rays.points, rays.hit)
    corners = rays.points[0, 0], rays.points[-1, -1]
    assert np.nansum(found.areas) == pytest.approx(
        abs(corners[0][0] - corners[1][0]) * abs(corners[0][1] - corners[1][1]), rel=1e-4
    )


def test_triangles_next_to_missed_pixels_are_left_out() -> None:
    rays = PlateModel(plate()).chief_rays((10, 8))
    hit = rays.hit.copy()
    hit[3, 4] = False
    found = triangle_areas(rays.points, hit)
    # A corner inside the picture belongs to six triangles.
    assert found.missed == 6
    assert np.isnan(found.areas).sum() == 6
    assert found.discontinuous == 0


def test_triangles_that_leap_over_a_step_are_left_out() -> None:
    low = TriangleMesh.grid((20.0, 40.0)).transformed(np.eye(3))
    left = TriangleMesh(low.vertices + [-10.0, 0, 0], low.faces)
    right = TriangleMesh(low.vertices + [10.0, 0, 5.0], low.faces)
    step = TriangleMesh.joined([left, right])
    rays = PlateModel(step).chief_rays((40, 30))
    assert rays.hit.all()
    found = triangle_areas(rays.points, rays.hit)
    # One column of quads lies across the step.
    assert found.discontinuous == 2 * 29
    areas = found.areas[np.isfinite(found.areas)]
    # Both sides are parallel to the picture: at distances of 10 and 5 each is even.
    assert len(np.unique(areas.round(4))) == 2
    assert areas.max() / areas.min() == pytest.approx(4.0, rel=1e-3)


def test_a_surface_seen_edge_on_does_not_leap() -> None:
    # Along a row, points run to the horizon of a ball as the square root of the distance to it.
    x = np.sqrt(np.arange(12.0, 0.0, -1.0))
    across, along = np.meshgrid(x, np.arange(5.0))
    points = np.stack([across, along, np.zeros((5, 12))], axis=-1)
    found = triangle_areas(points.astype(np.float32), np.ones((5, 12), dtype=bool))
    assert found.discontinuous == 0


def test_a_sensor_that_sees_nothing_has_a_reason() -> None:
    rays = PlateModel(plate()).chief_rays((10, 8))
    nothing = ChiefRays(
        **{**rays.__dict__, "outcome": np.full_like(rays.outcome, int(RayOutcome.ESCAPED))}
    )
    for objective in (aoap, projection_warping):
        with pytest.raises(ObjectiveError, match=r"^0 of the 100 .* it needs"):
            objective(evaluation(plate(), nothing))


def test_an_upright_view_has_no_distortion() -> None:
    value, parts, _ = distortion(evaluation(plate()))
    assert value == pytest.approx(1.0, abs=1e-4)
    assert parts["area_variation"] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("tilt", [15.0, 40.0])
def test_distortion_of_a_tilted_plate_is_that_of_the_projection(tilt: float) -> None:
    """The singular values of the derivative of where a pixel's ray meets the plane."""
    tilted = plate(size=100.0, tilt=tilt)
    value, parts, _ = distortion(evaluation(tilted))
    normal = tilted.face_normals[0]
    pixel = 2 * SLOPE / PIXELS[0]

    def meets(x: Any, y: Any) -> Any:
        direction = np.stack([x, y, -np.ones_like(x)], axis=-1)
        origin = np.array([0.0, 0.0, DISTANCE])
        return direction * (-(origin @ normal) / (direction @ normal))[..., None]

    x = (np.arange(1, PIXELS[0]) - PIXELS[0] / 2) * pixel
    y = (np.arange(1, PIXELS[1]) - PIXELS[1] / 2) * pixel
    x, y = np.meshgrid(x, y)
    h = 1e-5
    along_x = (meets(x + h, y) - meets(x - h, y)) / (2 * h)
    along_y = (meets(x, y + h) - meets(x, y - h)) / (2 * h)
    sizes = np.linalg.svd(np.stack([along_x, along_y], axis=-1), compute_uv=False)
    expected = np.exp(np.log(sizes[..., 0] / sizes[..., 1]).mean())
    assert value == pytest.approx(expected, rel=1e-3)
    area = sizes.prod(axis=-1)
    assert parts["area_variation"] == pytest.approx(area.std() / area.mean(), rel=0.01)
    assert parts["mean_length"] == pytest.approx(sizes[..., 0].mean() * pixel, rel=0.01)


def test_footprints_that_leap_over_a_gap_are_left_out() -> None:
    left = TriangleMesh.grid((10.0, 40.0), (2, 8))
    lower = TriangleMesh.grid((10.0, 40.0), (2, 8))
    both = TriangleMesh(
        np.concatenate([left.vertices + [-5.0, 0, 0], lower.vertices + [5.0, 0, -8.0]]),
        np.concatenate([left.faces, lower.faces + len(left.vertices)]),
    )
    rays = evaluation(both).checked_rays
    long, wide = footprints(rays.points, rays.hit)
    known = np.isfinite(long)
    assert 0 < np.count_nonzero(~known) < 4 * PIXELS[1]
    assert (long[known] / wide[known]).max() < 1.1


def test_too_few_footprints_are_no_score() -> None:
    with pytest.raises(ObjectiveError, match="of the 100 footprints"):
        distortion(evaluation(plate(size=0.5, divisions=1)))


def test_coverage_is_that_of_aoap() -> None:
    view = evaluation(plate(size=20))
    value, parts, _ = coverage(view)
    assert value == aoap(view)[1]["coverage_by_area"]
    assert parts["by_triangles"] == aoap(view)[1]["coverage"]
    assert value * 400.0 == parts["area"]
