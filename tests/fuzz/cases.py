"""A case: the files of one input by their names, and where cases that were found are kept."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

FOUND = Path(__file__).parents[1] / "assets" / "fuzz"
"""A folder for each kind of input, and in it a folder of files for each case."""

Case = dict[str, bytes]
"""What is in the files of an input, by their paths from its folder. Input that is a text, such as
a contact, is the file ``text``."""


def write_case(case: Case, folder: Path) -> None:
    """Write the files of a case into a folder, which is emptied first."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, data in case.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def read_case(folder: Path) -> Case:
    """The files of a case that was kept."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def kept_cases(kind: str) -> list[Path]:
    """The folders of the cases of a kind that were found once."""
    place = FOUND / kind
    return sorted(place.iterdir()) if place.is_dir() else []


def keep_case(kind: str, case: Case, into: Path = FOUND) -> Path:
    """Keep a case that was found; its folder is named after what is in it."""
    total = hashlib.sha256()
    for name, data in sorted(case.items()):
        total.update(name.encode() + b"\0" + data + b"\0")
    folder = into / kind / total.hexdigest()[:12]
    write_case(case, folder)
    return folder
