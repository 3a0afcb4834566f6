"""The optical model: layers, seeds, updates, and its two estimators against each other."""

from __future__ import annotations

import json
import math
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparing import ROUNDING, SCORE_ROUNDING, TURNED_BESIDE_CONTACT, same_light

from optisense import Contact, OpticalModel, SensorDesign, Sphere
from optisense.design import set_value
from optisense.errors import ContactError, DesignError, LibraryError, RenderError
from optisense.optics import RenderProgress, TactileImage
from optisense.optics.backend.stages import Stage
from optisense.optics.radiance_cache import store
from optisense.optics.radiance_cache._direction_bins import COARSE_BINS
from optisense.sensors import build
from optisense.tasks import ReconstructionSettings, reconstruct

PIXELS = (80, 60)
PHOTONS = 150_000
FEW_PIXELS = (48, 36)
FEW_PHOTONS = 60_000
"""Size and photons of images that are compared with images of the same photons."""
BALL = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
ASIDE = Contact(Sphere(radius=2.0), at=(3.0, -2.0), depth=0.6)

IN_CONTACT = {"gelsight-mini-ideal": 0.03, "gelsight-mini-ideal-cylindrical": 0.08}
"""Field against photon mapping, relative, over the whole contact: of green, and of red and blue
together, which mirror each other. Measured with three seeds: flat -1 to 2.5 %; cylinder, where few
photons reach the ball's flanks, -4 to 5 %."""

PRESSED = {
    "gelsight-mini-ideal": BALL,
    "gelsight-mini-ideal-cylindrical": Contact(Sphere(radius=3.0), at=(0.0, 0.0), depth=1.0),
}
"""The contact: on the cylinder one of more pixels, whose light is known from fewer photons."""

TRACED = {
    "gelsight-mini-ideal": (500_000, 1_000_000),
    "gelsight-mini-ideal-cylindrical": (600_000, 1_500_000),
}
"""Photons of the field and of each picture by photon mapping."""

PER_PIXEL = {"gelsight-mini-ideal": 0.07, "gelsight-mini-ideal-cylindrical": 0.2}
"""RMS error over the contact's pixels without the noise of photon mapping. Measured with three
seeds: flat 0.01 to 0.05; cylinder 0.03 to 0.13.
"""

OUTSIDE = 0.02

TURNED = 0.02
"""Relative difference of an image's light where a contact is flat, between bins of directions in
two orientations. The noise is 0.005."""


@cache
def model(name: str = "gelsight-mini-ideal", specularity: float = 0.0) -> OpticalModel:
    return OpticalModel(design(name, specularity), "llvm")


def design(name: str = "gelsight-mini-ideal", specularity: float = 0.0) -> SensorDesign:
    return set_value(build(name), "coating.specularity", specularity)


def render(of: OpticalModel, *contacts: Contact, seed: int = 0) -> TactileImage:
    return of.render(contacts, resolution=PIXELS, photons=PHOTONS, seed=seed)


@cache
def pressed() -> TactileImage:
    """The image of a ball that tests share."""
    return render(model(), BALL)


def same(a: TactileImage, b: TactileImage) -> bool:
    """Of images with contacts, too."""
    return all(
        same_light(layer, b.layers[name], TURNED_BESIDE_CONTACT) for name, layer in a.layers.items()
    )


def mean_layers(image: TactileImage) -> np.ndarray:
    """(groups,) the mean light of each light group."""
    return np.array([layer.mean(dtype=float) for layer in image.layers.values()])


def test_layers_add_up_to_the_image() -> None:
    image = pressed()
    assert list(image.layers) == ["red", "green", "blue"]
    assert image.radiance == pytest.approx(np.sum(list(image.layers.values()), axis=0), rel=1e-6)
    for number, layer in enumerate(image.layers.values()):
        # Each group of GelSight Mini has a pure colour, and its coating is grey.
        assert layer[..., number].mean() > 0
        assert np.all(np.delete(layer, number, axis=2) == 0)


def test_groups_rendered_together_add_up_to_the_same_lights_in_one_group() -> None:
    parted = build("gelsight-mini-ideal")
    for name in parted.lights:
        parted = set_value(parted, f"lights.{name}.colour", [1, 1, 1])
    joined = parted.copy()
    first = next(iter(joined.lights.values()))
    lamps = [lamp for group in joined.lights.values() for lamp in group.lights]
    joined.lights = {"all": first.model_copy(update={"lights": lamps})}
    images = [
        OpticalModel(each, "llvm").render(
            [BALL], resolution=PIXELS, photons=PHOTONS, estimator="sppm"
        )
        for each in (parted, joined)
    ]
    assert images[0].settings["photons"] == pytest.approx(PHOTONS, rel=0.01)
    a, b = (image.radiance for image in images)
    assert np.abs(a - b).max() < ROUNDING * b.max()


