"""Preview pictures obey the laws of reflection and show the values of the entry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from optisense import library
from optisense.design import Absorber, AreaEmitter, Conductor, Dielectric, Diffuse, SpotEmitter
from optisense.design.materials.base import GEL_INDEX
from optisense.design.reflectance import (
    fresnel_dielectric,
    fresnel_metal,
    ggx_density,
    sample_facets,
    smith_shadowing,
)
from optisense.errors import OutputError
from optisense.library import CameraModel, previews
from optisense.library.previews._ball import picture_of_ball
from optisense.library.previews._material import lobes
from optisense.library.previews.camera import border_directions, footprint, footprint_size
from optisense.library.previews.light import equivalent_solid_angle

FloatArray = NDArray[np.float64]

INTEGRAL = 2e-3
"""Relative error of sums over a fine grid of angles."""


class TestReflection:
    def test_straight_on_and_grazing(self) -> None:
        assert fresnel_dielectric(1.0, 1.5) == pytest.approx(0.04)
        assert fresnel_dielectric(0.0, 1.5) == pytest.approx(1.0)

    def test_no_glare_at_brewsters_angle_along_the_plane(self) -> None:
        """There only the light that swings across the plane is left: (n^2-1)^2 / (n^2+1)^2."""
        brewster = np.cos(np.arctan(1.5))
        across = ((1.5**2 - 1) / (1.5**2 + 1)) ** 2
        assert fresnel_dielectric(brewster, 1.5) == pytest.approx(0.5 * across)

    def test_all_is_reflected_beyond_the_critical_angle(self) -> None:
        critical = np.arcsin(1 / 1.5)
        assert fresnel_dielectric(np.cos(critical + 1e-3), 1 / 1.5) == 1.0
        assert fresnel_dielectric(np.cos(critical - 1e-3), 1 / 1.5) < 1.0

    def test_a_metal_without_absorption_is_a_dielectric(self) -> None:
        cosine = np.linspace(0.01, 1.0, 50)
        metal = fresnel_metal(cosine, [1.7], [0.0])[:, 0]
        np.testing.assert_allclose(metal, fresnel_dielectric(cosine, 1.7), rtol=1e-12)

    def test_metals_reflect_as_in_the_simulation(self) -> None:
        """Two ways of writing the same law: complex numbers here, real ones there."""
        from optisense.optics.backend.variant import use_variant

        use_variant("auto")
        import mitsuba as mi

        from optisense.optics.scene.coating_bsdf import fresnel_metal as traced

        eta, k = (1.43, 0.922, 0.686), (7.508, 6.373, 5.635)
        for cosine in (0.05, 0.4, 0.9, 1.0):
            there = traced(mi.Float(cosine), mi.Color3f(*eta), mi.Color3f(*k))
            np.testing.assert_allclose(
                fresnel_metal(cosine, eta, k), np.array(there).ravel(), rtol=2e-5
            )

    @pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
    def test_facets_cover_the_surface_once(self, alpha: float) -> None:
        """The integral of the density times the cosine over the half sphere is 1."""
        angle = np.concatenate([np.linspace(0, 0.5, 40001)[:-1], np.linspace(0.5, np.pi / 2, 4001)])
        middle, step = 0.5 * (angle[1:] + angle[:-1]), np.diff(angle)
        density = ggx_density(np.cos(middle), alpha) * np.cos(middle) * np.sin(middle)
        assert 2 * np.pi * (density * step).sum() == pytest.approx(1.0, rel=INTEGRAL)

    @pytest.mark.parametrize("alpha", [0.1, 0.6])
    def test_sampled_facets_are_those_that_are_seen(self, alpha: float) -> None:
        """The mean of a function over samples is its integral over the visible density."""
        view = np.array([np.sin(0.8), 0.0, np.cos(0.8)])
        random = np.random.default_rng(1).random((200_000, 2))
        facets = sample_facets(np.tile(view, (len(random), 1)), alpha, random)
        np.testing.assert_allclose(np.linalg.norm(facets, axis=1), 1.0)

        theta, phi = np.meshgrid(
            (np.arange(2000) + 0.5) * np.pi / 4000, (np.arange(360) + 0.5) * np.pi / 180
        )
        m = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
        visible = ggx_density(m[..., 2], alpha) * np.maximum(m @ view, 0.0)
        visible *= smith_shadowing(view[2], alpha) / view[2] * np.sin(theta)
        cell = np.pi / 4000 * np.pi / 180
        assert (visible * cell).sum() == pytest.approx(1.0, rel=0.01)
        for axis in (0, 2):
            exact = (visible * m[..., axis] * cell).sum()
            assert facets[:, axis].mean() == pytest.approx(exact, abs=0.01)


class TestMaterials:
    def test_lobes_send_back_the_reflectance(self) -> None:
        """A diffuse lobe, turned about the normal, holds its reflectance of the light."""
        angle = np.linspace(0.0, 90.0, 2001)
        diffuse, metal = lobes(Diffuse(reflectance=(0.5, 0.2, 0.1)).reflection(), angle)
        sine = np.sin(np.radians(angle))[:, None]
        total = (2 * np.pi * diffuse * sine).sum(axis=0) * np.radians(angle[1])
        np.testing.assert_allclose(total, [0.5, 0.2, 0.1], rtol=INTEGRAL)
        assert metal.max() == 0.0

    def test_the_metal_lobe_points_away_from_the_light(self) -> None:
        angle = np.linspace(-90.0, 90.0, 721)
        diffuse, metal = lobes(
            library.coating("mirror-like").reflection().in_medium(GEL_INDEX), angle
        )
        assert diffuse.max() == 0.0
        assert angle[metal[:, 0].argmax()] == pytest.approx(45.0, abs=1.0)

    def test_a_ball_of_nothing_shows_what_is_behind_it(self) -> None:
        """A ball of air has the floor's squares in it; a black one hides them."""
        air = picture_of_ball(Dielectric(ior=1.0), size=60).astype(float)
        black = picture_of_ball(Absorber(), size=60)
        ball = (black == 0).all(axis=2)
        assert 0.4 < ball.mean() < 0.7
        assert air[ball].std() > 20.0
        np.testing.assert_allclose(air[0], black[0], atol=1.0)

    def test_a_ball_is_as_bright_as_its_material(self) -> None:
        def brightness(reflectance: float) -> float:
            grey = Diffuse(reflectance=(reflectance,) * 3)
            return float(picture_of_ball(grey, size=60)[25:35, 25:35].mean())

        assert brightness(0.05) < brightness(0.3) < brightness(0.8)

    def test_a_mirror_shows_the_floor_and_a_rough_metal_blurs_it(self) -> None:
        silver = library.material("mirror-silver")
        assert isinstance(silver, Conductor)
        rough = silver.model_copy(update={"roughness": 0.5})
        sharp = picture_of_ball(silver, size=80)[50:65, 30:50].astype(float)
        blurred = picture_of_ball(rough, size=80)[50:65, 30:50].astype(float)
        assert sharp.std() > 2 * blurred.std()


