"""Choose the renderer's variant, and make sure of its libLLVM before the first kernel.

Dr.Jit, which compiles Mitsuba's kernels, loads a libLLVM shared library the moment it is
imported. With libLLVM 15 or 16 the first kernel on an AVX-512 machine aborts the whole process
(``Cannot select: fminimum``), and with none at all every kernel fails. So this module looks for a
fit library *before* Mitsuba is imported, and hands its path to Dr.Jit through the variable
``DRJIT_LIBLLVM_PATH``. It imports neither Mitsuba nor Dr.Jit unless asked for a variant.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from optisense.errors import SetupError

MINIMUM_LLVM = 17
"""Oldest libLLVM that does not abort the process (15 and 16 were seen to)."""

TESTED_LLVM = 19
"""The version preferred when several are installed: the one the tests run with."""

VARIANTS = {"llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb"}
"""Mitsuba's name for each variant a user can ask for; ``auto`` picks one."""

PATH_VARIABLE = "DRJIT_LIBLLVM_PATH"

_LIBRARY_PATTERNS = {
    "linux": (
        "/usr/lib/*-linux-gnu*/libLLVM*.so*",
        "/usr/lib/llvm-*/lib/libLLVM*.so*",
        "/usr/lib64/libLLVM*.so*",
        "/usr/lib64/llvm*/lib*/libLLVM*.so*",
        "/usr/lib/libLLVM*.so*",
        "/usr/local/lib/libLLVM*.so*",
        "/usr/local/lib/llvm*/lib/libLLVM*.so*",
    ),
    "darwin": (
        "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
        "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
        "/opt/local/libexec/llvm-*/lib/libLLVM*.dylib",
    ),
}

# "libLLVM.so.19.1", "libLLVM-19.so", "libLLVM-14.0.6.so.1", "libLLVM.19.dylib"
_VERSION_IN_NAME = re.compile(r"libLLVM(?:-|\.so\.|\.)(\d{2,})(?:\.(\d+))?")
# ".../llvm-19/lib/libLLVM.so", ".../Cellar/llvm/19.1.7/lib/libLLVM.dylib", ".../llvm@19/lib/..."
_VERSION_IN_FOLDER = re.compile(r"llvm(?:-|@|/|@\d+/)(\d{2,})(?:\.(\d+))?")

_ASK_VERSION = """
import ctypes, sys
library = ctypes.CDLL(sys.argv[1])
parts = [ctypes.c_uint() for _ in range(3)]
library.LLVMGetVersion(*[ctypes.byref(part) for part in parts])
print(*[part.value for part in parts[:2]])
"""


@dataclass(frozen=True)
class LlvmLibrary:
    """A libLLVM shared library on this machine and its (major, minor) version."""

    path: Path
    version: tuple[int, int]

    @property
    def is_fit(self) -> bool:
        """Whether the renderer can run on it without taking the process down."""
        return self.version[0] >= MINIMUM_LLVM

    def __str__(self) -> str:
        return f"libLLVM {self.version[0]}.{self.version[1]} ({self.path})"


@dataclass(frozen=True)
class KernelTest:
    """What came of compiling and running a tiny kernel in a child process."""

    variant: str
    passed: bool
    seconds: float
    message: str


def install_command() -> str:
    """The one command that installs a fit libLLVM on this kind of machine."""
    if sys.platform == "darwin":
        return "brew install llvm"
    for tool, command in (
        ("apt-get", f"apt-get install libllvm{TESTED_LLVM}"),
        ("dnf", "dnf install llvm-libs"),
        ("pacman", "pacman -S llvm-libs"),
        ("zypper", f"zypper install libLLVM{TESTED_LLVM}"),
    ):
        if shutil.which(tool):
            is_root = hasattr(os, "geteuid") and os.geteuid() == 0
            return command if is_root else f"sudo {command}"
    return f"install LLVM {TESTED_LLVM} and set {PATH_VARIABLE} to its libLLVM"


def installed_llvms() -> list[LlvmLibrary]:
    """Every libLLVM in the usual places, the most suitable one first.

    Nothing is loaded into this process. Versions come from file and folder names, where these say
    nothing from ``LLVMGetVersion`` called in a child process.
    """
    libraries = {}
    for path in _library_files():
        real = path.resolve()
        if real not in libraries:
            version = _version_of(real)
            if version is not None:
                libraries[real] = LlvmLibrary(path, version)
    return sorted(
        libraries.values(),
        key=lambda library: (not library.is_fit, abs(library.version[0] - TESTED_LLVM)),
    )


def find_llvm() -> LlvmLibrary:
    """The libLLVM to render with, and ``DRJIT_LIBLLVM_PATH`` set to it.

    A path that the user has put in ``DRJIT_LIBLLVM_PATH`` is used as it is, after a check.

    Raises:
        SetupError: there is none, or none new enough; the hint is the command to type.
    """
    chosen = os.environ.get(PATH_VARIABLE)
    if chosen:
        return _check_chosen(chosen)
    too_old, broken = [], []
    for library in installed_llvms():
        if not library.is_fit:
            too_old.append(library)
        elif _loads(library.path):
            os.environ[PATH_VARIABLE] = str(library.path)
            return library
        else:
            broken.append(library)
    if broken:
        message = f"no libLLVM here can be loaded; tried {_listed(broken)}"
    elif too_old:
        message = (
            f"every libLLVM here is too old, the renderer needs {MINIMUM_LLVM} or newer; "
            f"found {_listed(too_old)}"
        )
    else:
        message = f"no libLLVM was found, the renderer needs version {MINIMUM_LLVM} or newer"
    raise SetupError(message, where="set-up", hint=f"Type: {install_command()}")


