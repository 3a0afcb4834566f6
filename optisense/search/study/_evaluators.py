"""Evaluators of a study: the one of its trials, and the one of full scores."""

from __future__ import annotations

from optisense.errors import SearchError
from optisense.search.evaluation.coarse import CoarseEvaluator
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.evaluation.relit import RelitEvaluator, can_relight
from optisense.search.methods import Method
from optisense.search.space.manufacturing import ManufacturingErrors
from optisense.search.study.study import Study


def evaluators(study: Study, usual: DesignEvaluator, method: Method) -> tuple[Evaluator, Evaluator]:
    """Return the evaluator of a study's trials, and that of full scores, which is the same unless
    trials have coarse scores. The method may replace `usual`, the evaluator of plain scores.
    """
    own = method.evaluator(usual)
    if own is usual and study.settings.errors is None and can_relight(usual):
        relit = RelitEvaluator(usual)
        return relit, relit
    if study.settings.errors is not None and own is not usual:
        raise SearchError(
            f"{study.settings.method} can't search with manufacturing errors: it scores in a way "
            "of its own",
            hint="Use cma-es, grid or random; or search without errors and look at the winner with "
            "`optisense tolerance`",
        )
    full = _with_errors(study, usual) if own is usual else own
    return (
        _with_errors(study, CoarseEvaluator(usual)) if study.settings.coarse_first else full
    ), full


def _with_errors(study: Study, usual: DesignEvaluator) -> Evaluator:
    """Return an evaluator that also applies the manufacturing errors of a study, if it has any."""
    settings = study.settings
    if settings.errors is None:
        return usual
    from optisense.search.evaluation.robust import RobustEvaluator

    errors = ManufacturingErrors.from_plain(settings.errors)
    return RobustEvaluator(usual, errors, settings.seed, settings.samples)