def test_a_seed_gives_the_same_image_whatever_was_pressed_before_and_another_does_not() -> None:
    used = OpticalModel(design(), "llvm")
    render(used, ASIDE)
    render(used)
    # No test presses anything but this ball into the shared model.
    assert same(render(used, BALL), pressed())
    assert not same(render(used, BALL, seed=5), pressed())


def test_other_lights_scale_their_layers_as_in_an_image_relit() -> None:
    plain, changed = pressed(), OpticalModel(design(), "llvm")
    changed.update("lights.red.flux", 2 * changed.design.lights["red"].flux)
    changed.update("lights.blue.colour.g", 0.4)
    expected = render(changed, BALL)
    assert same_light(expected.layers["red"], 2 * plain.layers["red"])
    assert same_light(expected.layers["green"], plain.layers["green"])
    lights = changed.design.lights
    relit = plain.relight({name: lights[name].channel_flux() for name in ("red", "blue")})
    assert same(relit, expected)
    with pytest.raises(RenderError, match="no light group 'rde'"):
        plain.relight({"rde": (1, 1, 1)})
    for wrong in (2.0, (-1, 0, 0), (math.nan, 0, 0), (1, 0), ("1", "0", "0")):
        with pytest.raises(RenderError, match="power of the light group 'red'"):
            plain.relight({"red": wrong})


def test_an_image_does_not_depend_on_what_was_rendered_before() -> None:
    """With other contacts, coatings and limits; photons are guided since the first image."""
    wanted = design(specularity=0.3)
    used = OpticalModel(design(), "llvm")
    used.render([ASIDE], FEW_PIXELS, FEW_PHOTONS)
    used.set_design(wanted)
    used.render((), FEW_PIXELS, 2 * FEW_PHOTONS)
    fresh = OpticalModel(wanted, "llvm")
    limits = {"photons": 4 * FEW_PHOTONS, "noise": 90.0}
    got, expected = (each.render([BALL], FEW_PIXELS, **limits) for each in (used, fresh))
    assert got.settings["photons"] == expected.settings["photons"]
    assert same(got, expected)


def test_cells_do_not_depend_on_the_coating_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """With less memory for tallies, the coloured coating of a Mini takes larger cells, as those of
    sensors with many light groups do.
    """
    monkeypatch.setattr(store, "MAX_TALLY_BYTES", store.MAX_TALLY_BYTES / 16)
    wanted = set_value(design(), "coating.reflectance", [0.7, 0.5, 0.2])
    used = OpticalModel(design(), "llvm")
    before = used._store.cells.cells
    used.set_design(wanted)
    assert used._store.cells.cells == OpticalModel(wanted, "llvm")._store.cells.cells < before


def test_the_reading_of_specularity_changes_a_model_as_it_makes_one() -> None:
    design = set_value(build("gelsight-mini-ideal"), "coating.specularity", 0.3)
    used = OpticalModel(design, "llvm")

    def means(of: OpticalModel) -> np.ndarray:
        return mean_layers(of.render([BALL], FEW_PIXELS, FEW_PHOTONS))

    before = means(used)
    wanted = set_value(design, "coating.scattering", "conductor")
    used.update("coating.scattering", "conductor")
    got = means(used)
    np.testing.assert_allclose(got, means(OpticalModel(wanted, "llvm")), rtol=SCORE_ROUNDING)
    assert np.abs(got / before - 1.0).max() > 0.05


def test_a_model_that_became_another_design_sees_what_a_new_model_of_it_sees() -> None:
    start = build("gelsight-svelte")
    used = OpticalModel(start, "llvm")
    used.chief_rays(PIXELS)
    for path, value, resolved_anew in (
        ("cages.M1.blend", 0.3, False),
        ("camera.fov", 50.0, False),
        ("lights.red.flux", 3.0, False),
        ("materials.silicone-xp565.ior", 1.5, True),
        ("coating.specularity", 0.7, False),
    ):
        start = set_value(start, path, value)
        media = used.scenes.assembly.media
        used.set_design(start)
        assert (used.scenes.assembly.media is not media) == resolved_anew
        fresh = OpticalModel(start, "llvm")
        got, expected = used.chief_rays(PIXELS), fresh.chief_rays(PIXELS)
        assert np.array_equal(got.outcome, expected.outcome)
        assert np.array_equal(got.points, expected.points)
        assert np.array_equal(got.face, expected.face)
        assert np.array_equal(used.surface.origin, fresh.surface.origin)


