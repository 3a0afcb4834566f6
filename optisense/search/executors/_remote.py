"""Executors for any object with the protocol of `concurrent.futures`, and for a Dask cluster, with
the functions that their workers call: these keep an evaluator and score trials.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import re
import socket
import threading
from concurrent.futures import Executor, Future
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError, SetupError
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome
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

_evaluators: dict[str, Evaluator] = {}
_blobs: dict[str, bytes] = {}
_one_at_a_time = threading.Lock()
"""Lock that serves one trial at a time, since an evaluator keeps one model for all threads."""


class ExecutorRunner(Runner):
    """Trials on an executor that the caller has set up (MPI, a batch system, threads, ...)."""

    def __init__(self, evaluator: Evaluator, executor: Executor) -> None:
        """Take an executor; `close` does not shut it down."""
        self._blob = pickled(evaluator)
        self._key = hashlib.sha256(self._blob).hexdigest()
        self._executor = executor
        self.window = SUBMITTED_AHEAD

    def submit(self, vector: NDArray[np.float64], seed: int) -> Future[Outcome]:
        """Submit the trial of a point (n,) to the executor; see `Runner.submit`."""
        return self._executor.submit(score_trial, self._key, self._blob, vector, seed)

    def close(self) -> None:
        """Do nothing: the executor belongs to the caller."""


class DaskRunner(Runner):
    """Trials on a Dask cluster, whose workers may join and leave while it runs.

    If a worker dies, Dask gives its trials to others. The evaluator is sent once to each worker,
    also to those that join later.
    """

    def __init__(self, evaluator: Evaluator, address: str) -> None:
        """Connect to the scheduler, and send the evaluator to the workers; SetupError if Dask is
        not installed, no scheduler answers, or there is no worker.
        """
        blob = pickled(evaluator)
        self._key = hashlib.sha256(blob).hexdigest()
        self._plugin_name = f"optisense-{self._key[:16]}"
        self._client = _connect(address)
        try:
            _wait_for_a_worker(self._client, address)
            from optisense.search.executors._dask_plugin import PreparingPlugin

            plugin = PreparingPlugin(
                partial(store_evaluator, self._key, blob), partial(drop_evaluator, self._key)
            )
            self._client.register_plugin(plugin, name=self._plugin_name)
        except BaseException:
            self._client.close()
            raise
        self._executor = self._client.get_executor(pure=False, retries=0)
        self.window = SUBMITTED_AHEAD

    def submit(self, vector: NDArray[np.float64], seed: int) -> Future[Outcome]:
        """Submit the trial of a point (n,) to the cluster; see `Runner.submit`."""
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
    """Return a client of the scheduler at an address."""
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
    """Copy a result to another future; a trial whose workers keep dying fails."""
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


def score_trial(key: str, blob: bytes | None, vector: NDArray[np.float64], seed: int) -> Outcome:
    """Score a point (n,) in the process where this is called, by the pickled evaluator, which is
    None if it was sent before by `store_evaluator`.
    """
    with _one_at_a_time:
        if key not in _evaluators:
            known = blob if blob is not None else _blobs.get(key)
            if known is None:
                raise SetupError(
                    "a worker has no evaluator: the study has ended, or the worker has restarted"
                )
            evaluator = _unpacked(known)
            if getattr(evaluator, "renders", True):
                from optisense.optics.backend.variant import use_threads

                use_threads(1)
            _evaluators.clear()
            _evaluators[key] = evaluator
        outcome = _evaluators[key](vector, seed)
    object.__setattr__(outcome, "worker", _own_name())
    return outcome


def _unpacked(blob: bytes) -> Evaluator:
    try:
        evaluator: Evaluator = pickle.loads(blob)
    except OptiSenseError:
        raise
    except Exception as error:
        raise SetupError(
            f"the worker {_own_name()} can't read the search: {type(error).__name__}: {error}",
            hint="Install the same packages on the machines of all workers, with those of own "
            "kinds and objectives",
        ) from error
    return evaluator


def store_evaluator(key: str, blob: bytes) -> None:
    """Keep a pickled evaluator for `score_trial` in this process."""
    _blobs[key] = blob


def drop_evaluator(key: str) -> None:
    """Drop the evaluator stored under a key."""
    _blobs.pop(key, None)
    _evaluators.pop(key, None)


def _own_name() -> str:
    """Return the names of the machine and the process that score a trial."""
    return f"{socket.gethostname()}:{os.getpid()}"
