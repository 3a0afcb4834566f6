"""Folders of searches: what is kept in them, and who may write."""

from __future__ import annotations

import json
import math
import os
import sqlite3
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from optisense.cli.search_result import _end
from optisense.design import SensorDesign
from optisense.design.materials import CoatingModel
from optisense.errors import FolderInUseError, OutputError, SearchError
from optisense.objectives.registry import OBJECTIVES
from optisense.search import Choice, Study, search
from optisense.search._run_search import run_study
from optisense.search.methods import METHODS
from optisense.search.study._same_scoring import SCORING
from optisense.search.study.store import START, STORE_VERSION

SPACE = {"coating.specularity": (0.0, 1.0, 5), "camera.position.x": (-1.0, 3.0, 3)}

PACKAGE = """
from typing import Literal

from optisense.design.materials import CoatingModel, Reflection
from optisense.search.methods import Method


def width(design):
    return design.camera.fov


class Chalk(CoatingModel):
    kind: Literal["lab-chalk"] = "lab-chalk"
    white: float

    def reflection(self):
        return Reflection((self.white,) * 3)


class Corners(Method):
    name, summary = "lab-method", "corners of the space"

    def ask(self):
        return self.space.from_unit([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [0.2, 0.0], [0.3, 0.0]])

    def tell(self, vectors, outcomes):
        pass
"""

POINTS = (
    "objectives]\nlab-width = lab_parts:width",
    "methods]\nlab-method = lab_parts:Corners",
    "coatings]\nlab-chalk = lab_parts:Chalk",
)


def vectors(study: Study) -> np.ndarray:
    return np.array([row.vector for row in study.store.rows()])


