"""The number of threads that the renderer may use in this process."""

from __future__ import annotations

from optisense.optics.backend.variant import import_renderer, select_variant


def use_threads(count: int) -> None:
    """Set the number of threads that Dr.Jit uses, for processes that share a machine.

    Raises:
        SetupError: the renderer can't run on this machine.
    """
    select_variant("auto")  # libLLVM is checked before Dr.Jit is imported
    import_renderer("drjit").set_thread_count(count)
