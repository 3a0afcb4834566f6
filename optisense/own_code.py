"""Errors of any kind as errors for the user, with the place in the user's Python code if it took
part.
"""

from __future__ import annotations

import os
import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import distributions
from pathlib import Path
from types import FrameType

from optisense.errors import OptiSenseError, OutputError, OwnCodeError, SetupError

HOME = Path(__file__).parent
"""Folder of this package."""

GROUPS = "optisense."
"""Start of the names of the groups of entry points by which packages add to this one."""

REPAIR = "Repair this file or the package that contains it"
"""Remedy for errors in code of users."""

INSTALLED = frozenset({"site-packages", "dist-packages"})
"""Names of the folders of installed packages."""


def place_of(error: BaseException, file: str | None = None) -> str | None:
    """Return the ``file:line`` of an error's origin: the last one in `file`, or the last of all."""
    frames = traceback.extract_tb(error.__traceback__)
    inside = [frame for frame in frames if file is None or frame.filename == file]
    return f"{inside[-1].filename}:{inside[-1].lineno}" if inside else file


def as_user_error(error: BaseException, *, less_work: str, see: str) -> OptiSenseError:
    """Return an error of any kind as one for the user; an `OptiSenseError` is returned as it is.

    Args:
        less_work: remedy if the memory does not suffice.
        see: what shows the traceback of a defect of this package.
    """
    if isinstance(error, OptiSenseError):
        return error
    if isinstance(error, MemoryError):
        return SetupError("not enough memory", hint=less_work)
    if isinstance(error, OSError):
        return OutputError.of(error)
    return error_of_own_code(error) or OptiSenseError(
        f"unexpected {type(error).__name__}: {error}",
        hint=f"This is a defect of OptiSense; {see} shows where it is",
    )


def error_of_own_code(error: BaseException) -> OwnCodeError | None:
    """Return an error with the place in a user's code through which another one was raised.

    A user's code is all code outside of this package, of the standard library and of installed
    packages, and installed packages that add something to this one by an entry point.

    Returns:
        The error; None if no user's code took part.
    """
    adding = {
        re.split("[.:]", point.value)[0].strip()  # `point.module` fails for a malformed value
        for package in distributions()
        for point in package.entry_points
        if point.group.startswith(GROUPS)
    }
    own = [
        f"{frame.f_code.co_filename}:{line}"
        for frame, line in traceback.walk_tb(error.__traceback__)
        if _is_own(frame, adding)
    ]
    if not own:
        return None
    return OwnCodeError(
        f"{type(error).__name__}: {error}",
        where=own[-1],
        hint=REPAIR,
    )


@contextmanager
def failures_named(what: str, where: str) -> Iterator[None]:
    """Context for a call of a user's code, in which an error names what failed.

    Errors that have a message for the user anyhow (see `as_user_error`), and defects of this
    package, are left as they are.

    Args:
        what: what is called, with its name.
        where: its place, for errors that are raised before its first line.

    Raises:
        OwnCodeError: there was an error of another kind.
    """
    try:
        yield
    except (OptiSenseError, MemoryError, OSError):
        raise
    except Exception as error:
        own = error_of_own_code(error)
        if own is None and where.startswith(f"{HOME}{os.sep}"):
            raise
        raise OwnCodeError(
            f"{what} fails: {type(error).__name__}: {error}",
            where=where if own is None else own.where,
            hint=REPAIR,
        ) from error


def _is_own(frame: FrameType, adding: set[str]) -> bool:
    file = Path(frame.f_code.co_filename)
    package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
    if str(file).startswith("<") or package in sys.stdlib_module_names:
        return False
    if file.is_relative_to(HOME) or file.is_relative_to(HOME.parent / "paper"):
        return False
    return package in adding or not INSTALLED.intersection(file.parts)
