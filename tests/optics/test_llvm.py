"""A fit libLLVM is found, and an unfit one refused, before the renderer loads it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from optisense.errors import SetupError
from optisense.optics.backend import llvm


@pytest.fixture(autouse=True)
def _no_path_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(llvm.PATH_VARIABLE, raising=False)


def pretend_installed(
    monkeypatch: pytest.MonkeyPatch, folder: Path, *names: str, content: bytes = b"no library"
) -> None:
    """Let empty files of these names be all the libraries of the machine."""
    paths = []
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        paths.append(path)
    monkeypatch.setattr(llvm, "_library_files", lambda: iter(paths))


def test_this_machine_has_a_fit_libllvm() -> None:
    library = llvm.find_llvm()
    assert library.version[0] >= llvm.MINIMUM_LLVM
    assert os.environ[llvm.PATH_VARIABLE] == str(library.path)


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM.so.19.1", (19, 1)),
        ("libLLVM-19.so", (19, 0)),
        ("libLLVM-14.0.6.so.1", (14, 0)),
        ("libLLVM-15.so.1", (15, 0)),
        ("llvm-18/lib/libLLVM.so.1", (18, 0)),
        ("Cellar/llvm/20.1.8/lib/libLLVM.dylib", (20, 1)),
        ("Cellar/llvm@17/17.0.6/lib/libLLVM.dylib", (17, 0)),
    ],
)
def test_versions_are_read_from_the_names_that_systems_use(
    name: str, version: tuple[int, int], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pretend_installed(monkeypatch, tmp_path, name)
    assert [library.version for library in llvm.installed_llvms()] == [version]


def test_the_tested_version_is_preferred(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names = ["libLLVM-15.so.1", "libLLVM.so.21.1", "libLLVM.so.19.1", "libLLVM.so.18.1"]
    pretend_installed(monkeypatch, tmp_path, *names)
    majors = [library.version[0] for library in llvm.installed_llvms()]
    assert majors == [19, 18, 21, 15]


def test_only_old_ones_is_an_error_that_names_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pretend_installed(monkeypatch, tmp_path, "libLLVM-15.so.1", "libLLVM-16.so.1")
    with pytest.raises(SetupError, match="too old") as caught:
        llvm.find_llvm()
    assert "libLLVM 16.0" in str(caught.value)
    assert llvm.install_command() in str(caught.value)
    assert llvm.PATH_VARIABLE not in os.environ


def test_none_is_an_error_with_the_command_to_type(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pretend_installed(monkeypatch, tmp_path)
    with pytest.raises(SetupError, match="no libLLVM was found") as caught:
        llvm.find_llvm()
    assert llvm.install_command() in str(caught.value)


def test_a_broken_library_is_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pretend_installed(monkeypatch, tmp_path, "libLLVM-19.so")
    with pytest.raises(SetupError, match="can be loaded"):
        llvm.find_llvm()


@pytest.mark.parametrize(
    ("name", "complaint"),
    [("missing.so", "not a libLLVM"), ("text.so", "not a libLLVM"), ("libLLVM-15.so", "too old")],
)
def test_a_bad_path_from_the_user_is_an_error(
    name: str, complaint: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if name != "missing.so":
        (tmp_path / name).write_text("not a library")
    monkeypatch.setenv(llvm.PATH_VARIABLE, str(tmp_path / name))
    with pytest.raises(SetupError, match=complaint) as caught:
        llvm.find_llvm()
    assert llvm.PATH_VARIABLE in str(caught.value)


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The folder for libraries of an empty environment, in which Python seems to run."""
    monkeypatch.setattr("sys.prefix", str(tmp_path))
    monkeypatch.setattr("sys.base_prefix", str(tmp_path))
    folder = tmp_path / "lib"
    folder.mkdir()
    return folder


def test_an_environment_may_bring_its_own_libllvm(environment: Path) -> None:
    """As the wheels and conda packages of machines on which nobody may install packages do."""
    real = llvm.find_llvm().path.resolve()
    own = environment / f"libLLVM-{llvm.TESTED_LLVM}.so"
    assert own not in {library.path for library in llvm.installed_llvms()}
    own.write_bytes(real.read_bytes())
    assert own in {library.path for library in llvm.installed_llvms()}


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has libatomic")
def test_an_environment_may_bring_its_own_libatomic(
    environment: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(llvm, "ATOMIC_LIBRARY", "libof-a-test.so.1")
    with pytest.raises(SetupError, match="is missing") as told:
        llvm.load_atomic()
    assert "libatomic" in str(told.value.hint)
    (environment / "libof-a-test.so.1").write_bytes(llvm.find_llvm().path.read_bytes())
    llvm.load_atomic()  # any library that can be loaded will do for this
