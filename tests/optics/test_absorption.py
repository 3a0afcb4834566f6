"""Media that absorb: the law of Beer and Lambert, for photons, for the camera, and for Mitsuba."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from reference_scenes import (
    ReferenceScene,
    box,
    diffuse_coating,
    floor,
    fresnel,
    isotropic,
    landings_of,
    narrow_beam,
    pixel_middles,
    quad,
    side_lit_block,
)

from optisense import OpticalModel, load
from optisense.design.materials import Dielectric
from optisense.design.parts import Role
from optisense.geometry import TriangleMesh, parse_contact
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene._lamp_places import with_media
from optisense.optics.scene._solids import Solid
from optisense.optics.scene.emitters import (
    FACE_CELLS,
    Emitter,
    EmitterShape,
    StartMedium,
    emit,
    emitter_table,
)
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.scene.surfaces import CLEAR, RGB, Surface, SurfaceKind
from optisense.optics.transport.camera_paths import find_visible_points

INDEX = 1.5
ABSORPTION: RGB = (0.05, 0.2, 0.4)
"""Absorption coefficients per mm at R, G, B."""

BLACK = diffuse_coating(0.0)
PHOTONS = 100_000

SINGLE = 1e-4
"""Relative error of one beam in single precision."""

SUMMED = 0.01
"""Relative error of 100,000 photons whose orders of reflection are drawn at random."""


def glass(inside: RGB = ABSORPTION, outside: RGB = CLEAR) -> Surface:
    return Surface(SurfaceKind.DIELECTRIC, eta=INDEX, absorption=(inside, outside))


def beam(degrees: float) -> Emitter:
    """A beam that meets the origin from 1 mm above, in air."""
    angle = np.radians(degrees)
    way = (float(np.sin(angle)), 0.0, float(-np.cos(angle)))
    return Emitter(0, (-float(np.tan(angle)), 0.0, 1.0), way, intensity=narrow_beam())


@pytest.mark.parametrize("absorption", [ABSORPTION, CLEAR], ids=["absorbing", "clear"])
@pytest.mark.parametrize("degrees", [20.0, 50.0, 75.0])
def test_a_beam_through_a_slab_is_displaced_and_weakened(degrees: float, absorption: RGB) -> None:
    """The slab leaves what Beer and Lambert's law and Fresnel's equations say."""
    angle, thickness = np.radians(degrees), 2.0
    slab = box("slab", (-40, -40, -thickness), (40, 40, 0), glass(absorption))
    lamp = beam(degrees)
    found = landings_of([slab, floor(BLACK, 60, -3.0)], [lamp], PHOTONS, True)
    reflectance, inside = fresnel(angle, INDEX)
    left = np.exp(-np.array(absorption) * thickness / np.cos(inside))
    every_order = (1 - reflectance) ** 2 * left / (1 - (reflectance * left) ** 2)
    assert found.power.sum(axis=0) == pytest.approx(every_order, rel=SUMMED)
    exit_x = thickness * np.tan(inside) + np.tan(angle)
    direct = np.abs(found.place[:, 0] - exit_x) < 0.1
    once = (1 - reflectance) ** 2 * left
    assert found.power[direct].sum(axis=0) == pytest.approx(once, rel=SUMMED)
    assert found.place[direct, 0].mean() == pytest.approx(exit_x, abs=0.005)
    assert found.direction[direct].mean(axis=0) == pytest.approx(lamp.direction, abs=1e-3)


def test_light_is_absorbed_by_the_medium_that_it_starts_in() -> None:
    """A lamp in the gel, over its coating: no interface tells what is between them."""
    gel = box("gel", (-10, -10, 0), (10, 10, 4), glass(), without=["-z"])
    for absorption in (ABSORPTION, CLEAR):
        lamp = Emitter(
            0, (0, 0, 3), (0, 0, -1), intensity=narrow_beam(), media=(StartMedium(0, absorption),)
        )
        power = landings_of([gel, floor(BLACK)], [lamp], PHOTONS, True).power.sum(axis=0)
        assert power == pytest.approx(np.exp(-3 * np.array(absorption)), rel=SINGLE)


def test_lights_on_the_border_of_two_solids_start_in_each() -> None:
    """The window lies across the faces of two gels; then most of it does."""
    gels = [
        Solid(name, TriangleMesh.box((-8, -6, low), (8, 6, low + 3)), name, 1.41, absorption=taken)
        for name, low, taken in (("upper", -3.0, ABSORPTION), ("lower", -6.0, (0.3, 0.1, 0.0)))
    ]
    square = Emitter(0, (-5, 0, -3), (1, 0, 0), None, EmitterShape.RECTANGLE, (2.0, 2.0))
    for height, share in ((-3.0, 0.5), (-3.5, 0.25), (-4.5, 0.0)):
        (lamp,) = with_media([replace(square, position=(-5, 0, height))], gels)
        assert {medium.absorption for medium in lamp.media} <= {gel.absorption for gel in gels}
        assert np.mean([medium.solid == 0 for medium in lamp.media]) == share
    table = emitter_table(with_media([square], gels), 1)
    corner = mi.Point2f([0.1, 0.9, 0.1, 0.9], [0.1, 0.1, 0.9, 0.9])
    origin, _, _, cell = emit(table, dr.zeros(mi.UInt32, 4), mi.Point2f(0.5), corner)
    below = np.asarray(origin)[2] < -3
    assert np.array_equal(np.asarray(dr.gather(mi.UInt32, table.solids, cell)) == 2, below)


def test_media_that_cover_a_part_of_a_light_are_found_and_those_beside_it_are_not() -> None:
    gel = Solid(
        "gel", TriangleMesh.box((-3, -3, -3), (3, 3, 3)), "gel", 1.41, absorption=ABSORPTION
    )
    film = Solid("film", TriangleMesh.box((-3, -3, 0.2), (3, 3, 0.8)), "film", 1.41, priority=1)
    square = Emitter(0, (0, 0, 0), (1, 0, 0), None, EmitterShape.RECTANGLE, (2.0, 2.0))
    (lamp,) = with_media([square], [gel, film])
    assert np.mean([medium.solid == 1 for medium in lamp.media]) == pytest.approx(0.3, abs=0.05)
    # The first two are flush with a side of the gel; a corner of the square around the disc is not.
    inner = [replace(square, position=(0, side * 2.8, 0), size=(0.4, 0.4)) for side in (-1, 1)]
    inner += [Emitter(0, (0, side * 2.9965, 0), (1, 0, 0)) for side in (-1, 1)]
    disc = replace(square, shape=EmitterShape.DISC, up=(0, 1, 1), position=(0, 2, 2))
    for lamp in with_media([*inner, disc], [gel]):
        assert [medium.solid for medium in lamp.media] == [0]


def test_kernels_do_not_contain_the_number_of_media_of_a_light() -> None:
    def hashes(media: int) -> list[object]:
        lamp = Emitter(0, (0, 0, 0), (1, 0, 0), media=(StartMedium(0, ABSORPTION),) * media)
        table = emitter_table([lamp], 1)
        light, place = dr.opaque(mi.UInt32, 0, 4), mi.Point2f(dr.opaque(mi.Float, 0.5, 4))
        dr.eval(table.rows, table.solids, light, place)
        dr.kernel_history_clear()
        dr.eval(emit(table, light, place, place)[3])
        return [kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel]

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        assert hashes(1) == hashes(FACE_CELLS**2) != []


def test_light_between_two_media_is_absorbed_by_each() -> None:
    upper, lower = ABSORPTION, (0.3, 0.1, 0.0)
    pieces = [
        quad("top", [(-9, -9, 2), (9, -9, 2), (9, 9, 2), (-9, 9, 2)], glass(upper)),
        quad(
            "middle",
            [(-9, -9, 1), (9, -9, 1), (9, 9, 1), (-9, 9, 1)],
            Surface(SurfaceKind.DIELECTRIC, eta=1.0, absorption=(lower, upper)),
        ),
        floor(BLACK),
    ]
    # Normals look up, so that "inside" is below each.
    lamp = Emitter(0, (0, 0, 3), (0, 0, -1), intensity=narrow_beam())
    power = landings_of(pieces, [lamp], PHOTONS, True).power.sum(axis=0)
    reflectance = ((INDEX - 1) / (INDEX + 1)) ** 2
    expected = (1 - reflectance) * np.exp(-np.array(upper) - np.array(lower))
    assert power == pytest.approx(expected, rel=SUMMED)


def test_a_camera_sees_through_an_absorbing_block_by_the_length_of_its_rays() -> None:
    camera = RayCamera((0, 0, 10), (0, 0, -1), (0, 1, 0), 60, 32, 24)
    pixel, film = pixel_middles(camera)
    block = box("block", (-40, -40, 0), (40, 40, 3), glass(), without=["-z"])
    scene = RayScene([block, floor(diffuse_coating(0.5), 40.0)])
    main, _ = find_visible_points(scene, camera, pixel, pixel, film, 0)
    points = np.asarray(main.point).T
    towards = np.asarray(main.towards_eye).T
    length = 3 / towards[:, 2]
    angle = np.arcsin(np.minimum(INDEX * np.sqrt(1 - towards[:, 2] ** 2), 1))
    reflectance = np.array([fresnel(a, INDEX)[0] if a > 1e-3 else 0.04 for a in angle])
    expected = (1 - reflectance) / INDEX**2 * np.exp(-np.array(ABSORPTION)[:, None] * length)
    assert np.asarray(main.weight) == pytest.approx(expected, rel=1e-3)
    assert points[:, 2] == pytest.approx(0.0, abs=1e-4)


PATH_MEAN = (0.025257, 0.012802, 0.0026150)
"""Means of images by Mitsuba 3.9.1's volpath of this scene: 100 images of 2048 samples a pixel,
with standard errors of 0.00006, 0.000016 and 0.0000032."""

SHORT_PATH = 0.08
"""Four standard deviations of the relative error of volpath's mean at 1024 samples a pixel."""

