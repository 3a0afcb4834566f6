"""Designs are read again only where something changed, and keep the same meshes."""

from __future__ import annotations

import gc
import os
import shutil
import weakref
from pathlib import Path

import pytest

import optisense as ots
from optisense.engine import designs as designs_of_requests
from optisense.engine.designs import DesignReference, Designs
from optisense.engine.failures import InvalidDesignError
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    ots.save_design(ots.load("gelsight-mini-ideal"), tmp_path / "mini")
    return tmp_path / "mini"


def given(folder: Path, **values: object) -> DesignReference:
    data = ots.load("gelsight-mini-ideal").model_dump(mode="json")
    return DesignReference(data=data, folder=str(folder), set=values)


def test_what_did_not_change_is_the_same_mesh(folder: Path) -> None:
    """An optical model recognises unchanged meshes by identity and is not built again."""
    designs = Designs()
    first = designs.read(given(folder))
    second = designs.read(given(folder, **{"lights.red.flux": 3.0}))
    third = designs.read(str(folder))
    assert second.lights["red"].flux == 3.0 and first.lights["red"].flux != 3.0
    for name, mesh in first.meshes.items():
        assert second.meshes[name] is mesh
        assert third.meshes[name] is mesh


def test_a_mesh_file_that_changed_is_another_mesh(folder: Path) -> None:
    designs = Designs()
    first = designs.read(given(folder))
    file = folder / "meshes" / "guide.obj"
    TriangleMesh.box((-9, -7, -20), (9, 7, -19)).save_obj(file)
    os.utime(file, ns=(1, 1))  # a clock that stands still must not hide it
    second = designs.read(given(folder))
    assert second.meshes["guide"] is not first.meshes["guide"]
    assert second.meshes["gel"] is first.meshes["gel"]


def test_values_set_by_a_path_leave_what_is_kept_alone() -> None:
    designs = Designs()
    changed = designs.read(DesignReference(source="gelsight-mini-ideal", set={"camera.fov": 70.0}))
    assert changed.camera.fov == 70.0
    assert designs.read("gelsight-mini-ideal").camera.fov != 70.0


def test_places_of_errors_are_dotted_paths_for_folders_too(folder: Path) -> None:
    designs = Designs()
    design = designs.read(str(folder))
    assert design.where("lights", "red", "flux") == "lights.red.flux"
    with pytest.raises(DesignError, match="no built-in sensor"):
        designs.read("mini")


def test_two_values_that_do_not_fit_have_the_place_of_the_first() -> None:
    data = ots.load("gelsight-mini-ideal").model_dump(mode="json")
    data["camera"]["fov"] = 185.0
    data["parts"]["gel"]["faces"] = {"back": {"roughness": 0.1}}
    with pytest.raises(DesignError, match="has 2 problems") as caught:
        Designs().read(DesignReference(data=data))
    assert caught.value.where == "parts.gel.faces.back"


def test_an_unsound_design_tells_all_that_is_wrong(folder: Path) -> None:
    designs = Designs()
    board = ots.load("gelsight360").meshes["boards"].vertices[:8].mean(axis=0).tolist()
    values = {"camera.position": board, "lights.lg1.lights[0].position": board}
    with pytest.raises(InvalidDesignError) as caught:
        designs.require_valid(designs.read(DesignReference(source="gelsight360", set=values)))
    errors = [p.message for p in caught.value.problems if p.severity == "error"]
    assert len(errors) == 3  # the board reaches into the shell, so the camera is in both
    assert sum("the camera is inside" in message for message in errors) == 2
    assert "and 2 more" in caught.value.message


def test_folders_that_were_not_read_for_long_are_let_go(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(designs_of_requests, "MOST_FOLDERS", 2)
    others = [Path(shutil.copytree(folder, tmp_path / f"copy-{number}")) for number in range(2)]
    designs = Designs()
    first = weakref.ref(designs.read(str(folder)))
    designs.read(str(others[0]))
    assert designs.read(str(folder)) is first(), "two of them are kept"
    for other in others:
        designs.read(str(other))
    gc.collect()
    assert first() is None
