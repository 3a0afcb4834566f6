"""What a study is about, written as study.json: enough to go on with it elsewhere."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from optisense.errors import SearchError
from optisense.text import brief
from optisense.untrusted_files import COPY_AGAIN, first_problem, is_file, read_json
from optisense.writing import write_text

STUDY_VERSION = 1
"""Version of the format of `STUDY_FILE`; it is raised when an older program cannot read it."""
STUDY_FILE = "study.json"

LIBRARIES = ("optisense", "cma", "numpy", "scipy", "mitsuba")
"""Packages that a study's numbers depend on."""

MOST_NAMES = 100
"""Objectives, or rules, of a study; a search by more than a few finds no front."""

LATER = ("requirements",)
"""Settings that studies of earlier releases do not have. They count as their defaults, and one with
its default is left out where settings are compared, so that such studies go on as they are."""

Names = Annotated[list[str], Field(max_length=MOST_NAMES)]
Whole = Annotated[int, Field(ge=0, le=2**53)]


@dataclass(frozen=True)
class StudySettings:
    """Everything that decides how a study goes.

    Attributes:
        design: the design's name.
        fingerprint: of the design (see `optisense.design.difference`).
        space: as of `SearchSpace.to_plain`.
        objectives: how to find them: names, FILE.py:FUNCTION, or "function:NAME" for functions
            that only the program which began the study knows.
        names: what their scores are called, in the same order.
        method: name.
        options: of the method.
        budget: trials that the method plans for.
        seed: of the method and of all trials.
        settings: of the objectives.
        apart: whether parts must not cut through one another, nor leave those on which they rest.
        rules: constraints as FILE.py:FUNCTION, or "function:NAME".
        files: the SHA-256 of each user's file that objectives and rules come from, by path.
        errors: of making, where P10 is searched; as of `ManufacturingErrors.to_plain`.
        samples: manufactured sensors a trial.
        requirements: conditions that the best trial must meet.
        begun: when, UTC.
        versions: of the packages that it was begun with.

    As it is read from a file, its values must have these types, and what is not told here is
    refused; parameters, errors of making and options are checked by what they are for.
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
    begun: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    versions: dict[str, str] = field(default_factory=lambda: package_versions())

    def to_text(self) -> str:
        """JSON."""
        return json.dumps({"study_version": STUDY_VERSION, **asdict(self)}, indent=1) + "\n"

    def fingerprint_of_all(self) -> str:
        """The same for studies that go the same way."""
        kept = self._without("begun", "versions", "design")
        return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()

    def comparable(self) -> dict[str, Any]:
        """What must be the same when a study is gone on with by the same call; the design, which
        is compared value by value, and the budget, which may grow, are not in it.
        """
        return self._without("begun", "versions", "design", "fingerprint", "budget")

    def _without(self, *names: str) -> dict[str, Any]:
        """All settings but these, and but later ones that are not used."""
        return {
            key: value
            for key, value in asdict(self).items()
            if key not in names and not (key in LATER and not value)
        }

    def save(self, folder: Path) -> None:
        """Write study.json, whole.

        Raises:
            OutputError: it can't be written.
        """
        write_text(folder / STUDY_FILE, self.to_text(), "the study")

    @staticmethod
    def load(folder: Path) -> StudySettings:
        """Read study.json.

        Raises:
            SearchError: there is no study, it can't be read, or a newer release wrote it.
        """
        path = folder / STUDY_FILE
        if not is_file(path):
            raise SearchError(
                "there is no study here", where=str(folder), hint="Name the folder given as --out"
            )
        data = read_json(path, SearchError)
        if not isinstance(data, dict):
            raise SearchError("the study is no JSON object", where=str(path), hint=COPY_AGAIN)
        found = data.pop("study_version", None)
        if found != STUDY_VERSION or isinstance(found, bool):
            newer = isinstance(found, int) and found > STUDY_VERSION
            raise SearchError(
                f"the study has version {brief(repr(found))}; this release reads {STUDY_VERSION}",
                where=str(path),
                hint="A newer release wrote it: update OptiSense Studio" if newer else COPY_AGAIN,
            )
        missing = {name for name in _fields() if name not in data} - set(LATER)
        if missing:
            names = ", ".join(sorted(missing))
            raise SearchError(f"{names} is missing", where=str(path), hint=COPY_AGAIN)
        try:
            settings = _schema().validate_json(json.dumps(data))  # the values as JSON has them
        except ValidationError as error:
            raise SearchError(first_problem(error), where=str(path), hint=COPY_AGAIN) from None
        if len(set(settings.names)) != len(settings.objectives):
            raise SearchError(
                f"'names' has {len(set(settings.names))} names for {len(settings.objectives)} "
                "objectives",
                where=str(path),
                hint=COPY_AGAIN,
            )
        return settings


@cache
def _schema() -> TypeAdapter[StudySettings]:
    """What study.json must hold besides its version."""
    return TypeAdapter(StudySettings)


def _fields() -> list[str]:
    return [each.name for each in fields(StudySettings)]


def package_versions() -> dict[str, str]:
    """The installed versions of the packages that a study's numbers depend on."""
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found