class TestLights:
    def test_closed_forms(self) -> None:
        lambertian = AreaEmitter(size=(1.0, 1.0))
        assert equivalent_solid_angle(lambertian) == pytest.approx(np.pi, rel=INTEGRAL)
        assert lambertian.half_angle() == pytest.approx(60.0, abs=0.01)
        cone = SpotEmitter(cutoff=30.0, beam=30.0)
        exact = 2 * np.pi * (1 - np.cos(np.radians(30.0)))
        assert equivalent_solid_angle(cone) == pytest.approx(exact, rel=INTEGRAL)

    def test_a_cosine_power_from_an_ies_file(self) -> None:
        lens = library.light("round-5mm-15")
        power = np.log(0.5) / np.log(np.cos(np.radians(7.5)))
        exact = 2 * np.pi / (power + 1)
        assert equivalent_solid_angle(lens) == pytest.approx(exact, rel=INTEGRAL)
        assert lens.half_angle() == pytest.approx(7.5, abs=0.01)


class TestCameras:
    @pytest.mark.parametrize("name", ["pi-v2", "ov5647-fisheye-120"])
    def test_borders_are_where_the_angles_are(self, name: str) -> None:
        camera = library.camera(name)
        wide, high, diagonal = camera.angles()
        x, y, z = border_directions(camera).T
        angle = np.degrees(np.arctan2(np.hypot(x, y), z))
        assert angle.max() == pytest.approx(diagonal / 2, abs=1e-6)
        assert angle[np.abs(y) < 1e-9].max() == pytest.approx(wide / 2, abs=1e-6)
        assert angle[np.abs(x) < 1e-9].max() == pytest.approx(high / 2, abs=1e-6)

    @pytest.mark.parametrize("name", ["pi-v1", "ov5647-fisheye-160"])
    def test_borders_are_those_of_the_simulated_camera(self, name: str) -> None:
        from optisense.optics.backend.variant import use_variant

        use_variant("auto")
        import mitsuba as mi

        from optisense.optics.camera.projection import RayCamera

        camera = library.camera(name)
        rays = RayCamera(
            (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), camera.fov, *camera.resolution,
            equidistant=camera.projection == "equidistant",
        )  # fmt: skip
        width, height = camera.resolution
        _, traced = rays.rays(mi.Float([0.0, width]), mi.Float([height / 2, 0.0]))
        # Image right is direction x up, which is -x here.
        there = np.array(traced).T * [-1.0, 1.0, 1.0]
        ours = border_directions(camera)
        for direction in there:
            assert (ours @ direction).max() == pytest.approx(1.0, abs=1e-5)

    def test_a_perspective_footprint_is_a_rectangle(self) -> None:
        camera = CameraModel(fov=90.0, resolution=(400, 300))
        assert footprint_size(camera, 10.0) == pytest.approx((20.0, 15.0))
        border = footprint(camera, 10.0)
        np.testing.assert_allclose(np.abs(border).max(axis=0), [10.0, 7.5])

    def test_the_footprint_of_a_fisheye_stays_finite(self) -> None:
        border = footprint(library.camera("imx219-fisheye-175"), 10.0)
        assert np.isfinite(border).all()
        assert np.hypot(*border.T).max() == pytest.approx(10 * np.tan(np.radians(80.0)))


@pytest.mark.parametrize(
    ("kind", "name"),
    [("material", "mirror-silver"), ("coating", "diffuse-grey"), ("material", "black-absorber"),
     ("light", "chanzon-5730"), ("light", "round-5mm-30"), ("light", "generic-spot"),
     ("camera", "pi-v3"), ("camera", "ov5647-fisheye-160")],
)  # fmt: skip
def test_each_kind_of_entry_is_drawn_as_a_picture(kind: str, name: str, tmp_path: Path) -> None:
    previews.save(previews.draw(name, library.entry(kind, name)), tmp_path / "new" / "it.png")
    picture = Image.open(tmp_path / "new" / "it.png")
    assert picture.size == (990, 451)
    assert np.asarray(picture).std() > 10.0
    assert [file.name for file in (tmp_path / "new").iterdir()] == ["it.png"]


def test_a_picture_that_can_not_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    figure = previews.draw("pi-v3", library.entry("camera", "pi-v3"))
    with pytest.raises(OutputError, match="--out"):
        previews.save(figure, tmp_path / "file" / "it.png")