def test_a_design_that_cannot_be_built_leaves_the_model_as_it_was() -> None:
    used = OpticalModel(design(), "llvm")
    before = used.chief_rays(PIXELS).points
    with pytest.raises(LibraryError):
        used.update("lights.red.model", "no-such-led")
    assert used.design.lights["red"].model == design().lights["red"].model
    assert np.array_equal(used.chief_rays(PIXELS).points, before)


def test_edits_of_a_models_design_have_no_effect_until_it_adopts_it() -> None:
    used = OpticalModel(design(), "llvm")
    before = render(used)
    edited = used.design
    edited.coating.reflectance = (0.05, 0.05, 0.05)
    edited.lights["red"].flux = 0.0
    edited.camera.fov = 20.0
    assert same(render(used), before)
    used.set_design(edited)
    after = render(used)
    assert after.layers["red"].max() == 0.0
    assert after.layers["blue"].mean() < 0.5 * before.layers["blue"].mean()
    with pytest.raises(DesignError, match="a design is needed"):
        used.set_design("gelsight-mini")  # type: ignore[arg-type]


def test_only_contacts_lights_what_the_whole_image_shows_there_and_nothing_else() -> None:
    whole = pressed()
    only = model().render([BALL], PIXELS, PHOTONS, only_contacts=True)
    mask = only.contact_mask
    np.testing.assert_array_equal(mask, whole.contact_mask)
    assert (only.radiance[~mask] == 0).all()
    # What a pixel shows does not depend on which others are rendered.
    assert same_light(only.radiance[mask], whole.radiance[mask])


@pytest.mark.parametrize(
    ("skin", "square_of_radius"),
    # The elastic radius is that of ContactMechanics for the layer (tests/mechanics).
    [("conforming", 1.5**2 - 0.7**2), ("elastic", 1.0835**2)],
)
def test_ground_truth_of_a_ball_is_a_sphere(skin: str, square_of_radius: float) -> None:
    image = (
        pressed() if skin == "elastic" else model().render([BALL], PIXELS, FEW_PHOTONS, skin=skin)
    )
    inside = image.contact_mask
    middle = np.array([0, 0, 1.5 - 0.8])
    away = image.points[inside] - middle
    # The ball is a mesh of fine facets.
    assert np.linalg.norm(away, axis=1) == pytest.approx(1.5, abs=0.01)
    unit = away / np.linalg.norm(away, axis=1, keepdims=True)
    assert np.abs(np.abs((unit * image.normals[inside]).sum(axis=1)) - 1).max() < 0.01
    area = inside.sum() * (18.6 / PIXELS[0]) ** 2
    assert area == pytest.approx(np.pi * square_of_radius, rel=0.1)


@pytest.mark.parametrize(
    ("resolution", "message"),
    [
        ((100_000, 100_000), "too large"),
        ((np.int32(100_000), np.int32(100_000)), "too large"),
        ("60x80", "the resolution is '60x80'"),
        ((60, 80, 3), "the resolution is"),
        ((60.5, 80), "the resolution is"),
        ((0, 80), "has no pixel"),
    ],
)
def test_an_impossible_resolution_is_refused(resolution: Any, message: str) -> None:
    with pytest.raises(RenderError, match=message):
        model().render(resolution=resolution, photons=PHOTONS)


@pytest.mark.parametrize("contacts", [BALL, [Sphere(1.5)]])
def test_contacts_that_are_no_list_of_contacts_are_refused(contacts: Any) -> None:
    for ask in (model().render, model().pressed, partial(model().chief_rays, PIXELS)):
        with pytest.raises(ContactError, match="no list of contacts"):
            ask(contacts)


@pytest.mark.parametrize(
    "given",
    [
        {"noise": "1"},
        {"noise": True},
        {"seconds": 0},
        {"seed": 1.5},
        {"seed": -1},
        {"seed": 2**32},
    ],
)
def test_an_impossible_limit_or_seed_is_refused(given: Any) -> None:
    with pytest.raises(RenderError, match=next(iter(given))):
        model().render(resolution=PIXELS, **given)


def test_an_unknown_skin_is_refused() -> None:
    with pytest.raises(RenderError, match="no kind of skin 'rubber'"):
        model().render([BALL], resolution=PIXELS, photons=PHOTONS, skin="rubber")


