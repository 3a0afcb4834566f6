"""Handling of Ctrl-C while Dr.Jit records a loop or a branch."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_R = TypeVar("_R")


def reraise_interrupts(work: Callable[_P, _R]) -> Callable[_P, _R]:
    """Decorate a function that runs loops of Dr.Jit.

    Dr.Jit turns any exception that is raised while it records a loop or a branch into a
    RuntimeError, so that Ctrl-C at such a moment would look like a defect. The decorator raises
    KeyboardInterrupt instead.
    """

    @functools.wraps(work)
    def run(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        try:
            return work(*args, **kwargs)
        except RuntimeError as error:
            reason: BaseException | None = error
            while reason is not None:
                if isinstance(reason, KeyboardInterrupt):
                    raise KeyboardInterrupt from None
                reason = reason.__cause__
            raise

    return run