IN_CONTACT = 0.04
"""Relative error of the mean over a contact of some 100 pixels with 8 million photons. Without the
shorter path in the gel, the error is 0.18."""

AGAINST_PATH = 0.015
"""Relative error of the mean. Kernels overestimate light that falls by a fifth per millimetre by
0.7 %."""


def test_both_estimators_agree_with_mitsuba_in_an_absorbing_gel() -> None:
    scene = side_lit_block(glass((0.02, 0.08, 0.25)))
    for image in (scene.pairwise(4, 800_000)[0], scene.pooled(800_000)):
        mean = image.sum(axis=0).mean(axis=(0, 1))
        assert mean == pytest.approx(PATH_MEAN, rel=AGAINST_PATH)


def test_the_exported_scene_still_renders_as_recorded() -> None:
    got = side_lit_block(glass((0.02, 0.08, 0.25))).path(1024).mean(axis=(0, 1))
    assert got == pytest.approx(PATH_MEAN, rel=SHORT_PATH)


def test_nothing_changes_where_no_medium_absorbs() -> None:
    clear, unknown = (
        ReferenceScene(
            [
                box("gel", (-6, -5, 0), (6, 5, 4), surface, without=["-z"]),
                floor(diffuse_coating(0.6), 6.0),
            ],
            [Emitter(0, (-7.0, 0, 2), (1, 0, 0), intensity=isotropic())],
            [(100.0,) * 3],
            RayCamera((0, 0, 24), (0, 0, -1), (0, 1, 0), 22, 32, 24),
        ).pairwise(1, 50_000)[0]
        for surface in (glass(CLEAR), Surface(SurfaceKind.DIELECTRIC, eta=INDEX))
    )
    assert clear == pytest.approx(unknown, rel=1e-5)  # photons are added up in any order


def test_a_contact_in_an_absorbing_gel_is_lit_as_by_photons_that_land_on_it() -> None:
    """Light comes a shorter way through the gel to an indenter than to the surface behind it."""
    design = load("gelsight-mini-ideal")
    gel = next(part.material for part in design.parts.values() if part.role is Role.ELASTOMER)
    ior = design.materials[str(gel)].medium().ior  # type: ignore[union-attr]
    design.materials[str(gel)] = Dielectric(ior=ior, absorption=(0.2, 0.2, 0.2))
    model = OpticalModel(design)
    contact = parse_contact("sphere:1.5@0,0:0.8")
    images = [
        model.render([contact], (80, 60), photons=count, estimator=estimator)
        for count, estimator in ((500_000, "radiance-cache"), (1_500_000, "sppm"))
    ]
    inside = images[0].contact_mask
    cached, traced = (image.radiance[inside].mean() for image in images)
    assert cached == pytest.approx(traced, rel=IN_CONTACT)
