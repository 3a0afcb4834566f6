"""Choose the renderer's variant (processor or GPU, checked before the first kernel) and threads.

Neither Mitsuba nor Dr.Jit is imported before libLLVM has been checked (see
`optisense.optics.backend.llvm`), and not at all unless asked for a variant.
"""

from __future__ import annotations

import ctypes
import json
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, wraps
from importlib import import_module
from typing import Any

from optisense.errors import SetupError
from optisense.optics.backend.llvm import MINIMUM_LLVM, PATH_VARIABLE, find_llvm, load_atomic
from optisense.version import version_of

VARIANTS = {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb"}
"""Mitsuba's name for each variant that a user can request; ``auto`` selects one."""


@dataclass(frozen=True)
class KernelTest:
    """The result of compiling and running a tiny kernel in a child process."""

    variant: str
    passed: bool
    seconds: float
    message: str


def select_variant(variant: str = "auto") -> str:
    """Return Mitsuba's name of the variant to render with.

    Args:
        variant: ``llvm`` (processor), ``cuda`` (NVIDIA GPU), or ``auto``: CUDA where a GPU can be
            used, LLVM otherwise.

    Returns:
        ``"llvm_ad_rgb"`` or ``"cuda_ad_rgb"``, checked to be usable on this machine. The variant is
        not activated.

    Raises:
        SetupError: an unknown variant, no GPU for ``cuda``, no fit libLLVM for ``llvm``, or no
            libatomic.
    """
    if variant not in ("auto", *VARIANTS):
        raise SetupError(
            f"unknown variant '{variant}'",
            where="--variant",
            hint=f"Choose one of: auto, {', '.join(VARIANTS)}",
        )
    load_atomic()  # before anything imports Dr.Jit
    llvm_error = None
    try:
        _prepare_llvm()
    except SetupError as error:
        if variant == "llvm":
            raise
        llvm_error = error
    if variant != "llvm" and cuda_device_found():
        return VARIANTS["cuda"]
    if variant == "cuda":
        raise SetupError(
            "no CUDA device that the renderer can use was found",
            where="--variant cuda",
            hint="Use --variant llvm, or install NVIDIA's driver (with OptiX) and try again",
        )
    if llvm_error is not None:
        raise llvm_error
    return VARIANTS["llvm"]


def use_variant(variant: str = "auto") -> str:
    """Make a variant the current one of this process, and return Mitsuba's name for it.

    ``auto`` keeps the one that is already in use. Models of different variants must not be mixed.

    Raises:
        SetupError: the variant cannot be used on this machine, as in :func:`select_variant`.
    """
    name = select_variant(variant)
    mitsuba = import_renderer("mitsuba")
    current = mitsuba.variant()
    if variant == "auto" and current in VARIANTS.values():
        name = str(current)
    elif current != name:
        with _loops_rewritten_on_first_call():
            mitsuba.set_variant(name)
    # If Dr.Jit may merge gathers into packets, it generates one of several equivalent kernels by
    # chance and compiles each of them sooner or later. Without merging, the kernels are as fast and
    # always the same.
    drjit = import_renderer("drjit")
    drjit.set_flag(drjit.JitFlag.PacketOps, False)
    # For additions to an array of up to a million entries, Dr.Jit would make a copy of the array
    # for each thread. The kernel would contain the array's length, and be compiled anew for images
    # of another size and for other contacts, for seconds. Additions to the array itself are as
    # fast.
    drjit.set_expand_threshold(0)
    return name


@contextmanager
def _loops_rewritten_on_first_call() -> Iterator[None]:
    """Postpone the work of Dr.Jit's decorator for loops to the first call of each function.

    When a variant is set, Mitsuba loads integrators written in Python that this package does not
    use, and the decorator parses and compiles the source of each. This would take a sixth of a
    second.
    """
    drjit = import_renderer("drjit")
    rewrite = drjit.syntax

    def put_off(function: Callable[..., Any]) -> Callable[..., Any]:
        rewritten = cache(lambda: rewrite(function))

        @wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            return rewritten()(*arguments, **named)

        return call

    drjit.syntax = put_off
    try:
        yield
    finally:
        drjit.syntax = rewrite


def cuda_device_found() -> bool:
    """Return whether Dr.Jit finds a CUDA device and its driver has the OptiX library."""
    if sys.platform == "darwin" or not _cuda_driver_present():
        return False
    drjit = import_renderer("drjit")
    return bool(drjit.has_backend(drjit.JitBackend.CUDA))


def one_scene_per_kernel() -> bool:
    """Return whether a kernel can trace rays in only one scene, which is so with OptiX."""
    return str(import_renderer("mitsuba").variant()).startswith("cuda")


TEST_SECONDS = 120.0
"""Time after which the process of a test kernel is ended, s; a usual one takes some seconds."""


def run_test_kernel(variant: str = "auto") -> KernelTest:
    """Compile and run a tiny kernel and trace a few rays, in a child process.

    Args:
        variant: the variant, as in :func:`select_variant`.
    """
    command = (
        f"from optisense.optics.backend.variant import _kernel_child; _kernel_child({variant!r})"
    )
    try:
        child = subprocess.run(
            [sys.executable, "-c", command],
            capture_output=True,
            text=True,
            timeout=TEST_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return KernelTest(variant, False, TEST_SECONDS, f"no answer within {TEST_SECONDS:.0f} s")
    try:
        return KernelTest(**json.loads(child.stdout.strip().splitlines()[-1]))
    except (IndexError, ValueError, TypeError):
        last_words = child.stderr.strip().splitlines()[-1:] or ["no message"]
        died = f"the test kernel ended its process (exit code {child.returncode}): {last_words[0]}"
        return KernelTest(variant, False, 0.0, died)


def _kernel_child(variant: str) -> None:
    """Body of the child process of :func:`run_test_kernel`: prints its result as JSON."""
    import time

    start = time.perf_counter()
    result: dict[str, Any] = {"variant": variant, "passed": False, "message": ""}
    try:
        name = select_variant(variant)
        result["variant"] = name
        mitsuba = import_renderer("mitsuba")
        mitsuba.set_variant(name)
        drjit = import_renderer("drjit")
        total = drjit.sum(drjit.minimum(drjit.arange(mitsuba.Float, 1000) + 0.5, 1e9))
        scene = mitsuba.load_dict({"type": "scene", "ball": {"type": "sphere", "radius": 2.0}})
        rays = mitsuba.Ray3f(mitsuba.Point3f(0, 0, [-5, -4, -3]), mitsuba.Vector3f(0, 0, 1))
        distance = scene.ray_intersect(rays).t
        right = abs(total[0] - 500000.0) < 1.0 and abs(distance[1] - 2.0) < 1e-4
        result["passed"] = bool(right)
        result["message"] = "right results" if right else "wrong results"
    except Exception as error:
        result["message"] = str(error)
    result["seconds"] = time.perf_counter() - start
    print(json.dumps(result))


def _prepare_llvm() -> None:
    """Find libLLVM before Dr.Jit is imported, or raise SetupError if the loaded one is too old."""
    if "drjit" not in sys.modules:
        find_llvm()
        return
    drjit = import_module("drjit")
    if not drjit.has_backend(drjit.JitBackend.LLVM):
        find_llvm()  # says what is missing, when that is the reason
        raise SetupError(
            "the renderer was imported before its libLLVM was found",
            where="set-up",
            hint="Import optisense before mitsuba and drjit, and start Python anew",
        )
    major = int(drjit.detail.llvm_version()[0])
    if major < MINIMUM_LLVM:
        library = find_llvm()
        raise SetupError(
            f"the renderer has already loaded libLLVM {major}, which is too old",
            where="set-up",
            hint=f"Import optisense before mitsuba and drjit, or set {PATH_VARIABLE} to "
            f"{library.path}, and start Python anew",
        )


def _cuda_driver_present() -> bool:
    """Return whether NVIDIA's driver is installed with both CUDA and OptiX."""
    names = (
        ("nvcuda.dll", "nvoptix.dll")
        if sys.platform == "win32"
        else (
            "libcuda.so.1",
            "libnvoptix.so.1",
        )
    )
    try:
        for name in names:
            ctypes.CDLL(name)
    except OSError:
        return False
    return True


def import_renderer(name: str) -> Any:
    """Import Mitsuba or Dr.Jit, which must not be imported together with this module.

    Raises:
        SetupError: the package, or a system library that it needs, is not installed.
    """
    load_atomic()
    try:
        return import_module(name)
    except Exception as error:  # Dr.Jit turns a failed import into a NameError
        raise SetupError(
            f"the renderer can't be imported: {error}",
            where="set-up",
            hint="Install the package's dependencies: pip install optisense",
        ) from error


def use_threads(count: int) -> None:
    """Set the number of threads that Dr.Jit uses, for processes that share a machine.

    Raises:
        SetupError: the renderer can't run on this machine.
    """
    select_variant("auto")  # libLLVM is checked before Dr.Jit is imported
    import_renderer("drjit").set_thread_count(count)


@contextmanager
def threads_for_exr_files() -> Iterator[None]:
    """Give Dr.Jit a second thread, if it has only one, while Mitsuba writes or reads EXR files.

    Mitsuba compresses and expands them in tasks for Dr.Jit's threads and waits for these without
    working on them itself. On one processor Dr.Jit has no other thread than the waiting one.
    """
    dr = import_renderer("drjit")
    count = dr.thread_count()
    if count < 2:
        dr.set_thread_count(2)
    try:
        yield
    finally:
        if count < 2:
            dr.set_thread_count(count)


def versions(variant: str) -> dict[str, str]:
    """Return the versions of the packages that affect rendered values, for the record of a run."""
    packages = ("optisense", "mitsuba", "drjit", "numpy")
    installed = {name: version_of(name) for name in packages}
    return {"python": platform.python_version(), "variant": variant, **installed}
