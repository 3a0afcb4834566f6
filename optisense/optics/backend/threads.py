"""The number of threads that the renderer may use in this process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from optisense.optics.backend.variant import import_renderer, select_variant


def use_threads(count: int) -> None:
    """Set the number of threads that Dr.Jit uses, for processes that share a machine.

    Raises:
        SetupError: the renderer can't run on this machine.
    """
    select_variant("auto")  # libLLVM is checked before Dr.Jit is imported
    import_renderer("drjit").set_thread_count(count)


@contextmanager
def threads_for_exr_files() -> Iterator[None]:
    """Give Dr.Jit a second thread, if it has only one, while Mitsuba writes or reads EXR files.

    Mitsuba compresses and expands them in tasks for Dr.Jit's threads and waits for these without
    working on them itself. On one processor Dr.Jit has no other thread than the waiting one.
    """
    dr = import_renderer("drjit")
    count = dr.thread_count()
    if count < 2:
        dr.set_thread_count(2)
    try:
        yield
    finally:
        if count < 2:
            dr.set_thread_count(count)
