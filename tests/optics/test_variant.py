"""A variant is selected before the first kernel, and no choice crashes Python."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from optisense.errors import SetupError
from optisense.optics.backend import llvm, variant


@pytest.fixture(autouse=True)
def _no_path_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(llvm.PATH_VARIABLE, raising=False)


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
    monkeypatch.setenv(llvm.PATH_VARIABLE, str(tmp_path))
    test = variant.run_test_kernel("llvm")
    assert not test.passed
    assert llvm.PATH_VARIABLE in test.message


def old_library() -> Path | None:
    found = [library for library in llvm.installed_llvms() if not library.is_suitable]
    return found[0].path if found else None


@pytest.mark.skipif(old_library() is None, reason="this machine has no libLLVM older than 17")
def test_a_renderer_that_already_loaded_an_old_library_is_an_error() -> None:
    script = (
        "import drjit\n"
        "from optisense.errors import SetupError\n"
        "from optisense.optics.backend.variant import select_variant\n"
        "try:\n"
        "    select_variant('llvm')\n"
        "except SetupError as error:\n"
        "    print(error)\n"
    )
    environment = {**os.environ, llvm.PATH_VARIABLE: str(old_library())}
    child = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment
    )
    assert child.returncode == 0, child.stderr
    assert "too old" in child.stdout


def test_integrators_written_in_python_still_work() -> None:
    variant.use_variant()
    mitsuba, drjit = (variant.import_renderer(name) for name in ("mitsuba", "drjit"))
    box = mitsuba.load_dict(mitsuba.cornell_box())
    means = [
        float(drjit.mean(mitsuba.render(box, integrator=integrator, spp=16).array)[0])
        for integrator in (
            mitsuba.load_dict({"type": name, "max_depth": 4}) for name in ("prb", "path")
        )
    ]
    assert means[0] == pytest.approx(means[1], rel=0.02)
