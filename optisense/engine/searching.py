"""Requests about searches: each runs in a process of its own and keeps its trials in a folder."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field

from optisense.commands.scoring import SearchOptions
from optisense.engine.designing import bent_shapes
from optisense.engine.failures import ProtocolError
from optisense.engine.following import Following, curve_row, trial_row
from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.rendering import DesignFields, design_of
from optisense.engine.requests import Lane, handles, listed
from optisense.engine.scoring import own_objectives
from optisense.engine.search_process import SearchProcess, is_running, stop_other
from optisense.engine.session import Session
from optisense.sensors import save_design

if TYPE_CHECKING:
    from optisense.search import Study


class Space(DesignFields):
    """Fields of the request "space"; see docs/engine.md."""

    vary: list[str] = Field(min_length=1)


class Search(Space, SearchOptions):
    """Fields of the request "search"; see docs/engine.md."""

    study: str
    objectives: list[str] = Field(min_length=1)
    workers: int = Field(default=1, ge=1)
    go_on: bool = False


class Advise(Space):
    """Fields of the request "advise"; see docs/engine.md."""

    objectives: list[str] = Field(min_length=1)
    method: str = "cma-es"
    budget: int | None = Field(default=None, ge=1)


class StudyFields(Fields):
    """Fields of a request about a study."""

    study: str


class Resume(StudyFields):
    """Fields of the request "resume"; see docs/engine.md."""

    workers: int = Field(default=1, ge=1)
    budget: int | None = Field(default=None, ge=1)
    go_on: bool = False


class TrialFields(StudyFields):
    """Fields of the request "trial"; see docs/engine.md."""

    trial: int | str = "best"


class Apply(TrialFields):
    """Fields of the request "apply"; see docs/engine.md."""

    to: str


@handles("methods", Fields, Lane.QUICK)
def methods(session: Session, fields: Fields, job: Job) -> dict[str, Any]:
    """Return the search methods with their summaries."""
    from optisense.search.methods import METHODS

    rows, failed = listed(METHODS, lambda name, each: {"name": name, "summary": each.summary})
    return {"methods": rows, "unavailable": failed}


@handles("space", Space, Lane.QUICK)
def space(session: Session, fields: Space, job: Job) -> dict[str, Any]:
    """Return the parameters of a search for a design."""
    from optisense.search import SearchSpace
    from optisense.search.space.text import parse_space

    design = design_of(session, fields, job)
    bound = SearchSpace(parse_space(fields.vary)).bind(design)
    columns = zip(bound.parameters, bound.lower, bound.upper, bound.start, strict=True)
    rows = []
    for parameter, lower, upper, start in columns:
        labels = getattr(parameter.kind, "labels", None)
        options = None if labels is None else list(labels)
        row = {"name": parameter.name, "lower": lower, "upper": upper, "start": start}
        rows.append(row | {"options": options})
    return {"parameters": rows}


@handles("advise", Advise, Lane.QUICK)
def advise(session: Session, fields: Advise, job: Job) -> dict[str, Any]:
    """Return whether a search can succeed, and its expected duration, before it begins."""
    from optisense.search import SearchSpace
    from optisense.search.methods import find
    from optisense.search.space.text import parse_space
    from optisense.search.study.advice import LIGHT_OBJECTIVES, advice, usual_seconds

    design = design_of(session, fields, job)
    space = parse_space(fields.vary)
    bound = SearchSpace(space).bind(design)
    budget = fields.budget or find(fields.method).default_budget(bound)
    against = advice(space, fields.objectives)
    return {
        "advice": against,
        "fitting": [] if against is None else list(LIGHT_OBJECTIVES),
        "trials": budget,
        "seconds": round(usual_seconds(design, fields.objectives, budget), 1),
    }


@handles("search", Search, Lane.OWN)
def search(session: Session, fields: Search, job: Job) -> dict[str, Any]:
    """Begin a study in a process of its own, and follow it to its end."""
    files = session.files(fields, job.id)
    folder = _absolute(fields.study)
    with session.priority_gate:
        from optisense.search import Study

        design = design_of(session, fields, job)
        session.designs.require_valid(design)
        job.check()
        with own_objectives():
            Study.create(folder, design, fields.plan()).close()
        child = SearchProcess(folder, fields.workers, None, fields.go_on)
    return Following(folder, job, files, child).result()


@handles("resume", Resume, Lane.OWN)
def resume(session: Session, fields: Resume, job: Job) -> dict[str, Any]:
    """Resume a study and follow it to its end."""
    files = session.files(fields, job.id)
    folder = _absolute(fields.study)
    with session.priority_gate, _opened(folder) as study:
        study.lock()  # errors in it are reported before a process is started
    child = SearchProcess(folder, fields.workers, fields.budget, fields.go_on)
    return Following(folder, job, files, child, fields.budget).result()


@handles("watch", StudyFields, Lane.OWN)
def watch(session: Session, fields: StudyFields, job: Job) -> dict[str, Any]:
    """Follow a study that another process runs."""
    files = session.files(fields, job.id)
    return Following(_absolute(fields.study), job, files, None).result()


@handles("stop", StudyFields, Lane.QUICK)
def stop(session: Session, fields: StudyFields, job: Job) -> dict[str, Any]:
    """Stop a search of any engine on this machine."""
    return {"stopped": stop_other(_absolute(fields.study))}


@handles("study", StudyFields, Lane.QUICK)
def about_study(session: Session, fields: StudyFields, job: Job) -> dict[str, Any]:
    """Return all data of a study except its designs."""
    folder = _absolute(fields.study)
    with _opened(folder) as study:
        trials = study.trials
        best = study.best
        settings = study.settings
        return {
            "design": settings.design,
            "objectives": settings.names,
            "requirements": settings.requirements,
            "method": settings.method,
            "budget": study.budget,
            "seed": settings.seed,
            "running": is_running(folder),
            "ended": study.store.fact("ended"),
            "parameters": study.space.names,
            "best": None if best is None else best.number,
            "curve": [curve_row(trial) for trial in trials],
        }


@handles("trial", TrialFields, Lane.QUICK)
def trial(session: Session, fields: TrialFields, job: Job) -> dict[str, Any]:
    """Return one trial as a design."""
    from optisense.search.study.applied import design_of as design_of_trial

    files = session.files(fields, job.id)
    with _opened(_absolute(fields.study)) as study:
        chosen = study.trial(fields.trial)
        design = design_of_trial(study, chosen)
        return {
            **trial_row(study, chosen),
            "fresh_scores": {name: chosen.fresh_score(name) for name in chosen.scores},
            "data": design.model_dump(mode="json"),
            "folder": str(_absolute(fields.study) / "design"),
            "shapes": bent_shapes(design, files, study.space.design),
        }


@handles("apply", Apply, Lane.QUICK)
def apply(session: Session, fields: Apply, job: Job) -> dict[str, Any]:
    """Write a trial as a design folder."""
    from optisense.search.study.applied import design_of as design_of_trial

    folder = Path(fields.to)
    with _opened(_absolute(fields.study)) as study:
        chosen = study.trial(fields.trial)
        save_design(design_of_trial(study, chosen), folder, new=True)
        return {"folder": str(folder), "number": chosen.number}


def _opened(folder: Path) -> closing[Study]:
    from optisense.search import Study

    return closing(Study.open(folder))


def _absolute(folder: str) -> Path:
    path = Path(folder)
    if not path.is_absolute():
        raise ProtocolError(
            f"the path of the study '{folder}' is not absolute",
            where="study",
            hint="Give the absolute path of its folder",
        )
    return path
