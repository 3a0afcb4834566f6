"""The system libraries that the renderer needs: a suitable libLLVM, and libatomic.

Dr.Jit, the renderer's compiler, loads libLLVM the moment it is imported. With libLLVM 15 or 16 the
first kernel on an AVX-512 machine aborts the whole process (``Cannot select: fminimum``), and
without libLLVM every kernel fails. A suitable library is therefore searched for *before* the
import, and its path is passed to Dr.Jit in the variable ``DRJIT_LIBLLVM_PATH``.
"""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from optisense.errors import SetupError

MINIMUM_LLVM = 17
"""Oldest major version of libLLVM that does not abort the process, as 15 and 16 do."""

TESTED_LLVM = 19
"""Major version of libLLVM preferred when several are installed: the one that the tests run
with."""

PATH_VARIABLE = "DRJIT_LIBLLVM_PATH"

ATOMIC_LIBRARY = "libatomic.so.1"
"""A system library that Dr.Jit is linked to on Linux and that a bare Debian lacks."""

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

_FILE_NAMES = {"linux": "libLLVM*.so*", "darwin": "libLLVM*.dylib"}

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
    def is_suitable(self) -> bool:
        """Whether the renderer can use the library without aborting the process."""
        return self.version[0] >= MINIMUM_LLVM

    def __str__(self) -> str:
        return f"libLLVM {self.version[0]}.{self.version[1]} ({self.path})"


def install_command() -> str:
    """Return the command that installs a suitable libLLVM on this kind of machine."""
    if sys.platform == "darwin":
        return "brew install llvm"
    return system_command(
        f"libllvm{TESTED_LLVM} libatomic1", "llvm-libs", "llvm-libs", f"libLLVM{TESTED_LLVM}"
    )


def installed_llvms() -> list[LlvmLibrary]:
    """Return every libLLVM in the usual places, the most suitable one first.

    Nothing is loaded into this process. Versions come from file and folder names; if these contain
    none, a child process calls ``LLVMGetVersion``.
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
        key=lambda library: (not library.is_suitable, abs(library.version[0] - TESTED_LLVM)),
    )


def find_llvm() -> LlvmLibrary:
    """Find the libLLVM to render with, and set ``DRJIT_LIBLLVM_PATH`` to its path.

    A path that the user has put in ``DRJIT_LIBLLVM_PATH`` is checked and used unchanged.

    Raises:
        SetupError: no libLLVM is found, or none that is new enough; the hint is the command that
            installs one.
    """
    chosen = os.environ.get(PATH_VARIABLE)
    if chosen:
        return _check_chosen(chosen)
    too_old, broken = [], []
    for library in installed_llvms():
        if not library.is_suitable:
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


def _check_chosen(chosen: str) -> LlvmLibrary:
    """Check and return the library that the user named in ``DRJIT_LIBLLVM_PATH``."""
    where = f"{PATH_VARIABLE}={chosen}"
    hint = f"Unset {PATH_VARIABLE}, or set it to libLLVM {MINIMUM_LLVM} or newer"
    path = Path(chosen)
    version = _version_of(path.resolve()) if path.exists() else _ask_version(chosen)
    if version is None:
        raise SetupError("this file is not a libLLVM that can be loaded", where=where, hint=hint)
    library = LlvmLibrary(path, version)
    if not library.is_suitable:
        raise SetupError(
            f"libLLVM {version[0]} is too old, the renderer needs {MINIMUM_LLVM} or newer",
            where=where,
            hint=hint,
        )
    if not _loads(path):
        raise SetupError("this libLLVM can't be loaded", where=where, hint=hint)
    return library


def system_command(apt: str, dnf: str, pacman: str, zypper: str) -> str:
    """Return the command that installs a package, given its name in each package manager."""
    for tool, command in (
        ("apt-get", f"apt-get install {apt}"),
        ("dnf", f"dnf install {dnf}"),
        ("pacman", f"pacman -S {pacman}"),
        ("zypper", f"zypper install {zypper}"),
    ):
        if shutil.which(tool):
            is_root = hasattr(os, "geteuid") and os.geteuid() == 0
            return command if is_root else f"sudo {command}"
    return f"install {apt} (or what this system calls it)"


def load_atomic() -> None:
    """Load libatomic on Linux, from the system or from the environment that Python runs in.

    Dr.Jit is linked to it and finds it once it is loaded; without it, Dr.Jit fails with a
    misleading message.

    Raises:
        SetupError: libatomic is not found; the hint is the command that installs it.
    """
    if sys.platform != "linux":
        return
    for place in ("", *(f"{folder}/" for folder in _environment_folders())):
        try:
            ctypes.CDLL(place + ATOMIC_LIBRARY)
            return
        except OSError:
            continue
    raise SetupError(
        f"the system library {ATOMIC_LIBRARY} is missing, which the renderer needs",
        where="set-up",
        hint="Type: " + system_command("libatomic1", "libatomic", "gcc-libs", "libatomic1"),
    )


def _environment_folders() -> list[Path]:
    """Return the library folders of an environment (of conda, too) and of the one below it."""
    return [Path(prefix) / "lib" for prefix in dict.fromkeys((sys.prefix, sys.base_prefix))]


def _library_files() -> Iterator[Path]:
    """Yield the files in the usual places whose names are those of a libLLVM."""
    if sys.platform in _FILE_NAMES:
        for folder in _environment_folders():
            yield from sorted(folder.glob(_FILE_NAMES[sys.platform]))
    for pattern in _LIBRARY_PATTERNS.get(sys.platform, ()):
        yield from sorted(Path("/").glob(pattern.lstrip("/")))
    if sys.platform == "win32":
        tool = shutil.which("LLVM-C.dll")
        if tool:
            yield Path(tool)


def _version_of(path: Path) -> tuple[int, int] | None:
    """Return the version of the libLLVM at a resolved path, or None if it cannot be determined."""
    match = _VERSION_IN_NAME.match(path.name) or _VERSION_IN_FOLDER.search(str(path.parent))
    if match and path.name.startswith("libLLVM"):
        return int(match[1]), int(match[2] or 0)
    return _ask_version(str(path))


def _ask_version(path: str) -> tuple[int, int] | None:
    """Return the version that ``LLVMGetVersion`` (LLVM 16 and newer) reports in a child process."""
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
    """Return whether the dynamic linker accepts the library, which Dr.Jit will load."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        return False
    return hasattr(library, "LLVMGetVersion")


def _listed(libraries: list[LlvmLibrary]) -> str:
    return ", ".join(str(library) for library in libraries)
