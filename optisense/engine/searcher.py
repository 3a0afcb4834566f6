"""``python -m optisense.engine.searcher STUDY`` runs a study for an engine.

A line "stop" on standard input ends it after the trials in progress, and a second one at once; so
does the end of the input, unless ``--go-on`` is given. The result is one line of JSON on standard
output.
"""

from __future__ import annotations

import _thread
import argparse
import contextlib
import json
import os
import signal
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import Any

from optisense.engine.failures import as_data
from optisense.engine.protocol import Channel
from optisense.engine.search_process import PROCESS_FILE
from optisense.errors import OptiSenseError

GRACE_PERIOD = 20.0
"""Time after the end of the engine until the search drops its trial, s; after the same time again
the process exits. Most trials take a few seconds and are finished before.
"""

NICENESS = 5
"""Niceness of the process: a search runs for hours, and drafts in the front end go first."""


def main() -> None:
    """Run the study that the command line names, and end the process."""
    parser = argparse.ArgumentParser()
    parser.add_argument("study", type=Path)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--budget", type=int)
    parser.add_argument("--go-on", action="store_true")
    given = parser.parse_args()
    # The engine stops a search by this signal, whatever handler the starting shell has set.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    channel = Channel.of_standard_output()
    working = threading.Event()
    threading.Thread(target=_listen, args=(given.go_on, working), daemon=True).start()
    with contextlib.suppress(OSError, AttributeError):
        os.nice(NICENESS)
    channel.send(_run(given.study, given.workers, given.budget, working))
    channel.close()
    sys.stderr.flush()
    os._exit(0)


def _run(
    folder: Path, workers: int, budget: int | None, working: threading.Event
) -> dict[str, Any]:
    """Run a study, and return its result, or the error, as data. Interrupts are for while `working`
    is set.
    """
    mark = folder / PROCESS_FILE
    try:
        working.set()
        from optisense.search import Study, run_study

        study = Study.open(folder)
        study.lock()  # before the mark, which names the process that has the study
        mark.write_text(json.dumps({"pid": os.getpid()}), encoding="utf-8")
        try:
            return run_study(study, workers=workers, limit=budget).to_dict()
        finally:
            with contextlib.suppress(OSError):
                mark.unlink(missing_ok=True)
            study.close()
    except KeyboardInterrupt:
        return {"interrupted": True, "ended": "interrupted", "notes": [], "best": None}
    except OptiSenseError as error:
        return {"error": as_data(error)}
    except Exception as error:
        traceback.print_exc()
        return {"error": as_data(error)}
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # it ends anyway


def _listen(go_on: bool, working: threading.Event) -> None:
    """Turn lines on standard input into Ctrl-C, once there is work to interrupt."""
    working.wait()
    asked = False
    for line in sys.stdin.buffer:
        if line.strip() == b"stop":
            asked = True
            _thread.interrupt_main()
    if go_on:
        return
    if not asked:
        _thread.interrupt_main()
    time.sleep(GRACE_PERIOD)
    _thread.interrupt_main()
    time.sleep(GRACE_PERIOD)
    os._exit(1)


if __name__ == "__main__":
    main()
