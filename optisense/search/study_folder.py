"""The folder of a study: free before, whole or gone, and as it was begun."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from optisense.design import SensorDesign, load_design, save_design
from optisense.errors import OutputError, SearchError
from optisense.search.difference import differences_from, fingerprint, plain_differences
from optisense.search.settings import STUDY_FILE, StudySettings
from optisense.search.store import Store

DESIGN_FOLDER = "design"
STORE_FILE = "trials.sqlite"
LOCK_FILE = ".lock"

MOST_SHOWN = 8
"""Differences that an error lists."""


def check_free(folder: Path) -> None:
    """Refuse a folder that holds something already.

    Raises:
        SearchError: it does.
        OutputError: it is no folder.
    """
    if (folder / STUDY_FILE).exists():
        raise SearchError(
            "there is a study in this folder already",
            where=str(folder),
            hint="Go on with it by --resume, or name another folder",
        )
    if folder.exists() and not folder.is_dir():
        raise OutputError("this is a file, not a folder", where=str(folder))
    if folder.is_dir() and any(folder.iterdir()):
        raise SearchError(
            "the folder is not empty", where=str(folder), hint="Name a folder that doesn't exist"
        )


@contextmanager
def only_whole(folder: Path) -> Iterator[None]:
    """Whatever is in a folder that was free before is removed again where the work fails."""
    existed = folder.exists()
    try:
        yield
    except BaseException:
        if existed:
            for each in folder.iterdir():
                shutil.rmtree(each) if each.is_dir() else each.unlink()
        else:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def kept(folder: Path, design: SensorDesign) -> SensorDesign:
    """The design as it will be read again, so that a resumed study has the very same one."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"the study's folder can't be made: {error.strerror or error}", where=str(folder)
        ) from error
    save_design(design, folder / DESIGN_FOLDER)
    return load_design(folder / DESIGN_FOLDER)


def as_begun(folder: Path, settings: StudySettings, store: Store) -> SensorDesign:
    """The study's own design, where neither it nor the settings were edited since it was begun.

    Raises:
        SearchError: one of them was; says what.
    """
    if store.fact("settings") != settings.fingerprint_of_all():
        begun = store.fact("study")
        raise SearchError(
            f"{STUDY_FILE} was edited since the study was begun"
            + _told(plain_differences(begun, settings.comparable()) if begun else []),
            where=str(folder / STUDY_FILE),
            hint="Undo the change, or begin a new study",
        )
    own = load_design(folder / DESIGN_FOLDER)
    if fingerprint(own) != settings.fingerprint:
        noted = store.fact("design")
        raise SearchError(
            "the study's own copy of the design was edited since its trials were made"
            + _told(differences_from(noted, own) if noted else []),
            where=str(folder / DESIGN_FOLDER),
            hint="Undo the change, or begin a new study of the edited design",
        )
    return own


def _told(changed: list[str]) -> str:
    return f":\n{listed(changed)}" if changed else ""


def listed(changed: list[str]) -> str:
    """The first of some differences, one a line."""
    shown = "\n".join(f"  {line}" for line in changed[:MOST_SHOWN])
    more = len(changed) - MOST_SHOWN
    return shown + (f"\n  and {more} more" if more > 0 else "")
