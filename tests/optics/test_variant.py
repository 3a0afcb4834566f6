"""The renderer's libLLVM is checked before the first kernel, and nothing takes Python down."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from optisense.errors import SetupError
from optisense.optics import variant


@pytest.fixture(autouse=True)
def _no_path_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(variant.PATH_VARIABLE, raising=False)


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
    monkeypatch.setattr(variant, "_library_files", lambda: iter(paths))


def test_this_machine_has_a_fit_libllvm() -> None:
    library = variant.find_llvm()
    assert library.version[0] >= variant.MINIMUM_LLVM
    assert os.environ[variant.PATH_VARIABLE] == str(library.path)


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
    assert [library.version for library in variant.installed_llvms()] == [version]


def test_the_tested_version_is_preferred(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names = ["libLLVM-15.so.1", "libLLVM.so.21.1", "libLLVM.so.19.1", "libLLVM.so.18.1"]
    pretend_installed(monkeypatch, tmp_path, *names)
    majors = [library.version[0] for library in variant.installed_llvms()]
    assert majors == [19, 18, 21, 15]


def test_only_old_ones_is_an_error_that_names_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pretend_installed(monkeypatch, tmp_path, "libLLVM-15.so.1", "libLLVM-16.so.1")
    with pytest.raises(SetupError, match="too old") as caught:
        variant.find_llvm()
    assert "libLLVM 16.0" in str(caught.value)
    assert variant.install_command() in str(caught.value)
    assert variant.PATH_VARIABLE not in os.environ


def test_none_is_an_error_with_the_command_to_type(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pretend_installed(monkeypatch, tmp_path)
    with pytest.raises(SetupError, match="no libLLVM was found") as caught:
        variant.find_llvm()
    assert variant.install_command() in str(caught.value)


def test_a_broken_library_is_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pretend_installed(monkeypatch, tmp_path, "libLLVM-19.so")
    with pytest.raises(SetupError, match="can be loaded"):
        variant.find_llvm()


@pytest.mark.parametrize(
    ("name", "complaint"),
    [("missing.so", "no libLLVM"), ("text.so", "no libLLVM"), ("libLLVM-15.so", "too old")],
)
def test_a_bad_path_from_the_user_is_an_error(
    name: str, complaint: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if name != "missing.so":
        (tmp_path / name).write_text("not a library")
    monkeypatch.setenv(variant.PATH_VARIABLE, str(tmp_path / name))
    with pytest.raises(SetupError, match=complaint) as caught:
        variant.find_llvm()
    assert variant.PATH_VARIABLE in str(caught.value)


def test_an_unknown_variant_is_an_error() -> None:
    with pytest.raises(SetupError, match="unknown variant 'opencl'"):
        variant.select_variant("opencl")


def test_the_processor_can_always_be_chosen() -> None:
    assert variant.select_variant("llvm") == "llvm_ad_rgb"


def test_cuda_without_a_device_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(variant, "cuda_device_found", lambda: False)
    assert variant.select_variant("auto") == "llvm_ad_rgb"
    with pytest.raises(SetupError, match="no CUDA device"):
        variant.select_variant("cuda")


def test_a_gpu_is_used_even_without_libllvm(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def missing() -> None:
        raise SetupError("no libLLVM was found")

    monkeypatch.setattr(variant, "_prepare_llvm", missing)
    monkeypatch.setattr(variant, "cuda_device_found", lambda: True)
    assert variant.select_variant("auto") == "cuda_ad_rgb"
    with pytest.raises(SetupError):
        variant.select_variant("llvm")


def test_a_kernel_runs_and_gives_right_results() -> None:
    test = variant.run_test_kernel("llvm")
    assert test.passed, test.message


def test_a_kernel_that_can_not_run_is_told_not_raised(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(variant.PATH_VARIABLE, str(tmp_path))
    test = variant.run_test_kernel("llvm")
    assert not test.passed
    assert variant.PATH_VARIABLE in test.message


def old_library() -> Path | None:
    found = [library for library in variant.installed_llvms() if not library.is_fit]
    return found[0].path if found else None


@pytest.mark.skipif(old_library() is None, reason="this machine has no libLLVM older than 17")
def test_a_renderer_that_already_loaded_an_old_library_is_an_error() -> None:
    script = (
        "import drjit\n"
        "from optisense.errors import SetupError\n"
        "from optisense.optics.variant import select_variant\n"
        "try:\n"
        "    select_variant('llvm')\n"
        "except SetupError as error:\n"
        "    print(error)\n"
    )
    environment = {**os.environ, variant.PATH_VARIABLE: str(old_library())}
    child = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment, timeout=60
    )
    assert child.returncode == 0, child.stderr
    assert "too old" in child.stdout
