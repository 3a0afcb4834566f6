"""Drafts are the same picture, coarser: compared with the ordinary model."""

from __future__ import annotations

import drjit as dr
import numpy as np
import pytest

import optisense as ots
from optisense.design import SensorDesign
from optisense.optics import OpticalModel
from optisense.optics.drafts import DraftModel, _moved

SIZE = (64, 48)
PHOTONS = 150_000
PRESS = [ots.Contact(ots.Sphere(radius=1.5), at=(0, 0), depth=0.6)]

SAME = 0.1
"""Relative error of the mean radiance of a block of 16 x 16 pixels, due to the noise of both
pictures and the blur of a draft."""


def blocks(radiance: np.ndarray) -> np.ndarray:
    """(12, 3): means over blocks of 16 x 16 pixels."""
    return radiance.reshape(3, 16, 4, 16, 3).mean(axis=(1, 3)).reshape(-1, 3)


@pytest.fixture(scope="module")
def mini() -> SensorDesign:
    return ots.load("gelsight-mini-ideal")


@pytest.fixture(scope="module")
def moved(mini: SensorDesign) -> SensorDesign:
    return ots.set_value(mini, "lights.red.lights[0].position.x", 6.0)


@pytest.fixture(scope="module")
def ordinary(mini: SensorDesign) -> OpticalModel:
    return OpticalModel(mini)


@pytest.fixture
def draft(mini: SensorDesign) -> DraftModel:
    return DraftModel(mini)


def look_alike(one: ots.TactileImage, other: ots.TactileImage) -> None:
    a, b = blocks(one.radiance), blocks(other.radiance)
    np.testing.assert_allclose(a, b, atol=SAME * b.mean(axis=0).max())


def agree(one: OpticalModel, other: OpticalModel) -> None:
    look_alike(*(model.render(PRESS, SIZE, photons=PHOTONS) for model in (one, other)))


def test_a_draft_is_the_same_picture(draft: DraftModel, ordinary: OpticalModel) -> None:
    agree(draft, ordinary)


def test_a_moved_light_is_seen_by_a_draft_that_keeps_cells_and_guide(
    draft: DraftModel, ordinary: OpticalModel, mini: SensorDesign, moved: SensorDesign
) -> None:
    draft.render((), SIZE, photons=20_000)
    cells, guide, surface = draft._store.cells, draft.guide(), draft.surface
    draft.set_design(moved)
    assert draft._store.cells is cells and draft.guide() is guide and draft.surface is surface
    ordinary.set_design(moved)
    agree(draft, ordinary)
    ordinary.set_design(mini)


def test_few_photons_show_what_a_moved_light_does(
    draft: DraftModel, ordinary: OpticalModel, mini: SensorDesign, moved: SensorDesign
) -> None:
    changes = []
    for model, photons in ((draft, 60_000), (ordinary, PHOTONS)):
        before = blocks(model.render(PRESS, SIZE, photons=photons).radiance)
        model.set_design(moved)
        changes.append(blocks(model.render(PRESS, SIZE, photons=photons).radiance) - before)
        model.set_design(mini)
    rough, true = (change[:, 0] for change in changes)
    assert np.corrcoef(rough, true)[0, 1] > 0.9
    assert np.abs(changes[0][:, 1:]).max() < 0.3 * np.abs(true).max()  # only red was moved


def test_a_contact_is_placed_anew_where_it_or_the_surface_moved(
    draft: DraftModel, mini: SensorDesign, moved: SensorDesign
) -> None:
    placed, fixed = draft.place(PRESS[0]), draft.scenes.fixed.scene
    draft.set_design(moved)
    assert draft.place(PRESS[0]) is placed and draft.scenes.fixed.scene is fixed
    aside = ots.Contact(ots.Sphere(radius=1.5), at=(2, 0), depth=0.6)
    shift = draft.place(aside).bounds - placed.bounds
    np.testing.assert_allclose(np.linalg.norm(shift, axis=1), 2.0, atol=1e-6)
    draft.set_design(ots.set_value(mini, "cages.skin.points[14].z", 1.0))
    assert draft.place(PRESS[0]).bounds[1, 2] > placed.bounds[1, 2] + 0.1
    assert draft.scenes.fixed.scene is not fixed


def test_a_moved_camera_or_a_bent_skin_makes_anew_what_depends_on_it(
    draft: DraftModel, ordinary: OpticalModel, mini: SensorDesign
) -> None:
    draft.render((), SIZE, photons=20_000)
    cells = draft._store.cells
    nearer = ots.set_value(mini, "camera.position.z", mini.camera.position[2] + 2.0)
    draft.set_design(nearer)
    rays, same = draft.chief_rays(SIZE), OpticalModel(nearer).chief_rays(SIZE)
    np.testing.assert_allclose(rays.points, same.points, atol=1e-4)
    assert draft._store.cells is cells
    bent = ots.set_value(mini, "cages.skin.points[14].z", 2.0)
    draft.set_design(bent)
    assert draft._store.cells is not cells
    ordinary.set_design(bent)
    np.testing.assert_allclose(
        draft.chief_rays(SIZE).points, ordinary.chief_rays(SIZE).points, atol=1e-4
    )
    ordinary.set_design(mini)


