"""Loading of objectives from a user's Python file."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from optisense.errors import ObjectiveError
from optisense.own_code import place_of
from optisense.untrusted_files import MOST_PROGRAM, read_bytes


def run_file(path: Path) -> dict[str, Any]:
    """Run a Python file as a module of its own and return the names it defines.

    The text of the file is compiled at each call. Python's import system would use compiled code
    from ``__pycache__`` if the size and the second of the last change were the same, and so miss a
    quick edit; it would also write that folder beside the user's file.

    Raises:
        ObjectiveError: the file is missing or fails; the message names the line that failed.
    """
    if not path.is_file():
        raise ObjectiveError(f"there is no file '{path}'", hint="Give FILE.py:FUNCTION")
    whole = Path(os.path.realpath(path))
    name = f"optisense_user_{path.stem}_{hashlib.sha256(str(whole).encode()).hexdigest()[:8]}"
    source = read_bytes(whole, MOST_PROGRAM, ObjectiveError)
    module = ModuleType(name)
    module.__file__ = str(whole)
    sys.modules[name] = module
    try:
        exec(compile(source, str(whole), "exec", dont_inherit=True), vars(module))
    except ObjectiveError:
        raise
    except SyntaxError as error:
        raise ObjectiveError(
            f"the file is not Python: {error.msg}", where=f"{path}:{error.lineno}"
        ) from error
    except Exception as error:
        raise ObjectiveError(
            f"the file failed: {type(error).__name__}: {error}",
            where=place_of(error, str(whole)) or str(path),
        ) from error
    return vars(module)