def select_variant(variant: str = "auto") -> str:
    """Mitsuba's name of the variant to render with.

    Args:
        variant: ``llvm`` (processor), ``cuda`` (NVIDIA GPU), or ``auto``: CUDA where a GPU can be
            used, LLVM otherwise.

    Returns:
        ``"llvm_ad_rgb"`` or ``"cuda_ad_rgb"``, checked to be usable on this machine. The variant
        is not activated.

    Raises:
        SetupError: an unknown variant, no GPU for ``cuda``, or no fit libLLVM for ``llvm``.
    """
    if variant not in ("auto", *VARIANTS):
        raise SetupError(
            f"unknown variant '{variant}'",
            where="--variant",
            hint=f"Choose one of: auto, {', '.join(VARIANTS)}",
        )
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


def cuda_device_found() -> bool:
    """Whether Dr.Jit sees a CUDA device and the driver has the OptiX library for ray tracing."""
    if sys.platform == "darwin" or not _cuda_driver_present():
        return False
    drjit = _import_renderer("drjit")
    return bool(drjit.has_backend(drjit.JitBackend.CUDA))


def run_test_kernel(variant: str = "auto", timeout: float = 120.0) -> KernelTest:
    """Compile and run a tiny kernel and trace a few rays, in a child process.

    Args:
        variant: as for :func:`select_variant`.
        timeout: seconds after which the child is ended.
    """
    command = f"from optisense.optics.variant import _kernel_child; _kernel_child({variant!r})"
    try:
        child = subprocess.run(
            [sys.executable, "-c", command],
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return KernelTest(variant, False, timeout, f"no answer within {timeout:.0f} s")
    try:
        return KernelTest(**json.loads(child.stdout.strip().splitlines()[-1]))
    except (IndexError, ValueError, TypeError):
        last_words = child.stderr.strip().splitlines()[-1:] or ["no message"]
        died = f"the kernel took its process down (exit {child.returncode}): {last_words[0]}"
        return KernelTest(variant, False, 0.0, died)


def _kernel_child(variant: str) -> None:
    """Body of the child process of :func:`run_test_kernel`: prints its result as JSON."""
    import time

    start = time.perf_counter()
    result: dict[str, Any] = {"variant": variant, "passed": False, "message": ""}
    try:
        name = select_variant(variant)
        result["variant"] = name
        mitsuba = _import_renderer("mitsuba")
        mitsuba.set_variant(name)
        drjit = _import_renderer("drjit")
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
    """Find libLLVM in time; where Dr.Jit already runs, check the one it has loaded.

    Raises:
        SetupError: none, or one that is too old.
    """
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


def _check_chosen(chosen: str) -> LlvmLibrary:
    """The library the user named in ``DRJIT_LIBLLVM_PATH``, checked."""
    where = f"{PATH_VARIABLE}={chosen}"
    hint = f"Unset {PATH_VARIABLE}, or set it to libLLVM {MINIMUM_LLVM} or newer"
    path = Path(chosen)
    version = _version_of(path.resolve()) if path.exists() else _ask_version(chosen)
    if version is None:
        raise SetupError("this is no libLLVM that can be loaded", where=where, hint=hint)
    library = LlvmLibrary(path, version)
    if not library.is_fit:
        raise SetupError(
            f"libLLVM {version[0]} is too old, the renderer needs {MINIMUM_LLVM} or newer",
            where=where,
            hint=hint,
        )
    if not _loads(path):
        raise SetupError("this libLLVM can't be loaded", where=where, hint=hint)
    return library


def _library_files() -> Iterator[Path]:
    """Files that look like a libLLVM, in the usual places."""
    for pattern in _LIBRARY_PATTERNS.get(sys.platform, ()):
        yield from sorted(Path("/").glob(pattern.lstrip("/")))
    if sys.platform == "win32":
        tool = shutil.which("LLVM-C.dll")
        if tool:
            yield Path(tool)


def _version_of(path: Path) -> tuple[int, int] | None:
    """Version of the libLLVM at a resolved path, None when it can't be told."""
    match = _VERSION_IN_NAME.match(path.name) or _VERSION_IN_FOLDER.search(str(path.parent))
    if match and path.name.startswith("libLLVM"):
        return int(match[1]), int(match[2] or 0)
    return _ask_version(str(path))


def _ask_version(path: str) -> tuple[int, int] | None:
    """Version by ``LLVMGetVersion`` (LLVM 16 and newer), asked in a child process."""
    try:
        answer = subprocess.run(
            [sys.executable, "-c", _ASK_VERSION, path],
            capture_output=True,
            text=True,
            timeout=30,
            check=True,
        )
        major, minor = answer.stdout.split()
        return int(major), int(minor)
    except (OSError, ValueError, subprocess.SubprocessError):
        return None


def _loads(path: Path) -> bool:
    """Whether the dynamic linker accepts the library (Dr.Jit will load the same one)."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        return False
    return hasattr(library, "LLVMGetVersion")


def _cuda_driver_present() -> bool:
    """Whether NVIDIA's driver is there with both CUDA and OptiX."""
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


def _import_renderer(name: str) -> Any:
    """Import Mitsuba or Dr.Jit, which must not happen when this module is imported.

    Raises:
        SetupError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise SetupError(
            f"the renderer can't be imported: {error}",
            where="set-up",
            hint="Install the package's dependencies: pip install optisense",
        ) from error


def _listed(libraries: list[LlvmLibrary]) -> str:
    return ", ".join(str(library) for library in libraries)
