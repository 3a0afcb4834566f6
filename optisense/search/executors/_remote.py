"""Executors for any object with the protocol of `concurrent.futures`, and for a Dask cluster."""

from __future__ import annotations

import hashlib
import re
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import SetupError
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors._remote_worker import score_trial
from optisense.search.executors.base import Runner, pickled

CONNECT_SECONDS = 10.0
"""Longest wait for the answer of a Dask scheduler, s; one nearby answers within a second."""
WORKER_SECONDS = 60.0
"""Longest wait for the first worker of a cluster, s; enough to start workers on demand."""

SUBMITTED_AHEAD = 1000
"""Number of trials that are submitted ahead to an executor, since its number of workers is not
known; it exceeds the number of workers of most clusters.
"""

ADDRESS = re.compile(r"(?:[a-z]+://)?(?:\[[^\]\s]+\]|[^:/\s\[\]]+):\d{1,5}")
"""Pattern of an address: protocol, host and port."""

HOW_TO_START = (
    "Start one with `dask scheduler` on one machine and `dask worker ADDRESS --nthreads 1` on each "
    "that scores trials"
)


class ExecutorRunner(Runner):
    """Trials on an executor that the caller has set up (MPI, a batch system, threads, ...)."""

    def __init__(self, evaluator: Evaluator, executor: Executor) -> None:
        """Take an executor; `close` does not shut it down.

        Raises:
            SearchError: the evaluator can't be pickled.
        """
        self._blob = pickled(evaluator)
        self._key = hashlib.sha256(self._blob).hexdigest()
        self._executor = executor
        self.window = SUBMITTED_AHEAD

    def submit(self, vector: NDArray[np.float64], seed: int) -> Future[Outcome]:
        """Submit a trial to the executor; see `Runner.submit`.

        Args:
            vector: point (n,).
        """
        return self._executor.submit(score_trial, self._key, self._blob, vector, seed)

    def close(self) -> None:
        """Do nothing: the executor belongs to the caller."""


class DaskRunner(Runner):
    """Trials on a Dask cluster, whose workers may join and leave while it runs.

    If a worker dies, Dask gives its trials to others. The evaluator is sent once to each worker,
    also to those that join later.
    """

    def __init__(self, evaluator: Evaluator, address: str) -> None:
        """Connect to the scheduler, and send the evaluator to the workers.

        Raises:
            SetupError: Dask is not installed, no scheduler answers, or there is no worker.
            SearchError: the evaluator can't be pickled.
        """
        blob = pickled(evaluator)
        self._key = hashlib.sha256(blob).hexdigest()
        self._plugin_name = f"optisense-{self._key[:16]}"
        self._client = _connect(address)
        try:
            _wait_for_a_worker(self._client, address)
            from optisense.search.executors._dask_plugin import EvaluatorPlugin

            plugin = EvaluatorPlugin(self._key, blob)
            self._client.register_plugin(plugin, name=self._plugin_name)
        except BaseException:
            self._client.close()
            raise
        self._executor = self._client.get_executor(pure=False, retries=0)
        self.workers = sum(self._client.nthreads().values())
        self.window = SUBMITTED_AHEAD

    def submit(self, vector: NDArray[np.float64], seed: int) -> Future[Outcome]:
        """Submit a trial to the cluster; see `Runner.submit`.

        Args:
            vector: point (n,).
        """
        given = self._executor.submit(score_trial, self._key, None, vector, seed)
        future: Future[Outcome] = Future()
        given.add_done_callback(lambda done: _settle(done, future))
        return future

    def close(self) -> None:
        """Drop what is not finished and leave the cluster."""
        self._executor.shutdown(wait=False)  # cancels what is not finished
        self._client.unregister_worker_plugin(self._plugin_name)
        self._client.close(timeout=CONNECT_SECONDS)


def _connect(address: str) -> Any:
    """Return a client of the scheduler at an address.

    Raises:
        SetupError: Dask is not installed, or no scheduler answers.
    """
    if not ADDRESS.fullmatch(address):
        raise SetupError(
            f"'{address}' is not the address of a Dask scheduler",
            where="--cluster",
            hint="Write it like tcp://192.0.2.7:8786",
        )
    try:
        import distributed
    except ImportError:
        raise SetupError(
            "Dask is not installed",
            where="--cluster",
            hint='Install it: pip install "optisense[dask]"',
        ) from None
    try:
        client: Any = distributed.Client
        return client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise SetupError(
            f"no Dask scheduler answers at {address}", where="--cluster", hint=HOW_TO_START
        ) from error


def _wait_for_a_worker(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKER_SECONDS)
    except TimeoutError:
        raise SetupError(
            f"the cluster at {address} has no workers", where="--cluster", hint=HOW_TO_START
        ) from None


def _settle(done: Future[Outcome], future: Future[Outcome]) -> None:
    """Copy the result of a future to another one; Dask's error about a trial whose workers keep
    dying becomes the failure of that trial.
    """
    if done.cancelled():
        future.cancel()
        return
    error = done.exception()
    if error is None:
        future.set_result(done.result())
    elif type(error).__name__ == "KilledWorker":
        future.set_result(Outcome({}, "the workers that scored it died repeatedly"))
    else:
        future.set_exception(error)
