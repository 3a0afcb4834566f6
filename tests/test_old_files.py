"""Folders that release 0.1 wrote are read, and studies are continued.

`assets/study-v1` is a grid of three trials with a uniform manufacturing error, which was called
"even" then; `assets/dataset-v1` has two samples of the estimator that was called "field". Both are
of the design in `assets/design-v1`, which has a test of its own.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from optisense.cli.app import app
from optisense.search import ManufacturingErrors, Study, ToleranceDistribution
from optisense.tasks import Dataset

ASSETS = Path(__file__).parent / "assets"


def run(*words: str | Path) -> str:
    """What a command prints; it must end well."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A copy of the old study."""
    return Path(shutil.copytree(ASSETS / "study-v1", tmp_path / "study"))


def test_a_study_opens_with_all_that_it_had(study: Path) -> None:
    opened = Study.open(study)
    assert [trial.failure for trial in opened.trials] == [None] * 4  # the start comes first
    assert opened.trial("best").values == {"camera.fov": 40.0}
    assert opened.trial("best").score == pytest.approx(0.6354, abs=1e-4)
    assert opened.settings.errors is not None
    errors = ManufacturingErrors.from_plain(opened.settings.errors)
    assert errors.distributions == {"camera.position.z": ToleranceDistribution(0.2, "uniform")}


def test_a_study_is_continued_and_reported_and_its_best_is_taken(
    study: Path, tmp_path: Path
) -> None:
    assert "camera.fov = 40" in run("search", "--resume", "--out", study)
    run("report", study, "--no-pictures", "--out", tmp_path / "page.html")
    run("apply", study, "--out", tmp_path / "better")
    assert "fov: 40" in (tmp_path / "better" / "design.yaml").read_text()


def test_a_dataset_is_read_but_not_continued(tmp_path: Path) -> None:
    """Its samples were drawn in another way."""
    folder = Path(shutil.copytree(ASSETS / "dataset-v1", tmp_path / "dataset"))
    before = {path: path.read_bytes() for path in folder.rglob("*.*") if path.is_file()}
    samples = list(Dataset.load(folder))
    assert [sample.labels["index"] for sample in samples] == [0, 1]
    for sample in samples:
        assert sample.image.shape == (30, 40, 3) and np.nanmax(sample.depth) > 0.1
        assert sample.labels["split"] == ""
    settings = ("--count", "3", "--resolution", "40x30", "--photons", "20000")
    words = ("dataset", ASSETS / "design-v1", *settings, "--out", folder)
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 2 and "made by another release" in done.output
    assert all(path.read_bytes() == kept for path, kept in before.items())
