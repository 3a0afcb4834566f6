"""Parquet files hold what a dataset holds, in types that loaders know; a card tells what it is."""

from __future__ import annotations

import io
import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml
from PIL import Image

from optisense import OpticalModel
from optisense.errors import TaskError
from optisense.tasks import ContactDraw, Dataset, DatasetSettings, generate, parquet
from optisense.tasks._splits import SPLITS
from optisense.tasks.data_card import OURS, write_card
from optisense.tasks.parquet import ARRAYS, parquet_files, write_parquet

EVIL = "sensor\n---\nlicense: evil | <b>x</b>"


@pytest.fixture(scope="module")
def made(mini: OpticalModel, tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    draw = ContactDraw(("sphere:1.5", "cylinder:1,4"))
    settings = DatasetSettings(
        draw, resolution=(40, 30), photons=20_000, hold_out=("cylinder:1,4",)
    )
    return generate(mini, tmp_path_factory.mktemp("data") / "touches", 6, settings)


def rows_of(files: list[Path]) -> dict[int, dict[str, Any]]:
    return {row["index"]: row for file in files for row in pq.read_table(file).to_pylist()}


def test_every_sample_is_there_in_its_split(made: Dataset) -> None:
    files = write_parquet(made)
    split_of_file = {file.name.split("-")[0] for file in files}
    assert split_of_file == {row["split"] for row in made.labels}
    for file in files:
        assert set(pq.read_table(file)["split"].to_pylist()) == {file.name.split("-")[0]}
    rows = rows_of(files)
    assert len(rows) == len(made)
    for sample in made:
        row = rows[sample.labels["index"]]
        stored = np.asarray(Image.open(io.BytesIO(row["image"]["bytes"])))
        assert np.array_equal(stored, sample.image)
        for name in ARRAYS:
            assert np.array_equal(
                np.array(row[name]), np.asarray(getattr(sample, name)), equal_nan=True
            ), name
        assert row["greatest_pressure"] == sample.labels["pressure"]
        assert row["press_depth"] == sample.labels["depth"]
        assert row["x"] == sample.labels["x"]


def test_the_types_are_told_as_hugging_face_does(made: Dataset) -> None:
    schema = pq.read_schema(write_parquet(made)[0])
    features = json.loads(schema.metadata[b"huggingface"])["info"]["features"]
    assert list(features) == schema.names
    assert features["image"] == {"_type": "Image"}
    assert features["points"] == {"shape": [30, 40, 3], "dtype": "float32", "_type": "Array3D"}
    assert features["mask"] == {"shape": [30, 40], "dtype": "bool", "_type": "Array2D"}
    assert features["depth"]["_type"] == "Array2D"


def test_a_conforming_skin_has_no_pressure(mini: OpticalModel, tmp_path: Path) -> None:
    settings = DatasetSettings(resolution=(40, 30), photons=20_000, skin="conforming")
    (row,) = rows_of(write_parquet(generate(mini, tmp_path / "flat", 1, settings))).values()
    assert row["pressure"] is None and row["displacement"] is None and row["force"] is None
    assert np.array(row["depth"]).shape == (30, 40)


def test_files_of_an_earlier_call_go_and_others_stay(made: Dataset) -> None:
    files = write_parquet(made)
    folder = files[0].parent
    (folder / "train-00007-of-00009.parquet").write_bytes(b"old")
    (folder / "mine.parquet").write_bytes(b"mine")
    assert write_parquet(made) == files
    assert {file.name for file in folder.iterdir()} == {*(f.name for f in files), "mine.parquet"}


def test_an_interrupted_call_leaves_the_files_of_an_earlier_one(
    made: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = write_parquet(made)[0].parent
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    monkeypatch.setattr(parquet, "SAMPLES_OF_A_FILE", 1)

    def press(done: int, count: int) -> None:
        if done == count:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_parquet(made, press)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before
    files = write_parquet(made)
    assert len(files) == len(made) and set(folder.glob("t*.parquet")) <= set(files)


def test_at_every_moment_the_earlier_files_or_the_new_ones_are_there(
    made: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    earlier = set(write_parquet(made))
    monkeypatch.setattr(parquet, "SAMPLES_OF_A_FILE", 1)
    there: list[set[Path]] = []

    def watched(change: Callable[..., Any]) -> Callable[..., Any]:
        def changed(*given: Any, **more: Any) -> Any:
            done = change(*given, **more)
            there.append(set(parquet_files(made.folder)))
            return done

        return changed

    for name in ("replace", "unlink"):
        monkeypatch.setattr(Path, name, watched(getattr(Path, name)))
    new = set(write_parquet(made))
    assert earlier - new and there[-1] == new
    assert all(earlier <= each or new <= each for each in there)


def test_a_file_that_a_killed_process_was_writing_is_removed(made: Dataset) -> None:
    ended = subprocess.Popen(["true"])
    ended.wait()
    left = write_parquet(made)[0].parent / f".train.{ended.pid}-0123abcd.parquet"
    left.write_bytes(b"half")
    write_parquet(made)
    assert not left.exists()


def test_the_card_tells_licence_seed_versions_and_splits(made: Dataset) -> None:
    files = write_parquet(made)
    path = write_card(made, "cc-by-4.0")
    assert path is not None
    text = path.read_text(encoding="utf-8")
    head = yaml.safe_load(text.split("---")[1])
    assert head["license"] == "cc-by-4.0"
    names = [each["split"] for each in head["configs"][0]["data_files"]]
    assert names == [name for name in SPLITS if made.split(name)]
    for words in (
        "gelsight-mini-ideal",
        "| seed | 0 |",
        f"mitsuba {made.info['made_with']['mitsuba']}",
    ):
        assert words in text, words
    for file in files:
        file.unlink()
    write_card(made)  # goes on with the licence that was chosen
    text = path.read_text(encoding="utf-8")
    assert "license: cc-by-4.0" in text and "configs:" not in text
    path.write_text("my own words", encoding="utf-8")
    assert write_card(made) is None
    assert path.read_text(encoding="utf-8") == "my own words"
    path.unlink()


def test_texts_of_a_dataset_stay_texts_on_its_card(made: Dataset) -> None:
    evil = replace(made, info={**made.info, "design_name": EVIL})
    path = write_card(evil)
    assert path is not None
    text = path.read_text(encoding="utf-8")
    assert yaml.safe_load(text.split("---")[1])["license"] == "unknown"
    assert "<b>" not in text and OURS in text
    with pytest.raises(TaskError, match="no identifier of a licence"):
        write_card(made, "my: licence")
