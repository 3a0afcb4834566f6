"""Search for a better design in one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from optisense.design import SensorDesign
from optisense.design.sensor_design import refuse_no_design
from optisense.errors import FolderInUseError, OptiSenseError, SearchError
from optisense.search.evaluation.evaluator import Evaluator, Goal, as_goals
from optisense.search.executors import Runner, Workers, create_runner
from optisense.search.space.manufacturing import ManufacturingErrors, ToleranceDistribution
from optisense.search.space.search_space import SearchSpace
from optisense.search.study.loop import StudyRun
from optisense.search.study.plan import Plan
from optisense.search.study.progress import SearchProgressCallback, SearchResult
from optisense.search.study.study import Study
from optisense.text import argument


def search(
    design: SensorDesign,
    space: SearchSpace | Mapping[str, object],
    objective: Goal | Sequence[Goal],
    *,
    method: str = "cma-es",
    budget: int | None = None,
    seed: int = 0,
    workers: Workers = 1,
    out: str | Path | None = None,
    resume: bool = False,
    options: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    errors: ManufacturingErrors | Mapping[str, ToleranceDistribution | float] | None = None,
    samples: int | None = None,
    require: str | Sequence[str] = (),
    coarse_first: bool = False,
    apart: bool = True,
    variant: str = "auto",
    progress: SearchProgressCallback | None = None,
) -> SearchResult:
    """Search a space for the design with the highest score.

    The result's `.best` is a trial, and `.best.design` the better design. Every trial is scored
    with the same seed; before the best one is named it is scored again with fresh seeds. Ctrl-C
    ends the search early, and the result holds what was finished.

    Args:
        design: design that the search starts from.
        space: parameters that may change, and their bounds.
        objective: what to maximise: a name, arithmetic such as "aoap + 0.5*coverage", an
            `Objective`, or a function of a design that returns a number. Of several, the first is
            maximised and the others are reported, or, with the method "pareto", the best trade-offs
            between all are sought.
        method: "cma-es", "grid", "random", "types", "pareto", ... (see docs/search.md).
        budget: number of trials; the method's default if None.
        seed: seed of the method and of every trial.
        workers: number of processes on this machine (1 scores the trials in this process), the
            address of a Dask scheduler, or any executor with the protocol of `concurrent.futures`.
        out: folder of the study, which can then be resumed and reported.
        resume: continue the study in `out`.
        options: options of the method.
        settings: settings of the objectives (see `optisense.evaluate`).
        errors: manufacturing errors: if given, P10 over manufactured sensors is maximised instead
            of the plain score.
        samples: number of manufactured sensors per trial; 8 if None. It needs `errors`.
        require: conditions that the best design must meet, such as "coverage >= 0.55".
        coarse_first: whether trials get coarse scores (fewer photons and pixels, all presses in one
            image), and only the promising ones full scores.
        apart: whether designs are forbidden whose parts cut through one another or leave the parts
            on which they rest.
        variant: variant of the renderer: "auto", "llvm" or "cuda".
        progress: function that is called a few times a second.

    Raises:
        SearchError: an argument is out of its range, all trials fail, or a study can't be resumed.
        DesignError: a path names nothing in the design.
        ObjectiveError: an objective is unknown.
        SetupError: the renderer or the cluster can't be reached.
    """
    refuse_no_design(design)
    goals = as_goals(objective)
    named = space if isinstance(space, SearchSpace) else SearchSpace(space)
    if errors is not None and not isinstance(errors, ManufacturingErrors):
        errors = ManufacturingErrors(errors)
    plan = Plan(
        space=named,
        goals=goals,
        method=method,
        options=options,
        budget=budget,
        seed=seed,
        settings=settings,
        apart=apart,
        errors=errors,
        samples=samples,
        requirements=[require] if isinstance(require, str) else list(require),
        coarse_first=coarse_first,
    )
    if resume:
        if out is None:
            raise SearchError("resume=True needs the folder of the study", hint="Give out=FOLDER")
        study = Study.open(out, design, goals, named.constraints)
        study.expect(plan.settings_for(design).comparable())
        study.trust()  # the caller names the same files
    else:
        study = Study.create(out, design, plan)
    return run_study(
        study,
        workers=workers,
        limit=plan.budget if resume else None,
        variant=variant,
        progress=progress,
    )


def run_study(
    study: Study,
    *,
    workers: Workers = 1,
    limit: int | None = None,
    variant: str = "auto",
    progress: SearchProgressCallback | None = None,
    on_wait: Callable[[], None] | None = None,
) -> SearchResult:
    """Run a study, or resume one.

    Args:
        study: new study, or one that was opened.
        workers: see `search`.
        limit: total number of trials; the largest that was asked for so far if None.
        variant: variant of the renderer, see `search`.
        progress: function that is called a few times a second.
        on_wait: function that is called when Ctrl-C waits for a trial in this process to finish.

    Raises:
        OptiSenseError: see `search`.
    """

    def make_runner(evaluator: Evaluator) -> Runner:
        return create_runner(evaluator, workers, on_wait)

    try:
        return StudyRun(study, make_runner, progress, limit, variant).run()
    except FolderInUseError:
        raise
    except OptiSenseError as error:
        error.hint = _hint_after(error, study)
        raise
    finally:
        study.unlock()


def _hint_after(error: OptiSenseError, study: Study) -> str | None:
    """Return a hint for an error of a run, which also tells the state of the study. A new study in
    which nothing was scored is removed, so that the same call can be repeated.
    """
    if study.folder is None or (isinstance(error, SearchError) and error.hint):
        return error.hint
    trials = study.trials
    if trials or not study.is_new:
        kept = f"{len(trials)} finished trial{'' if len(trials) == 1 else 's'}"
        named = argument(study.folder)
        advice = f"The study keeps its {kept}: continue with --resume --out {named}"
    else:
        study.discard()
        advice = "No trial was finished, so the study was removed"
        if not error.hint:
            advice += ": run the same command again"
    if not error.hint:
        return advice
    return f"{error.hint}{'' if error.hint.endswith('?') else '.'} {advice}"
