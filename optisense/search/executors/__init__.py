"""Executors of trials: this process, a pool of processes, any executor, or a Dask cluster."""

from collections.abc import Callable
from concurrent.futures import Executor
from numbers import Integral
from typing import cast

from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.executors._remote import DaskRunner, ExecutorRunner
from optisense.search.executors.base import Runner, SerialRunner
from optisense.search.executors.pool import ProcessPool, processors

__all__ = [
    "DaskRunner",
    "ExecutorRunner",
    "ProcessPool",
    "Runner",
    "SerialRunner",
    "Workers",
    "create_runner",
    "processors",
]

Workers = int | str | Executor
"""Number of processes on this machine (1 is this process), address of a Dask scheduler, or any
executor with the protocol of `concurrent.futures`."""


def create_runner(
    evaluator: Evaluator, workers: Workers, on_wait: Callable[[], None] | None = None
) -> Runner:
    """Return the executor that scores trials with an evaluator.

    Args:
        on_wait: function that is called when Ctrl-C waits for a trial in this process to finish.

    Raises:
        SetupError: the cluster can't be reached.
        SearchError: the evaluator can't be pickled.
    """
    if isinstance(workers, str):
        return DaskRunner(evaluator, workers)
    if not isinstance(workers, Integral):
        return ExecutorRunner(evaluator, cast("Executor", workers))
    count = int(workers)
    return SerialRunner(evaluator, on_wait) if count == 1 else ProcessPool(evaluator, count)
