"""Datasets: what is in them is true, and however they are made they are the same."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparing import same_pictures
from scipy.ndimage import binary_erosion

from optisense import OpticalModel, SensorDesign, library, load, set_value
from optisense.design import LightGroup
from optisense.errors import ContactError, OutputError, TaskError
from optisense.optics.imaging.radiance_files import decode_radiance
from optisense.tasks import ContactDraw, Dataset, DatasetSettings, generate
from optisense.tasks.dataset_tables import LATER_COLUMNS

from .conftest import LambertianSensor

COUNT = 4
SETTINGS = DatasetSettings(
    contacts=ContactDraw(("sphere:1.5", "sphere:3"), depth=(0.3, 0.9)),
    resolution=(60, 45),
    photons=20_000,
    seed=3,
    camera_noise=1.5,
    radiance=True,
)


def test_settings_of_numpy_are_those_of_python() -> None:
    given: Any = {"resolution": np.array([60, 45]), "photons": np.int64(20_000)}
    given |= {"seed": np.int64(3), "camera_noise": np.float64(1.5)}
    draw = ContactDraw(SETTINGS.contacts.indenters, depth=np.array([0.3, 0.9]))  # type: ignore[arg-type]
    settings = DatasetSettings(draw, radiance=True, **given)
    assert settings == SETTINGS
    assert json.dumps(asdict(settings)) == json.dumps(asdict(SETTINGS))


@pytest.fixture(scope="module")
def made(mini: OpticalModel, tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """A dataset made in one go."""
    return generate(mini, tmp_path_factory.mktemp("data") / "new", COUNT, SETTINGS)


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def assert_same(one: Dataset, other: Dataset) -> None:
    assert files(one.folder) == files(other.folder)
    for name in ("metadata.csv", "failures.csv"):
        assert (one.folder / name).read_bytes() == (other.folder / name).read_bytes()
    for a, b in zip(one, other, strict=True):
        assert same_pictures(a.image, b.image)
        assert (a.image != b.image).mean() < 0.01
        for name in ("depth", "normals", "mask", "pressure", "displacement"):
            assert np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True)


def test_missing_and_damaged_samples_are_made_again(
    made: Dataset, mini: OpticalModel, tmp_path: Path
) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(made.folder, folder)
    missing = folder / made.labels[0]["file_name"]
    lost = folder / made.labels[2]["radiance"]
    missing.unlink()
    lost.unlink()
    arrays = folder / made.labels[1]["arrays"]
    arrays.write_bytes(arrays.read_bytes()[:100])
    cut = folder / made.labels[3]["radiance"]
    whole = cut.read_bytes()
    cut.write_bytes(whole[:-1])
    damaged = generate(mini, folder, COUNT, SETTINGS)  # which reads no sample
    made_again = missing.stat().st_mtime_ns
    assert lost.exists() and len(cut.read_bytes()) == len(whole) - 1
    with pytest.raises(TaskError, match="sample 1"):
        damaged[1]
    assert_same(made, generate(mini, folder, COUNT, SETTINGS, mend=True))
    assert missing.stat().st_mtime_ns == made_again  # before, without `mend`
    assert np.allclose(decode_radiance(cut.read_bytes()), decode_radiance(whole), rtol=1e-3)


def test_labels_are_true(made: Dataset, mini: OpticalModel) -> None:
    assert len(made) == COUNT
    rays = mini.chief_rays((60, 45))
    for sample in made:
        labels = sample.labels
        # The deepest point of a ball is its tip, at the place that was drawn.
        assert labels["indenter"] == f"sphere:{labels['radius']:g}"
        assert 0.3 <= labels["depth"] <= 0.9
        assert labels["deepest"] <= labels["depth"] + 1e-3
        row, column = int(labels["row"]), int(labels["column"])
        place = np.array([labels["x"], labels["y"], labels["z"]])
        # A pixel of these pictures is 0.31 mm.
        assert np.linalg.norm(rays.points[row, column] - place) < 0.31
        assert labels["contact_pixels"] == sample.mask.sum()


def test_rows_and_columns_are_the_middles_of_contacts_in_a_tall_picture(
    mini: OpticalModel, tmp_path: Path
) -> None:
    # A narrow field of view, so that the picture shows skin only.
    model = OpticalModel(set_value(mini.design, "camera.fov", 45.0))
    draw = ContactDraw(("sphere:1.5",), depth=(0.3, 0.3))
    settings = DatasetSettings(contacts=draw, resolution=(48, 64), seed=2)
    sensor = LambertianSensor(model, model.chief_rays)
    for sample in generate(sensor, tmp_path / "data", 2, settings):
        rows, columns = np.nonzero(sample.mask)
        middle = columns.mean() + 0.5, rows.mean() + 0.5
        assert middle == pytest.approx((sample.labels["column"], sample.labels["row"]), abs=0.7)


def test_depth_normals_and_mask_describe_the_ball(made: Dataset) -> None:
    points = made.background()["points"]
    for sample in made:
        radius, depth = sample.labels["radius"], sample.labels["depth"]
        assert (sample.depth[sample.mask] > 0).all()
        # On a flat gel (z = 0, out is +z) a ball's depth follows from its normal.
        inside = binary_erosion(sample.mask)  # at the rim the slope jumps
        height = -sample.normals[..., 2][inside]
        expected = depth - radius * (1 - height)
        assert sample.depth[inside] == pytest.approx(expected, abs=4e-3)
        # Around it the skin is pulled in, and bulges a little farther away.
        outside = np.nan_to_num(sample.depth[~sample.mask])
        assert 0.1 * depth < outside.max() < depth
        assert -0.05 < outside.min() < 0
        far = np.linalg.norm(points - [sample.labels[k] for k in "xyz"], axis=2) > 5
        assert sample.normals[far] == pytest.approx(
            np.broadcast_to([0, 0, -1], points.shape)[far], abs=0.02
        )


def test_forces_and_displacements_describe_the_ball(made: Dataset) -> None:
    for sample in made:
        labels = sample.labels
        assert sample.pressure[~sample.mask].sum() < 0.05 * sample.pressure.sum()
        # A pixel is 0.31 mm wide on the flat gel.
        total = np.nansum(sample.pressure) * 0.31**2
        assert total == pytest.approx(labels["force"], rel=0.25)
        assert labels["pressure"] >= sample.pressure.max()
        assert np.pi * labels["radius"] * labels["depth"] < 2.0 * labels["area"]
        # Depth is the displacement along the inward normal; the overlap is larger than the contact.
        # The triangles of the pressed skin are within 4 um of its exact shape.
        assert -sample.displacement[..., 2] == pytest.approx(sample.depth, abs=4e-3)
        inside = binary_erosion(sample.mask)
        assert sample.penetration[inside] == pytest.approx(sample.depth[inside], abs=4e-3)
        assert (sample.penetration > 0).sum() > sample.mask.sum()
        sideways = np.linalg.norm(sample.displacement[..., :2], axis=2)
        assert 0.0 < sideways.max() < 0.3 * labels["depth"]


def test_a_conforming_skin_stays_flat_around_the_ball(mini: OpticalModel, tmp_path: Path) -> None:
    sample = generate(mini, tmp_path / "flat", 1, replace(SETTINGS, skin="conforming"))[0]
    assert (sample.depth[~sample.mask] == 0).all()
    assert sample.pressure is None and np.isnan(sample.labels["force"])
    assert sample.normals[~sample.mask] == pytest.approx(
        np.broadcast_to([0, 0, -1], sample.normals.shape)[~sample.mask], abs=1e-5
    )


def test_noise_of_the_camera_is_all_that_it_changes(
    made: Dataset, mini: OpticalModel, tmp_path: Path
) -> None:
    clean = generate(mini, tmp_path / "clean", 1, replace(SETTINGS, camera_noise=0.0))[0]
    change = made[0].image.astype(float) - clean.image
    inside = (clean.image > 10) & (clean.image < 245)
    # Rounding adds 1 / sqrt(12).
    assert change[inside].std() == pytest.approx(np.hypot(1.5, 12**-0.5), rel=0.05)
    assert np.array_equal(made[0].depth, clean.depth)
    assert (made.folder / "radiance" / "000000.exr").stat().st_size > 1000


def test_an_interrupted_dataset_continues_to_the_same(
    made: Dataset, mini: OpticalModel, tmp_path: Path
) -> None:
    """And a smaller one is the beginning of a larger one."""

    def press(done: int, count: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    folder = tmp_path / "a"
    assert generate(mini, folder, 1, SETTINGS).labels == made.labels[:1]
    with pytest.raises(KeyboardInterrupt):
        generate(mini, folder, COUNT, SETTINGS, press)
    assert len(Dataset.load(folder)) == 2
    # As if killed while the next sample was being written.
    (folder / "images" / "000002.png").write_bytes(b"half a pict")
    with (folder / "metadata.csv").open("a") as file:
        file.write("images/000002.png,2,sphe")
    # Another model, as a new process would have.
    other = OpticalModel(load("gelsight-mini-ideal"))
    assert_same(generate(other, folder, COUNT, SETTINGS), made)


def test_other_settings_and_other_designs_are_refused(made: Dataset, mini: OpticalModel) -> None:
    with pytest.raises(TaskError, match=r"settings\.seed: 3 -> 4"):
        generate(mini, made.folder, COUNT, replace(SETTINGS, seed=4))
    with pytest.raises(TaskError, match=r"settings\.contacts\.tilt: 0 -> 5"):
        contacts = replace(SETTINGS.contacts, tilt=5)
        generate(mini, made.folder, COUNT, replace(SETTINGS, contacts=contacts))
    shiny = load("gelsight-mini-ideal")
    shiny.coating.specularity = 0.4
    with pytest.raises(TaskError, match=r"coating\.specularity: 0 -> 0\.4"):
        generate(OpticalModel(shiny), made.folder, COUNT, SETTINGS)
    assert len(Dataset.load(made.folder)) == COUNT


def test_samples_are_read_one_at_a_time(made: Dataset) -> None:
    assert made[np.int64(0)].labels == made[0].labels
    with pytest.raises(TypeError, match="slice"):
        made[0:2]  # type: ignore[index]


def test_where_numbers_come_from_does_not_matter(made: Dataset) -> None:
    same: SensorDesign = load("gelsight-mini-ideal")
    same.provenance.clear()
    assert len(generate(OpticalModel(same), made.folder, COUNT, SETTINGS)) == COUNT


def test_the_design_lies_beside_its_pictures(made: Dataset) -> None:
    assert load(made.folder / "design").coating == load("gelsight-mini-ideal").coating


def test_a_folder_with_other_things_in_it_is_left_alone(mini: OpticalModel, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match="not empty"):
        generate(mini, tmp_path, 1, SETTINGS)
    assert files(tmp_path) == {"thesis.txt"}


def test_contacts_that_cannot_be_made_are_recorded(mini: OpticalModel, tmp_path: Path) -> None:
    deep = replace(SETTINGS, contacts=ContactDraw(("sphere:9",), depth=(5, 6)), radiance=False)
    dataset = generate(mini, tmp_path / "d", 2, deep)
    assert len(dataset) == 0
    assert [row["index"] for row in dataset.failures] == ["0", "1"]
    assert "mm thick" in dataset.failures[0]["reason"]


def test_a_picture_of_too_few_pixels_says_so(lambertian: Any, tmp_path: Path) -> None:
    """A pixel at 8 x 6 is 5 mm² large: more than a ball touches."""
    coarse = DatasetSettings(
        ContactDraw(("sphere:1.5",), depth=(0.3, 0.3)),
        resolution=(8, 6),
        skin="conforming",
    )
    dataset = generate(lambertian, tmp_path / "d", 1, coarse)
    assert "fewer than 4 pixels of 8x6 show the contact" in dataset.failures[0]["reason"]
    fine = generate(lambertian, tmp_path / "fine", 1, replace(coarse, resolution=(32, 24)))
    assert len(fine) == 1


def test_a_missing_mesh_is_told_before_anything_is_written(
    mini: OpticalModel, tmp_path: Path
) -> None:
    settings = replace(SETTINGS, contacts=ContactDraw((f"mesh:{tmp_path / 'no.stl'}",)))
    with pytest.raises(Exception, match=r"no\.stl"):
        generate(mini, tmp_path / "e", 1, settings)
    with pytest.raises(ContactError, match="kind of indenter"):
        generate(mini, tmp_path / "e", 1, replace(SETTINGS, contacts=ContactDraw(("ball",))))
    assert not (tmp_path / "e").exists()


def test_a_folder_without_a_dataset_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(TaskError, match="no dataset"):
        Dataset.load(tmp_path)


LAMP = "IESNA:LM-63-2002\n[MANUFAC] us\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 5\n0 45 90\n0\n9 5 0\n"


def test_a_dataset_of_a_sensor_with_an_own_lamp_opens_and_continues_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(tmp_path / "own"))
    (tmp_path / "our-lamp.ies").write_text(LAMP)
    red = (1.0, 0.0, 0.0)
    light = library.TypicalLight(colour=red, flux=4.0)
    library.add_ies(tmp_path / "our-lamp.ies", light, colour_name="red")
    design = load("gelsight-mini-ideal")
    lamps = design.lights["red"].model_dump() | {"model": "our-lamp"}
    design.lights["red"] = LightGroup.model_validate(lamps)
    settings = replace(SETTINGS, radiance=False, skin="conforming")
    folder = tmp_path / "data"
    model = OpticalModel(design)
    sensor = LambertianSensor(model, model.chief_rays)
    generate(sensor, folder, 1, settings)
    assert len(generate(sensor, folder, 2, settings)) == 2
    # Another machine has the folder, and not the lamp, and renders it.
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(tmp_path / "elsewhere"))
    assert len(generate(OpticalModel(load(folder / "design")), folder, 3, settings)) == 3


def edge_distance(mask: np.ndarray) -> int:
    """Pixels that are free between a mask and the nearest edge."""
    rows, columns = np.nonzero(mask)
    height, width = mask.shape
    return int(min(rows.min(), columns.min(), height - 1 - rows.max(), width - 1 - columns.max()))


def test_contacts_stay_clear_of_the_edge_unless_they_may_be_cut(
    lambertian: Any, tmp_path: Path
) -> None:
    settings = DatasetSettings(
        ContactDraw(("sphere:1.5",)), resolution=(100, 75), seed=5, skin="conforming"
    )
    kept = generate(lambertian, tmp_path / "kept", 8, settings)
    assert min(edge_distance(sample.mask) for sample in kept) >= 2  # of 100 pixels
    cut = replace(settings, contacts=replace(settings.contacts, margin=0.0))
    free = generate(lambertian, tmp_path / "cut", 8, cut)
    assert min(edge_distance(sample.mask) for sample in free) == 0
    assert len(kept.failures) == len(free.failures) == 0
    # Contacts are drawn at another place only, so that what fits rarely is not drawn less often.
    assert any(row["attempt"] for row in kept.labels)
    for name in ("depth", "rotation"):
        assert [row[name] for row in kept.labels] == [row[name] for row in free.labels]
    # A draw that kept its margin by itself is the same in both.
    same = [a for a, b in zip(kept.labels, free.labels, strict=True) if a["x"] == b["x"]]
    assert len(same) >= 3


def test_an_indenter_larger_than_the_view_keeps_no_margin(lambertian: Any, tmp_path: Path) -> None:
    draw = ContactDraw(("sphere:40",), depth=(1.0, 1.5))
    settings = DatasetSettings(draw, resolution=(60, 45), seed=1, skin="conforming")
    made = generate(lambertian, tmp_path / "large", 3, settings)
    assert len(made) == 3
    assert all(edge_distance(sample.mask) == 0 for sample in made)


def test_samples_tell_their_points_splits_and_whether_they_are_cut(
    made: Dataset, mini: OpticalModel
) -> None:
    """Points are where the rays of the camera meet the pressed skin, deeper by `depth`."""
    rays, background = made.camera_rays(), made.background()
    np.testing.assert_allclose(rays["points"], background["points"], atol=1e-4)
    assert set(made.split("train") + made.split("validation") + made.split("test")) == set(
        range(COUNT)
    )
    for number, sample in enumerate(made):
        assert sample.points is not None
        assert sample.labels["cut"] == 0  # the margin keeps contacts from the edge
        assert number in made.split(sample.labels["split"])
        away = sample.points[sample.mask] - rays["points"][sample.mask]
        along = (away * rays["directions"][sample.mask]).sum(axis=1)
        assert np.linalg.norm(
            away - along[:, None] * rays["directions"][sample.mask], axis=1
        ).max() < (0.02)
        # The skin of a GelSight Mini is flat, and its inward normal is -z.
        np.testing.assert_allclose(-away[:, 2], sample.depth[sample.mask], atol=2e-3)


def test_contacts_that_the_edge_cuts_are_told(lambertian: Any, tmp_path: Path) -> None:
    draw = ContactDraw(("sphere:3",), depth=(0.9, 0.9), margin=0.0)
    settings = DatasetSettings(draw, resolution=(40, 30), hold_out=("sphere:3",))
    found = generate(lambertian, tmp_path / "cut", 8, settings)
    cut = [sample.labels["cut"] for sample in found]
    assert 0 < sum(cut) < len(cut)
    for sample in found:
        mask = sample.mask
        edge = mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any()
        assert sample.labels["cut"] == edge
    assert found.split("test") == list(range(8)) and found.split("train") == []
    with pytest.raises(TaskError, match="no split 'exam'"):
        found.split("exam")
    with pytest.raises(TaskError, match="held out"):
        DatasetSettings(draw, hold_out=("plane",))


def test_a_dataset_of_release_0_1_is_read_but_not_continued(
    made: Dataset, mini: OpticalModel, tmp_path: Path
) -> None:
    """It has neither splits nor rays nor margins, and its contacts were drawn in another way."""
    folder = Path(shutil.copytree(made.folder, tmp_path / "old"))
    table = (folder / "metadata.csv").read_text().splitlines()
    later = [table[0].split(",").index(name) for name in LATER_COLUMNS]
    kept = [
        ",".join(cell for number, cell in enumerate(line.split(",")) if number not in later)
        for line in table
    ]
    (folder / "metadata.csv").write_text("\n".join(kept) + "\n")
    (folder / "camera.npz").unlink()
    info = json.loads((folder / "dataset.json").read_text())
    del info["drawing"], info["settings"]["contacts"]["margin"]
    (folder / "dataset.json").write_text(json.dumps(info))
    before = files(folder)
    with pytest.raises(TaskError, match="by another release") as refused:
        generate(mini, folder, COUNT + 1, SETTINGS)
    assert "new folder" in str(refused.value) and files(folder) == before
    old = Dataset.load(folder)
    assert len(old) == COUNT and np.array_equal(old[1].depth, made[1].depth)
    assert old.labels[0]["split"] == "" and old.labels[0]["cut"] == -1
    with pytest.raises(TaskError, match="has no splits"):
        old.split("train")
    with pytest.raises(TaskError, match=r"lacks the file 'camera\.npz'"):
        old.camera_rays()
