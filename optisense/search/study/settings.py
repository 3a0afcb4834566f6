"""What a study is about, written as study.json: enough to go on with it elsewhere."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from optisense.errors import SearchError
from optisense.writing import write_text

STUDY_VERSION = 1
"""Version of the format of `STUDY_FILE`; it is raised when an older program cannot read it."""
STUDY_FILE = "study.json"

LIBRARIES = ("optisense", "cma", "numpy", "scipy", "mitsuba")
"""Packages that a study's numbers depend on."""


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
        begun: when, UTC.
        versions: of the packages that it was begun with.
    """

    design: str
    fingerprint: str
    space: dict[str, Any]
    objectives: list[str]
    names: list[str]
    method: str
    options: dict[str, Any]
    budget: int
    seed: int
    settings: dict[str, Any] = field(default_factory=dict)
    apart: bool = True
    rules: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    errors: dict[str, Any] | None = None
    samples: int = 0
    begun: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    versions: dict[str, str] = field(default_factory=lambda: package_versions())

    def to_text(self) -> str:
        """JSON."""
        return json.dumps({"study_version": STUDY_VERSION, **asdict(self)}, indent=1) + "\n"

    def fingerprint_of_all(self) -> str:
        """The same for studies that go the same way."""
        kept = {k: v for k, v in asdict(self).items() if k not in ("begun", "versions", "design")}
        return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()

    def comparable(self) -> dict[str, Any]:
        """What must be the same when a study is gone on with by the same call; the design, which
        is compared value by value, and the budget, which may grow, are not in it.
        """
        left_out = ("begun", "versions", "design", "fingerprint", "budget")
        return {key: value for key, value in asdict(self).items() if key not in left_out}

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
        if not path.is_file():
            raise SearchError(
                "there is no study here", where=str(folder), hint="Name the folder given as --out"
            )
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            found = data.pop("study_version")
            if found != STUDY_VERSION:
                newer = isinstance(found, int) and found > STUDY_VERSION
                raise SearchError(
                    f"the study has version {found!r}; this release reads {STUDY_VERSION}",
                    where=str(path),
                    hint="A newer release wrote it: update OptiSense Studio" if newer else None,
                )
            missing = {each.name for each in fields(StudySettings)} - set(data)
            if missing:
                raise SearchError(f"{', '.join(sorted(missing))} is missing", where=str(path))
            found_settings = StudySettings(**data)  # refuses unknown names
            TypeAdapter(StudySettings).validate_python(data)
            return found_settings
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(each) for each in first["loc"])
            raise SearchError(f"'{place}' is wrong: {first['msg']}", where=str(path)) from None
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise SearchError(f"the study can't be read: {error}", where=str(path)) from error


def package_versions() -> dict[str, str]:
    """The installed versions of the packages that a study's numbers depend on."""
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found
