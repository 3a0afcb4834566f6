"""The worker in another process or machine: it keeps an evaluator and works out trials."""

from __future__ import annotations

import os
import pickle
import socket
import threading

import numpy as np
from numpy.typing import NDArray

from optisense.errors import SetupError
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome

_evaluators: dict[str, Evaluator] = {}
_blobs: dict[str, bytes] = {}
_one_at_a_time = threading.Lock()
"""An evaluator keeps one model and serves one trial at a time, whatever threads a worker has."""


def work_out(key: str, blob: bytes | None, vector: NDArray[np.float64], seed: int) -> Outcome:
    """Work out a trial in whatever process this is called.

    Args:
        key: of the evaluator.
        blob: the evaluator, or None where it came before.
        vector, seed: the trial.
    """
    with _one_at_a_time:
        if key not in _evaluators:
            known = blob if blob is not None else _blobs.get(key)
            if known is None:
                raise SetupError("a worker has not been given what to work out")
            evaluator = pickle.loads(known)
            if getattr(evaluator, "renders", True):
                from optisense.optics.backend.threads import use_threads

                use_threads(1)
            _evaluators.clear()
            _evaluators[key] = evaluator
        outcome = _evaluators[key](vector, seed)
    object.__setattr__(outcome, "worker", _own_name())
    return outcome


def remember(key: str, blob: bytes) -> None:
    """Keep an evaluator for `work_out` in this process."""
    _blobs[key] = blob


def forget(key: str) -> None:
    """Drop an evaluator again."""
    _blobs.pop(key, None)
    _evaluators.pop(key, None)


def _own_name() -> str:
    """The machine and the process that work a trial out."""
    return f"{socket.gethostname()}:{os.getpid()}"
