"""The process in which Open CASCADE reads a STEP file, for `optisense.geometry.step.read_step`.

Open CASCADE is compiled code that crashes or does not terminate on some malformed files, and
neither raises an exception. It therefore runs in a separate process, so that a crash only ends the
reading of that file. The process ``python -m optisense.geometry._step_process FILE FOLDER`` writes
the bodies found, or the error, into the folder.
"""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from optisense.errors import OptiSenseError
from optisense.geometry.step import BODIES_FILE, ERROR_FILE, bodies_of

LONGEST = 600
"""Largest processor time (s) for one file; the largest STEP files of sensors take a minute."""

MOST_MEMORY = 16 * 2**30
"""Largest address space (bytes) for one file; 64 MiB of STEP take some 4 GiB."""


def main() -> int:
    """Read a file and write its bodies; return the exit status, 1 if it cannot be read."""
    path, folder = Path(sys.argv[1]), Path(sys.argv[2])
    _bound()
    try:
        bodies = bodies_of(path)
    except OptiSenseError as error:
        report: dict[str, str | None] = {"kind": type(error).__name__, "message": error.message}
        report |= {"where": error.where, "hint": error.hint}
        (folder / ERROR_FILE).write_text(json.dumps(report), encoding="utf-8")
        return 1
    arrays: dict[str, Any] = {}
    for number, body in enumerate(bodies):
        arrays[f"vertices{number}"] = body.mesh.vertices
        arrays[f"faces{number}"] = body.mesh.faces
    names = np.array([body.name for body in bodies], dtype=str)
    arrays["solids"] = [body.solid for body in bodies]
    arrays["kinds"] = [body.kind for body in bodies]
    np.savez(folder / BODIES_FILE, names=names, **arrays)
    return 0


def _bound() -> None:
    """Limit the time and the memory of this process, if the system supports it."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST + 10))
        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    # os._exit skips the interpreter's finalisation, which would destroy objects that may be
    # incomplete.
    os._exit(main())