def test_a_small_move_leaves_the_noise_of_all_other_light_as_it_was(
    draft: DraftModel, mini: SensorDesign
) -> None:
    def render(seed: int = 0) -> dict[str, np.ndarray]:
        return draft.render(PRESS, SIZE, photons=60_000, seed=seed).layers

    def change(one: dict[str, np.ndarray], other: dict[str, np.ndarray], group: str) -> float:
        return float(np.sqrt(((one[group] - other[group]) ** 2).mean()))

    still, other_seed = render(), render(seed=1)
    light = mini.lights["red"].lights[0].position
    draft.set_design(ots.set_value(mini, "lights.red.lights[0].position.x", light[0] + 0.05))
    nudged = render()
    assert change(nudged, still, "red") > 0.0
    for group in ("green", "blue"):
        assert change(nudged, still, group) < 0.15 * change(other_seed, still, group)


def test_light_that_did_not_move_is_kept_until_the_draft_is_asked_for_again(
    draft: DraftModel, mini: SensorDesign, moved: SensorDesign
) -> None:
    other_seed = draft.render(PRESS, SIZE, photons=60_000, seed=1)
    before = draft.render(PRESS, SIZE, photons=60_000)
    draft.set_design(moved)
    nudged = draft.render(PRESS, SIZE, photons=60_000)
    assert nudged.settings["kept_layers"] == ["green", "blue"]
    again = draft.render(PRESS, SIZE, photons=60_000)
    assert again.settings["kept_layers"] == []
    assert nudged.settings["kept_view"] and not again.settings["kept_view"]
    for group in ("green", "blue"):
        assert np.array_equal(nudged.layers[group], before.layers[group])
        missed = nudged.layers[group] - again.layers[group]  # the moved light's shadow
        noise = before.layers[group] - other_seed.layers[group]
        assert np.sqrt((missed**2).mean()) < 0.5 * np.sqrt((noise**2).mean())


def test_a_light_that_is_dragged_far_looks_as_in_a_draft_of_its_own(
    draft: DraftModel, mini: SensorDesign, moved: SensorDesign
) -> None:
    draft.render(PRESS, SIZE, photons=PHOTONS)
    start = mini.lights["red"].lights[0].position[0]
    for share in (0.5, 1.0):
        place = start + share * (6.0 - start)
        draft.set_design(ots.set_value(mini, "lights.red.lights[0].position.x", place))
        dragged = draft.render(PRESS, SIZE, photons=PHOTONS)
    assert dragged.settings["kept_view"]
    own = DraftModel(moved).render(PRESS, SIZE, photons=PHOTONS)
    look_alike(dragged, own)


@pytest.mark.parametrize("field", sorted(SensorDesign.model_fields.keys() - {"lights"}))
def test_a_draft_is_made_anew_for_every_field_that_a_picture_may_show(
    mini: SensorDesign, field: str
) -> None:
    other = mini.model_copy(update={field: object()})
    kept = _moved(mini, other) is not None
    assert kept == (field in {"schema_version", "name", "description", "provenance"})


def test_markers_that_are_added_are_in_the_next_draft(
    draft: DraftModel, mini: SensorDesign
) -> None:
    draft.set_design(mini)
    plain = draft.render((), SIZE, photons=20_000)
    draft.set_design(ots.set_value(mini, "markers", {"places": [(0, 0)], "radius": 2.0}))
    marked = draft.render((), SIZE, photons=20_000)
    dark = marked.radiance / plain.radiance
    assert dark[22:27, 30:35].mean((0, 1)).max() < 0.2
    assert np.median(dark, axis=(0, 1)) == pytest.approx(np.ones(3), abs=0.2)  # noise: 0.1


def test_other_fluxes_only_scale_a_draft(draft: DraftModel, mini: SensorDesign) -> None:
    before = draft.render(PRESS, SIZE, photons=60_000)
    draft.set_design(ots.set_value(mini, "lights.red.flux", 2 * mini.lights["red"].flux))
    dimmed = draft.render(PRESS, SIZE, photons=60_000)
    np.testing.assert_allclose(dimmed.layers["red"], 2 * before.layers["red"], rtol=1e-6)
    assert np.array_equal(dimmed.layers["blue"], before.layers["blue"])


def test_a_skin_that_bends_on_compiles_nothing(draft: DraftModel, mini: SensorDesign) -> None:
    def misses(height: float) -> int:
        draft.set_design(ots.set_value(mini, "cages.skin.points[14].z", height))
        dr.kernel_history_clear()
        draft.render(PRESS, SIZE, photons=60_000)
        return sum(kernel.get("cache_hit") == 0 for kernel in dr.kernel_history())

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        misses(0.3)
        misses(0.31)
        assert misses(0.32) == misses(0.33) == 0