@pytest.mark.parametrize("motion", [{"shift": (0.0, 0.1)}, {"twist": 5.0}])
def test_a_conforming_skin_refuses_to_be_dragged(motion: dict[str, Any]) -> None:
    ball = Contact(Sphere(1.5), **motion)
    with pytest.raises(ContactError, match="a shift or a twist"):
        model().render([ball], PIXELS, PHOTONS, skin="conforming")
    with pytest.raises(ContactError, match="a shift or a twist"):
        reconstruct(model(), ReconstructionSettings(skin="conforming"), {"ball": ball})


def test_settings_that_are_numbers_of_numpy_are_saved(tmp_path: Path) -> None:
    limits: Any = {"noise": np.float32(1e-3), "seconds": np.float64(60), "seed": np.int64(3)}
    image = model().render((), np.array(FEW_PIXELS), np.int64(FEW_PHOTONS), **limits)  # type: ignore[arg-type]
    image.save(tmp_path)
    told = json.loads((tmp_path / "run.json").read_text())
    asked = ("noise_asked_percent", "seconds_asked", "seed", "photons_asked", "resolution")
    assert [told[name] for name in asked] == [
        float(np.float32(1e-3)),
        60.0,
        3,
        FEW_PHOTONS,
        [*FEW_PIXELS],
    ]


def test_run_settings_tell_the_force() -> None:
    image = pressed()
    (press,) = image.settings["presses"]
    assert press["force_n"] == pytest.approx(0.857, rel=0.01)
    assert image.pressed is not None
    assert image.pressed.contacts[0].force == pytest.approx(press["force_n"], abs=1e-5)


def mirrored_means(image: TactileImage) -> np.ndarray:
    """Means inside the contact of green, and of red and blue, whose lamps face each other."""
    red, green, blue = image.radiance[image.contact_mask].mean(axis=0, dtype=float)
    return np.array([green, (red + blue) / 2])


@pytest.mark.parametrize(
    ("name", "specularity"),
    [
        ("gelsight-mini-ideal-cylindrical", 0.0),
        ("gelsight-mini-ideal", 0.3),
    ],
)
def test_the_light_field_agrees_with_photon_mapping(name: str, specularity: float) -> None:
    of, ball = model(name, specularity), PRESSED[name]
    few, many = TRACED[name]
    field = of.render([ball], resolution=PIXELS, photons=few)
    mapped = [
        of.render([ball], resolution=PIXELS, photons=many, seed=seed, estimator="sppm")
        for seed in (1, 2)
    ]
    inside = field.contact_mask
    expected = np.mean([mirrored_means(image) for image in mapped], axis=0)
    assert mirrored_means(field) == pytest.approx(expected, rel=IN_CONTACT[name])
    for number, group in enumerate(field.layers):
        ours = field.layers[group][..., number].astype(float)
        one, two = (image.layers[group][..., number].astype(float) for image in mapped)
        theirs = (one + two) / 2
        scale = theirs[inside].mean()
        assert ours[~inside].mean() == pytest.approx(theirs[~inside].mean(), rel=OUTSIDE)
        noise2 = ((one - two)[inside] ** 2).mean() / 4
        error2 = ((ours - theirs)[inside] ** 2).mean() - noise2
        assert error2 < (PER_PIXEL[name] * scale) ** 2


def test_light_in_a_contact_hardly_depends_on_how_bins_of_directions_lie() -> None:
    """Bins turned by half a sector once put a tenth of the light out of a contact's middle."""
    images = []
    for turned in (False, True):
        of = OpticalModel(design(), "llvm") if turned else model()
        axes = of._store.cells.axes
        if turned:
            angle = np.pi / COARSE_BINS.across
            cos, sin = np.cos(angle), np.sin(angle)
            axes[:2] = np.array([[cos, sin], [-sin, cos]]) @ axes[:2]
        images.append(of.render([BALL], (160, 120), photons=600_000, only_contacts=True))
    inside = images[0].contact_mask
    middle = inside & (images[0].normals[..., 2] < -0.8)
    assert middle.sum() > 50
    for where, least in ((inside, 0.01), (middle, TURNED)):
        straight, turned = (image.radiance[where].mean(axis=0, dtype=float) for image in images)
        assert turned == pytest.approx(straight, rel=least)


def test_ctrl_c_after_the_first_photons_ends_in_an_image_if_one_is_wanted() -> None:
    fresh = OpticalModel(design(), "llvm")

    def press(progress: RenderProgress) -> None:
        if progress.stage is Stage.PHOTONS and progress.photons:
            raise KeyboardInterrupt

    def stopped(**options: Any) -> TactileImage:
        return fresh.render(resolution=(40, 30), photons=4_000_000, progress=press, **options)

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert stopped(partial=True).interrupted
