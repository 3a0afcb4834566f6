"""Light of lone bright pixels, and the noise of the noisiest places."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

import optisense as ots
from optisense import sensors
from optisense.design import AreaEmitter, Dielectric, Light, SensorDesign
from optisense.design.reflectance import fresnel_dielectric, ggx_density, smith_shadowing
from optisense.geometry import Contact, Sphere, TriangleMesh
from optisense.optics import OpticalModel
from optisense.optics.imaging import lamp_images
from optisense.optics.imaging.lamp_images import without_specks

WIDTH, HEIGHT = 80, 60
NOWHERE = np.zeros((HEIGHT, WIDTH), dtype=bool)


def scattered() -> NDArray[np.float32]:
    """Few bright pixels, as of single paths that meet a lamp."""
    values = np.zeros((HEIGHT, WIDTH), dtype=np.float32)
    random = np.random.default_rng(1)
    values[random.integers(0, HEIGHT, 12), random.integers(0, WIDTH, 12)] = 5.0
    return values


def spread(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """An image (h, w) as a layer (h, w, 3) without specks."""
    (layer,) = without_specks(np.repeat(values[None, ..., None], 3, axis=-1), NOWHERE)
    return layer


class TestLonePixels:
    def test_their_light_is_spread_and_none_is_lost(self) -> None:
        values = scattered()
        layer = spread(values)
        np.testing.assert_allclose(layer.sum(axis=(0, 1)), values.sum(), rtol=1e-5)
        assert layer.max() < 0.05 * values.max()
        assert (layer >= 0.0).all()

    def test_the_reflection_of_a_lamp_stays(self) -> None:
        values = np.zeros((HEIGHT, WIDTH), dtype=np.float32)
        values[20:24, 30:33] = 5.0
        layer = spread(values)
        np.testing.assert_allclose(layer[..., 1], values)


class TestMirroredLamp:
    """A lamp beside the camera, which the near face of the light guide mirrors.

    Its mirror image is behind that face, as far as the lamp is in front of it, and its radiance is
    that of the lamp times the Fresnel reflectance at normal incidence (the angle is 5 degrees).
    """

    SIDE = 0.15
    """Side (mm) of the lamp: its mirror image is half a pixel wide and high."""
    NOISE = 0.25
    """Relative noise, three standard errors, of the samples of four images."""

    def test_is_seen_where_it_is(self) -> None:
        design = sensors.gelsight_mini_ideal()
        lamp = (1.89, 0.145, -20.0)  # its image lies within one pixel
        group = design.lights["green"]
        group.emitter = AreaEmitter(shape="rectangle", size=(self.SIDE, self.SIDE))
        group.lights = [Light(position=lamp, direction=(0.0, 0.0, 1.0))]
        model = OpticalModel(design)
        face = float(design.meshes["guide"].bounds[0, 2])
        eye = np.array(design.camera.position)
        away = np.array([lamp[0], lamp[1], 2 * face - lamp[2]]) - eye
        focal = WIDTH / 2 / np.tan(np.radians(design.camera.fov / 2))
        # The camera looks along +z with +y at the top, so that +x is at the left.
        film = WIDTH / 2 - focal * away[0] / away[2], HEIGHT / 2 - focal * away[1] / away[2]
        contact = Contact(Sphere(radius=1.5), at=(-1.8, 0.1), depth=0.5)
        images = [
            model.render([contact], (WIDTH, HEIGHT), 100_000, seed=seed, skin="conforming")
            for seed in range(4)
        ]
        assert images[0].contact_mask[int(film[1]), int(film[0])]
        image = np.mean([each.unit_layers["green"][..., 1] for each in images], axis=0)
        guide = design.materials["acrylic"]
        assert isinstance(guide, Dielectric)
        index = guide.ior
        reflectance = ((index - 1) / (index + 1)) ** 2
        pixels = (self.SIDE * focal / away[2]) ** 2
        light = reflectance / (np.pi * self.SIDE**2) * pixels
        rows, columns = np.indices(image.shape) + 0.5
        close = np.hypot(rows - film[1], columns - film[0]) < 2.0
        assert image[close].sum() == pytest.approx(light, rel=self.NOISE)
        assert image[~close].max() < 0.05 * image[close].max()
        # The mirror image is the same without the contact, so that it is not a part of a response.
        bare = model.render([], (WIDTH, HEIGHT), 100_000, seed=0).unit_layers["green"][..., 1]
        touched = images[0].unit_layers["green"][..., 1]
        assert bare[close].sum() == pytest.approx(touched[close].sum(), rel=0.05)


class TestGlare:
    """A black skin behind the frosted face of a light guide, which scatters a lamp to the camera.

    The radiance of a pixel is the integral of the lamp's radiance over its window, with the
    microfacet BRDF of the face (Walter et al. 2007, equation 20). Light that enters the guide is
    absorbed; what the other faces of the guide send back adds 2 %.
    """

    LAMP, SIDE = (9.0, 2.0, -25.0), 4.0
    SIZE = 64, 48
    MEAN_ERROR = 0.07
    """Relative error of the mean: these 2 %, and four standard errors."""
    NOISE = 0.25
    """Mean difference of pixels, relative to the mean: twice the noise of the glare; that of single
    samples that meet the lamp is 2."""
    SPOT = 0.7
    """Share of the highest radiance above which a pixel is one of the middle of the spot. Averaging
    the same samples changes the light there by a standard deviation of 0.5 % at a roughness of
    0.05; if one factor alone kept the sum, the spot would lose 2 %."""

    def design(self, alpha: float) -> SensorDesign:
        """Return the sensor whose face has this roughness."""
        design = sensors.gelsight_mini_ideal()
        design = ots.set_value(design, "coating.reflectance", (0.0, 0.0, 0.0))
        faces = {"low": {"direction": (0, 0, -1), "within": 10, "roughness": alpha}}
        design = ots.set_value(design, "parts.guide.faces", faces)
        group = design.lights["green"]
        group.emitter = AreaEmitter(shape="rectangle", size=(self.SIDE, self.SIDE))
        group.lights = [Light(position=self.LAMP, direction=(0.0, 0.0, 1.0))]
        return design

    def glare(self, design: SensorDesign) -> NDArray[np.float32]:
        """Return the radiance (h, w) in an image."""
        image = OpticalModel(design).render([], self.SIZE, 10_000)
        return image.unit_layers["green"][..., 1]

    def expected(self, design: SensorDesign, alpha: float) -> NDArray[np.float64]:
        """Return the radiance (h, w) of the face for a lamp of 1 mW."""
        width, height = self.SIZE
        rows, columns = np.indices((height, width)) + 0.5
        focal = width / 2 / np.tan(np.radians(design.camera.fov / 2))
        eye = np.array(design.camera.position)
        face = float(design.meshes["guide"].bounds[0, 2])
        # The camera looks along +z with +y at the top, so that +x is at the left.
        way = np.stack([width / 2 - columns, height / 2 - rows, np.full((height, width), focal)])
        seen = eye[:, None, None] + way * ((face - eye[2]) / focal)
        total = np.zeros((height, width))
        steps = (np.arange(24) + 0.5) / 24 - 0.5
        for x, y in np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * self.SIDE:
            place = np.array(self.LAMP) + (x, y, 0)
            light, view = place[:, None, None] - seen, eye[:, None, None] - seen
            distance = np.linalg.norm(light, axis=0)
            light, view = light / distance, view / np.linalg.norm(view, axis=0)
            half = (light + view) / np.linalg.norm(light + view, axis=0)
            cosine, towards = -light[2], -view[2]
            brdf = fresnel_dielectric((half * view).sum(axis=0), self.index(design))
            brdf *= ggx_density(-half[2], alpha) * smith_shadowing(cosine, alpha)
            brdf *= smith_shadowing(towards, alpha) / (4 * cosine * towards)
            total += brdf * cosine * cosine / distance**2
        return total / steps.size**2 / np.pi

    @staticmethod
    def index(design: SensorDesign) -> float:
        guide = design.materials["acrylic"]
        assert isinstance(guide, Dielectric)
        return guide.ior

    @pytest.mark.parametrize(("alpha", "change"), [(0.05, 0.01), (0.3, 0.04)])
    def test_is_smooth_and_none_is_lost(
        self, alpha: float, change: float, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        design = self.design(alpha)
        glare, expected = self.glare(design), self.expected(design, alpha)
        assert glare.mean() == pytest.approx(expected.mean(), rel=self.MEAN_ERROR)
        assert np.abs(glare - expected).mean() < self.NOISE * expected.mean()
        monkeypatch.setattr(lamp_images, "GLARE_WIDTHS", (0.0,))  # no pixels are averaged
        bare = self.glare(design)
        assert glare.sum() == pytest.approx(bare.sum(), rel=1e-5)
        spot = expected > self.SPOT * expected.max()
        assert glare[spot].sum() == pytest.approx(bare[spot].sum(), rel=change)


def steep() -> SensorDesign:
    """A Mini whose skin goes down the sides of its gel, with lamps 0.2 mm off them below."""
    design = sensors.gelsight_mini_ideal()
    (x0, y0, z), (x1, y1, z1) = design.meshes["gel"].bounds.tolist()
    gel = TriangleMesh.box((x0, y0, z), (x1, y1, z1), (50, 41, 8))
    design.meshes["gel"] = gel
    skin = gel.with_faces(gel.faces[gel.face_normals[:, 2] > -0.5])
    design.meshes["skin"] = skin.compacted().flipped()
    places = {
        "red": [(x0 + 0.2, y) for y in (-6, 0, 6)],
        "green": [(x1 - 0.2, y) for y in (-6, 0, 6)],
        "blue": [(x, y1 - 0.2) for x in (-8, 0, 8)],
    }
    for name, group in design.lights.items():
        group.lights = [
            Light(position=(x, y, z - 0.5), direction=(0.0, 0.0, 1.0)) for x, y in places[name]
        ]
    design.camera.fov = 75.0
    return design


@pytest.fixture(scope="module")
def model() -> OpticalModel:
    return OpticalModel(steep())


def test_no_lone_bright_pixel_is_on_a_steep_skin(model: OpticalModel) -> None:
    image = model.render([], photons=200_000, resolution=(320, 240))
    radiance = image.radiance
    inside = ndimage.binary_erosion(np.isfinite(image.points[..., 0]), iterations=2)
    around = ndimage.median_filter(radiance, size=(5, 5, 1))
    least = 0.3 * radiance[inside].mean(axis=0)
    lone = (radiance > 4.0 * np.maximum(around, least)).any(axis=-1) & inside
    assert not lone.any()


def test_the_noise_is_told_where_it_is(model: OpticalModel) -> None:
    """Places near the lamps are noisier than all are in the mean; both fall with more photons."""
    found = []
    for photons in (200_000, 800_000):
        settings = model.render([], photons=photons, resolution=(160, 120)).settings
        found.append([settings[f"noise_{kind}_percent"] for kind in ("reached", "of_worst_places")])
    few, many = np.array(found)
    assert few[1] > 1.3 * few[0] and many[1] > 1.3 * many[0]
    assert (many < 0.85 * few).all()
