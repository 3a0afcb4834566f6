"""Datasets from strangers are read, and folders with links written, inside the folder only."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest

from optisense.errors import OutputError, TaskError
from optisense.optics import OpticalModel
from optisense.optics.backend.variant import threads_for_exr_files
from optisense.tasks import DatasetSettings, generate
from optisense.tasks.dataset import Dataset

SETTINGS = DatasetSettings(resolution=(24, 18), photons=20_000, radiance=True)


@pytest.fixture(scope="module")
def whole(mini: OpticalModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("strange") / "dataset"
    generate(mini, folder, 1, SETTINGS)
    return folder


@pytest.mark.parametrize("kind", ["images/000000.png", "arrays/000000.npz"])
@pytest.mark.parametrize("way", ["../{}", "{absolute}", "link/{}", "images/../../{}", "a\0b"])
def test_a_row_leads_nowhere_else(way: str, kind: str, whole: Path) -> None:
    table = whole / "metadata.csv"
    before = table.read_text()
    outside = whole.parent / Path(kind).name
    outside.write_bytes((whole / kind).read_bytes())
    link = whole / "link"
    link.symlink_to(whole.parent)
    try:
        named = way.format(outside.name, absolute=outside)
        table.write_text(before.replace(kind, named), newline="")
        with pytest.raises(TaskError, match="leads out of"):
            Dataset.load(whole)[0]
    finally:
        link.unlink()
        table.write_text(before)
    assert Dataset.load(whole)[0].image.shape == (18, 24, 3)


def test_a_member_that_is_no_array_is_refused(whole: Path) -> None:
    file = whole / "arrays" / "000000.npz"
    before = file.read_bytes()
    try:
        with zipfile.ZipFile(file, "a") as archive:
            archive.writestr("depth_of_a_stranger.npy", b"no array")
        with pytest.raises(TaskError, match="'depth_of_a_stranger' is no array"):
            Dataset.load(whole)[0]
    finally:
        file.write_bytes(before)


@pytest.mark.parametrize("name", ["images", "arrays", "radiance"])
def test_links_are_not_written_through(
    name: str, whole: Path, mini: OpticalModel, tmp_path: Path
) -> None:
    folder, outside = tmp_path / "dataset", tmp_path / "outside"
    outside.mkdir()
    shutil.copytree(whole, folder)
    (folder / name).rename(tmp_path / "moved")
    (folder / name).symlink_to(outside)
    with pytest.raises(OutputError, match="leads out of the folder through a link"):
        generate(mini, folder, 2, SETTINGS)
    assert not list(outside.iterdir())


def test_layers_are_not_written_through(mini: OpticalModel, tmp_path: Path) -> None:
    out, outside = tmp_path / "out", tmp_path / "outside"
    for folder in (out, outside):
        folder.mkdir()
    (out / "layers").symlink_to(outside)
    image = mini.render(resolution=(24, 18), photons=20_000)
    with pytest.raises(OutputError, match="leads out of the folder through a link"):
        image.save(out)
    assert not list(outside.iterdir())
    assert [path.name for path in out.iterdir()] == ["layers"]


@pytest.mark.parametrize("estimator", ["radiance-cache", "sppm"])
def test_photons_may_be_a_float(estimator: str, mini: OpticalModel) -> None:
    """As in photons=12e6; half a photon is told."""
    from optisense.errors import RenderError

    given = {"resolution": (24, 18), "estimator": estimator, "seed": 3}
    one, other = (mini.render(photons=photons, **given) for photons in (2e4, 20_000))
    assert np.allclose(one.radiance, other.radiance, rtol=1e-3, atol=1e-6 * other.radiance.max())
    for wrong in (2e4 + 0.5, float("inf"), float("nan")):
        with pytest.raises(RenderError, match="photons are"):
            mini.render(photons=wrong, **given)


def test_radiance_tells_its_unit(mini: OpticalModel, tmp_path: Path) -> None:
    import json

    import mitsuba as mi

    mini.render(resolution=(24, 18), photons=20_000).save(tmp_path)
    assert json.loads((tmp_path / "run.json").read_text())["units"]["radiance"] == "mW/(mm^2 sr)"
    with threads_for_exr_files():
        for file in (tmp_path / "radiance.exr", *(tmp_path / "layers").iterdir()):
            assert mi.Bitmap(str(file)).metadata()["unit"] == "mW/(mm^2 sr)"