class TestFolder:
    @pytest.fixture
    def folder(self, mini: SensorDesign, goals: ModuleType, tmp_path: Path) -> Path:
        search(mini, SPACE, goals.nearness, budget=5, out=tmp_path / "study").study.close()
        return tmp_path / "study"

    def test_holds_all_of_it(self, folder: Path) -> None:
        study = Study.open(folder)
        assert study.settings.method == "cma-es"
        assert [trial.number for trial in study.trials] == list(range(6))
        assert study.store.rows()[0].generation == START
        assert study.best is not None
        assert study.best.fresh

    def test_an_interrupted_continuation_names_the_newer_best(
        self, folder: Path, goals: ModuleType
    ) -> None:
        """Only the best trials of the first run have fresh scores."""

        calls = 0

        def nearness(design: SensorDesign) -> float:
            nonlocal calls
            calls += 1
            if calls == 60:
                raise KeyboardInterrupt
            return float(goals.nearness(design))

        study = Study.open(folder, goals=[nearness])
        first = study.best
        stopped = run_study(study, limit=200)
        assert stopped.interrupted and first is not None and first.fresh
        assert stopped.best.score == max(trial.score for trial in stopped.trials) > first.score
        assert not stopped.best.fresh
        told = f"trial {stopped.best.number} has not been scored with fresh seeds yet"
        assert any(told in note for note in stopped.notes)
        assert Study.open(folder).budget == 200  # which the next run goes on to by default
        ended = run_study(study, limit=70)
        assert _end(ended) == "70 trials: the budget is spent"  # not "70 of 200"
        assert ended.best.fresh and not any("fresh seeds yet" in note for note in ended.notes)

    def test_a_study_is_not_begun_over_another(
        self, folder: Path, mini: SensorDesign, goals: ModuleType, tmp_path: Path
    ) -> None:
        with pytest.raises(SearchError, match="a study in this folder already"):
            search(mini, SPACE, goals.nearness, budget=5, out=folder)
        (tmp_path / "mine").mkdir()
        (tmp_path / "mine" / "design").write_text("something of mine")
        with pytest.raises(OutputError, match="not empty"):
            search(mini, SPACE, goals.nearness, budget=5, out=tmp_path / "mine")
        assert (tmp_path / "mine" / "design").read_text() == "something of mine"

    def test_a_bad_plan_leaves_no_folder(
        self, mini: SensorDesign, goals: ModuleType, tmp_path: Path
    ) -> None:
        with pytest.raises(SearchError):
            search(mini, SPACE, goals.nearness, method="cma", out=tmp_path / "new")
        assert not (tmp_path / "new").exists()

    def test_a_store_of_a_newer_version_is_refused(self, folder: Path) -> None:
        with sqlite3.connect(folder / "trials.sqlite") as file:
            file.execute(f"pragma user_version = {STORE_VERSION + 1}")
        with pytest.raises(SearchError, match="version 2; this release reads 1") as told:
            Study.open(folder)
        assert "update" in str(told.value.hint)

    @pytest.mark.parametrize(
        ("name", "value", "said"),
        [("study_version", 2, "version 2; this release reads 1"), ("seed", 99, "was edited")],
    )
    def test_a_newer_or_edited_study_is_refused(
        self, folder: Path, name: str, value: int, said: str
    ) -> None:
        path = folder / "study.json"
        path.write_text(json.dumps({**json.loads(path.read_text()), name: value}))
        with pytest.raises(SearchError, match=said):
            Study.open(folder)

    def test_scores_of_earlier_definitions_are_not_mixed_with_new_ones(
        self, folder: Path, goals: ModuleType, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A study of another version of the scoring continues only if its start scores alike."""

        def nearness(design: SensorDesign) -> float:
            return 1.1 * float(goals.nearness(design))

        monkeypatch.setattr("optisense.search.study.loop.SCORING", SCORING + 1)
        study = Study.open(folder, goals=[nearness])
        assert study.settings.scoring == SCORING
        with pytest.raises(SearchError, match=r"nearness was .* and is .* now") as told:
            run_study(study, limit=10)
        assert "new study in another folder" in str(told.value.hint)
        assert (len(study.trials), study.budget) == (6, 5)
        assert len(run_study(Study.open(folder, goals=[goals.nearness]), limit=10).trials) == 11

    def test_another_definition_is_found_though_a_further_objective_always_fails(
        self, mini: SensorDesign, goals: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        folder, both = tmp_path / "study", [goals.nearness, goals.broken]
        search(mini, SPACE, both, budget=2, out=folder).study.close()
        monkeypatch.setattr("optisense.search.study.loop.SCORING", SCORING + 1)
        factor = 1.1

        def nearness(design: SensorDesign) -> float:
            return factor * float(goals.nearness(design))

        with pytest.raises(SearchError, match=r"nearness was .* and is .* now"):
            run_study(Study.open(folder, goals=[nearness, goals.broken]), limit=3)
        factor = math.nan
        with pytest.raises(SearchError, match=r"no value of nearness now: nearness: .* nan"):
            run_study(Study.open(folder, goals=[nearness, goals.broken]), limit=3)
        assert len(run_study(Study.open(folder, goals=both), limit=3).trials) == 4

    def test_scores_of_other_releases_of_a_package_are_not_mixed(
        self, mini: SensorDesign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        module = tmp_path / "lab_parts.py"
        module.write_text(PACKAGE)
        info = tmp_path / "lab_parts-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lab-parts\nVersion: 1.0\n")
        points = "".join(f"[optisense.{each}\n" for each in POINTS)
        (info / "entry_points.txt").write_text(points)
        monkeypatch.syspath_prepend(tmp_path)
        chalks = [{"kind": "lab-chalk", "white": white} for white in (0.4, 0.8)]
        space = {"camera.fov": (40.0, 60.0), "coating": Choice(chalks)}
        with OBJECTIVES.forgetting(), METHODS.forgetting(), CoatingModel.kinds.forgetting():
            folder = tmp_path / "study"
            found = search(
                mini, space, "2*'lab-width'", method="lab-method", budget=2, out=folder
            ).study.settings.packages
            assert sorted(found) == [
                "kind of coating 'lab-chalk'",
                "objective 'lab-width'",
                "search method 'lab-method'",
            ]
            assert len(run_study(Study.open(folder), limit=3).trials) == 4
            module.write_text(PACKAGE.replace("camera.fov", "2 * camera.fov"))
            edited = "objective 'lab-width' of lab-parts 1.0; its module was edited"
            with pytest.raises(SearchError, match=edited):
                run_study(Study.open(folder), limit=4)
            info.rename(tmp_path / "lab_parts-1.1.dist-info")
            metadata = tmp_path / "lab_parts-1.1.dist-info" / "METADATA"
            metadata.write_text(metadata.read_text().replace("1.0", "1.1"))
            with pytest.raises(SearchError, match=r"of lab-parts 1.0; it is of lab-parts 1.1 now"):
                run_study(Study.open(folder), limit=4)
            before = Study.open(folder)
            before.settings = replace(before.settings, packages={})  # as of an earlier release
            assert len(run_study(before, limit=4).trials) == 5

    def test_broken_files_are_told(self, folder: Path, tmp_path: Path) -> None:
        with pytest.raises(SearchError, match="no study in this folder"):
            Study.open(tmp_path)
        (folder / "trials.sqlite").write_bytes(b"not a database, certainly not one" * 100)
        with pytest.raises(SearchError, match="not a study's store"):
            Study.open(folder)
        (folder / "study.json").write_text("{")
        with pytest.raises(SearchError, match="not JSON"):
            Study.open(folder)

    def test_two_processes_do_not_run_one_study(self, folder: Path, goals: ModuleType) -> None:
        one, other = (Study.open(folder, goals=[goals.nearness]) for _ in range(2))
        one.lock()
        with pytest.raises(FolderInUseError, match=f"process {os.getpid()} on"):
            run_study(other, limit=10)
        one.unlock()
        assert len(run_study(other, limit=10).trials) == 11

    def test_a_full_disk_is_told_and_loses_nothing(self, folder: Path, goals: ModuleType) -> None:
        """SQLite's own limit on the number of pages stands for the end of the disk."""
        study = Study.open(folder, goals=[goals.nearness])
        study.lock()
        pages = study.store._writer.execute("pragma page_count").fetchone()[0]
        study.store._writer.execute(f"pragma max_page_count = {pages}")
        with pytest.raises(OutputError, match="disk is full") as told:
            run_study(study, limit=2000)
        assert "--resume" in str(told.value.hint)
        study.close()
        again = Study.open(folder, goals=[goals.nearness])
        kept = len(again.trials)
        assert kept >= 6
        assert len(run_study(again, limit=kept + 20).trials) == kept + 21
