"""The folder of a study: its creation, and the check that it was not edited since."""

from __future__ import annotations

from pathlib import Path

from optisense.design import SensorDesign, load_design, save_design
from optisense.design.difference import differences_from, fingerprint, plain_differences
from optisense.design.problems import listed
from optisense.design.storage import files_of
from optisense.errors import SearchError
from optisense.folders import LOCK_FILE, FolderLock
from optisense.search.study.settings import STUDY_FILE, StudySettings
from optisense.search.study.store import Store

DESIGN_FOLDER = "design"
STORE_FILE = "trials.sqlite"
SQLITE_ENDINGS = ("", "-wal", "-shm", "-journal")
"""Endings that SQLite appends to the name of a store for the files that it keeps beside it."""


def lock_new_folder(folder: Path, design: SensorDesign) -> FolderLock:
    """Lock a folder for a new study, and record which files it will have; an error if it is not
    empty, has a study, or is in use.
    """
    lock = FolderLock(folder)
    try:
        if (folder / STUDY_FILE).exists():
            raise SearchError(
                "there is a study in this folder already",
                where=str(folder),
                hint="Continue it with --resume, or name another folder",
            )
        lock.check_empty()
        inner = [f"{DESIGN_FOLDER}/{file}" for file in (*files_of(design), LOCK_FILE)]
        lock.will_make([*inner, *(STORE_FILE + end for end in SQLITE_ENDINGS), STUDY_FILE])
    except BaseException:
        lock.release()
        raise
    return lock


def save_and_reload(folder: Path, design: SensorDesign) -> SensorDesign:
    """Save the design, and return it as read again, exactly as a resumed study has it."""
    save_design(design, folder / DESIGN_FOLDER)
    return load_design(folder / DESIGN_FOLDER)


def unedited_design(folder: Path, settings: StudySettings, store: Store) -> SensorDesign:
    """Return the study's own design; SearchError if it or the settings were edited, which tells
    how.
    """
    if store.fact("settings") != settings.fingerprint_of_all():
        begun = store.fact("study")
        raise SearchError(
            f"{STUDY_FILE} was edited since the study was begun"
            + _changes_in_words(plain_differences(begun, settings.comparable()) if begun else []),
            where=str(folder / STUDY_FILE),
            hint="Undo the change, or begin a new study",
        )
    own = load_design(folder / DESIGN_FOLDER)
    if fingerprint(own) != settings.fingerprint:
        noted = store.fact("design")
        raise SearchError(
            "the study's own copy of the design was edited since its trials were made"
            + _changes_in_words(differences_from(noted, own) if noted else []),
            where=str(folder / DESIGN_FOLDER),
            hint="Undo the change, or begin a new study of the edited design",
        )
    return own


def _changes_in_words(changed: list[str]) -> str:
    return f":\n{listed(changed)}" if changed else ""
