"""Settings of a study, written as study.json, which suffice to resume it on another machine."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from optisense.errors import SearchError
from optisense.text import brief
from optisense.untrusted_files import COPY_AGAIN, first_problem, is_file, read_json
from optisense.version import version_of
from optisense.writing import write_text

STUDY_VERSION = 1
"""Version of the format of `STUDY_FILE`; it is increased when an older program can't read it."""
STUDY_FILE = "study.json"

LIBRARIES = ("optisense", "cma", "numpy", "scipy", "mitsuba")
"""Packages on which the numbers of a study depend."""

ONLY_HERE = "function:"
"""Prefix of the name of a goal or rule that is a function of the calling program, in no file."""

MOST_NAMES = 100
"""Largest number of a study's objectives, or rules; with more, no useful front is found."""

LATER = ("requirements", "coarse_first", "packages")
"""Settings that studies of earlier releases do not have. They count as their defaults, and are left
out of comparisons if they have their defaults, so that such studies can be resumed.
"""

OPTIONAL = (*LATER, "scoring")
"""Names that may be missing in `STUDY_FILE`. New studies always have a version of the scoring; a
study of another version is resumed if its scores are the same (`_same_scoring`).
"""

Names = Annotated[list[str], Field(max_length=MOST_NAMES)]
Whole = Annotated[int, Field(ge=0, le=2**53)]


@dataclass(frozen=True)
class StudySettings:
    """Settings that determine the course of a study.

    Attributes:
        design, fingerprint: name and fingerprint of the design (`optisense.design.difference`).
        space: parameters, as from `SearchSpace.to_plain`.
        objectives: references to the objectives: names, FILE.py:FUNCTION, or "function:NAME" for
            functions of the program that began the study.
        names: names of their scores, in the same order.
        rules: constraints as FILE.py:FUNCTION, or "function:NAME".
        files: SHA-256 of each user's file with objectives or rules, by path.
        packages: installed packages of objectives, the method and kinds
            (`optisense.search.study._same_scoring`); empty also if they were not stored yet.
        errors: manufacturing errors, as from `ManufacturingErrors.to_plain`, for P10; else None.
        scoring: version of the definitions of the scores (`optisense.search.study._same_scoring`);
            0 if it was not stored yet.
        begun: time of creation, UTC.
        versions: versions of the packages with which the study was begun.

    See `optisense.search.search` for the others.
    Values that are read from a file must have these types, and unknown fields are refused.
    Parameters, manufacturing errors and options are checked where they are used.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(strict=True, extra="forbid")

    design: str
    fingerprint: str
    space: dict[str, Any]
    objectives: Annotated[Names, Field(min_length=1)]
    names: Annotated[Names, Field(min_length=1)]
    method: str
    options: dict[str, Any]
    budget: Whole
    seed: Whole
    settings: dict[str, Any] = field(default_factory=dict)
    apart: bool = True
    rules: Names = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    errors: dict[str, Any] | None = None
    samples: Whole = 0
    requirements: Names = field(default_factory=list)
    coarse_first: bool = False
    packages: dict[str, dict[str, str]] = field(default_factory=dict)
    scoring: Whole = 0
    begun: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    versions: dict[str, str] = field(default_factory=lambda: package_versions())

    def to_text(self) -> str:
        """Return the settings as JSON text."""
        return json.dumps({"study_version": STUDY_VERSION, **asdict(self)}, indent=1) + "\n"

    def fingerprint_of_all(self) -> str:
        """Return a hash that is equal for studies with the same course."""
        kept = self._without("begun", "versions", "design")
        return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()

    def comparable(self) -> dict[str, Any]:
        """Return the settings that must be equal for a study to be resumed. The design, which is
        compared value by value, the budget, which may grow, the version of the scoring, of which
        trials are compared, and the packages, which have an error of their own, are left out.
        """
        return self._without(
            "begun", "versions", "scoring", "packages", "design", "fingerprint", "budget"
        )

    def _without(self, *names: str) -> dict[str, Any]:
        """Return all settings but these, and but those of `OPTIONAL` that are not used."""
        return {
            key: value
            for key, value in asdict(self).items()
            if key not in names and not (key in OPTIONAL and not value)
        }

    def save(self, folder: Path) -> None:
        """Write study.json; the file appears whole."""
        write_text(folder / STUDY_FILE, self.to_text(), "the study")

    @staticmethod
    def load(folder: Path) -> StudySettings:
        """Read study.json; SearchError if there is no study, or its settings can't be read."""
        path = folder / STUDY_FILE
        if not is_file(path):
            raise SearchError(
                "there is no study in this folder",
                where=str(folder),
                hint="Name the folder given as --out",
            )
        data = read_json(path, SearchError)
        if not isinstance(data, dict):
            raise SearchError("the study is no JSON object", where=str(path), hint=COPY_AGAIN)
        refuse_other_version("study", data.pop("study_version", None), STUDY_VERSION, path)
        known = {each.name for each in fields(StudySettings)}
        missing = known - data.keys() - set(OPTIONAL)
        if missing:
            names = ", ".join(sorted(missing))
            raise SearchError(f"{names} is missing", where=str(path), hint=COPY_AGAIN)
        try:
            schema = TypeAdapter(StudySettings)
            settings = schema.validate_json(json.dumps(data))  # the values as JSON has them
        except ValidationError as error:
            newer = "A newer release may have written it: update OptiSense Studio"
            hint = COPY_AGAIN if data.keys() <= known else newer
            raise SearchError(first_problem(error), where=str(path), hint=hint) from None
        different, count = len(set(settings.names)), len(settings.objectives)
        if different != count:
            problem = f"'names' has {different} names for {count} objectives"
            raise SearchError(problem, where=str(path), hint=COPY_AGAIN)
        return settings


def refuse_other_version(what: str, found: object, known: int, path: Path) -> None:
    """Raise SearchError if a file has another version than the one that this release reads."""
    if found != known or isinstance(found, bool):
        newer = isinstance(found, int) and found > known
        raise SearchError(
            f"the {what} has version {brief(repr(found))}; this release reads {known}",
            where=str(path),
            hint="A newer release wrote it: update OptiSense Studio" if newer else COPY_AGAIN,
        )


def package_versions() -> dict[str, str]:
    """Return the installed versions of the packages on which the numbers of a study depend."""
    return {name: version_of(name) for name in LIBRARIES}
