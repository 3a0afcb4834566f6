"""Worker of the local pool: a separate process that reads requests from its standard input.

It is started with ``python -m optisense.search.executors._worker`` and not as a copy of the calling
program, so that programs need no guard around their main part.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import sys
import threading
from typing import Any, BinaryIO

from optisense.errors import OptiSenseError, SetupError
from optisense.search.executors.base import receive, send


def main() -> None:
    """Score trials until the pool closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # printed text must not mix with the answers
    messages: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, messages), daemon=True).start()
    evaluator = None
    try:
        blob, threads = messages.get()
        evaluator = pickle.loads(blob)
        if getattr(evaluator, "renders", True):
            from optisense.optics.backend.variant import use_threads

            use_threads(threads)
    except OptiSenseError as error:
        send(answers, ("setup-error", error))
        return
    except Exception as error:
        failure = SetupError(f"a worker can't be set up: {type(error).__name__}: {error}")
        send(answers, ("setup-error", failure))
        return
    send(answers, ("ready", os.getpid()))
    name = str(os.getpid())
    while True:
        vector, seed = messages.get()
        try:
            outcome = evaluator(vector, seed)
            object.__setattr__(outcome, "worker", name)
            send(answers, ("done", outcome))
        except OSError:
            return  # the pool has closed the pipe
        except Exception as error:
            told = f"{type(error).__name__}: {error}"  # not every error can be pickled
            send(
                answers,
                ("error", error if isinstance(error, OptiSenseError) else RuntimeError(told)),
            )


def _listen(stream: BinaryIO, messages: queue.SimpleQueue[Any]) -> None:
    """Pass messages on, and end this process, even amid a trial, when the pool closes the pipe."""
    try:
        while True:
            messages.put(receive(stream))
    except (EOFError, OSError):
        os._exit(0)


if __name__ == "__main__":
    main()
