"""Worker functions for other processes and machines: they keep an evaluator and score trials."""

from __future__ import annotations

import os
import pickle
import socket
import threading

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError, SetupError
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome

_evaluators: dict[str, Evaluator] = {}
_blobs: dict[str, bytes] = {}
MOST_EVALUATORS = 64
"""Largest number of pickled evaluators that a worker keeps. A search that ends removes its own; one
whose process was killed does not.
"""
_one_at_a_time = threading.Lock()
"""Lock that serves one trial at a time, since an evaluator keeps one model for all threads."""


def score_trial(key: str, blob: bytes | None, vector: NDArray[np.float64], seed: int) -> Outcome:
    """Score a trial in the process where this is called.

    Args:
        blob: the pickled evaluator, or None if it was sent before by `store_evaluator`.
        vector, seed: point of the trial, (n,), and its seed.

    Raises:
        SetupError: the evaluator is not known or can't be unpacked here.
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
    """Keep an evaluator for `score_trial` in this process, and drop the oldest of too many."""
    _blobs[key] = blob
    while len(_blobs) > MOST_EVALUATORS:
        del _blobs[next(iter(_blobs))]


def drop_evaluator(key: str) -> None:
    """Drop the evaluator stored under a key."""
    _blobs.pop(key, None)
    _evaluators.pop(key, None)


def _own_name() -> str:
    """Return the names of the machine and the process that score a trial."""
    return f"{socket.gethostname()}:{os.getpid()}"