def test_the_flat_side_of_a_bent_gel_has_few_triangles(mini: SensorDesign) -> None:
    bent = DraftModel(ots.set_value(mini, "cages.skin.points[14].z", 0.5))
    foot = next(each for each in bent.scenes.pieces if each.name == "gel/tray|acrylic")
    assert len(foot.faces) == 2 and foot.normals is None
    sides = np.ptp(foot.vertices, axis=0)
    a, b, c = (foot.vertices[foot.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(sides[0] * sides[1])


def test_what_a_bent_skin_lies_on_has_the_optical_data_of_media_resolved_anew() -> None:
    digit = ots.load("digit")
    drafts = DraftModel(digit)
    bent = ots.set_value(digit, "cages.skin.points[14].z", digit.cages["skin"].points[14].z + 0.2)
    drafts.set_design(bent)
    assert drafts.scenes.assembly.media.bent
    anew = OpticalModel(bent)
    moved, own = (model.scenes.assembly for model in (drafts, anew))
    assert [piece.name for piece in moved.pieces] == [piece.name for piece in own.pieces]
    assert [piece.surface for piece in moved.pieces] == [piece.surface for piece in own.pieces]
    assert (moved.ior_before, moved.absorption_before) == (own.ior_before, own.absorption_before)


def test_bent_media_are_resolved_when_the_draft_is_asked_for_again(
    draft: DraftModel, mini: SensorDesign
) -> None:
    for height in (0.3, 0.5):
        draft.set_design(ots.set_value(mini, "cages.skin.points[14].z", height))
        bent = draft.render(PRESS, SIZE, photons=PHOTONS)
    assert bent.settings["kept_media"]
    cells = draft._store.cells
    again = draft.render(PRESS, SIZE, photons=PHOTONS)
    assert not again.settings["kept_media"]
    assert draft._store.cells is not cells, "those of the shape before were kept until then"
    look_alike(bent, again)


def test_a_contact_that_the_skin_carries_is_not_pressed_anew(
    draft: DraftModel, mini: SensorDesign
) -> None:
    rest = draft.sensing.vertices.copy()
    middle = int(np.argmin(np.linalg.norm(rest - (0.0, 0.0, rest[:, 2].max()), axis=1)))

    def press(height: float, aside: float = 0.0) -> ots.TactileImage:
        draft.set_design(ots.set_value(mini, "cages.skin.points[14].z", height))
        x, y, z = draft.sensing.vertices[middle].tolist()
        contact = ots.Contact(ots.Sphere(radius=1.5), point=(x + aside, y, z), depth=0.6)
        return draft.render([contact], SIZE, photons=PHOTONS)

    press(0.0)
    press(0.2)
    pressed = draft._pressed
    carried = press(0.4)
    assert draft._pressed is pressed and carried.settings["kept_view"]
    anew = press(0.4)
    assert draft._pressed is not pressed and not anew.settings["kept_view"]
    look_alike(carried, anew)
    pressed = draft._pressed
    press(0.6, aside=1.0)
    assert draft._pressed is not pressed, "the contact left its place on the skin"


def test_frosted_faces_move_along_with_a_cage_as_if_cut_anew() -> None:
    mini = ots.load("gelsight-mini")
    drafts = DraftModel(mini)
    names = [piece.name for piece in drafts.scenes.pieces]
    assert any(":" in name for name in names), "the Mini has frosted faces"
    bent = ots.set_value(mini, "cages.skin.points[14].z", 0.2)
    drafts.set_design(bent)
    anew = OpticalModel(bent)
    assert [piece.name for piece in drafts.scenes.pieces] == names
    for moved, cut in zip(drafts.scenes.pieces, anew.scenes.pieces, strict=True):
        box = [np.stack([p.vertices.min(axis=0), p.vertices.max(axis=0)]) for p in (moved, cut)]
        np.testing.assert_allclose(box[0], box[1], atol=0.01, err_msg=moved.name)


def test_gels_that_overlap_by_priority_are_as_thick_in_drafts_as_in_pictures(
    mini: SensorDesign,
) -> None:
    design = mini.model_copy(deep=True)
    design.cages.clear()
    low, high = design.meshes["gel"].bounds
    design.meshes["gel"] = ots.geometry.TriangleMesh.box(low, high)
    upper = (low[0] + 2, low[1] + 2, -2), (high[0] - 2, high[1] - 2, high[2])
    design.meshes["upper"] = ots.geometry.TriangleMesh.box(*upper)
    design.parts["upper"] = design.parts["gel"].model_copy(update={"priority": 1})
    for model in (OpticalModel(design), DraftModel(design)):
        found = ots.geometry.available_depth((0, 0, high[2]), (0, 0, -1), model.gels)
        assert found == pytest.approx(high[2] - low[2])
