"""Waiting for the engine, as Blender's timer does in a window."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from studio.engine import session


def until(done: Callable[[], Any], *, problem_allowed: bool = False) -> None:
    """Let the timer run until something is so.

    There is no limit: pytest ends a test that hangs (`faulthandler_timeout`).

    Args:
        done: asked before each tick.
        problem_allowed: whether the panels may say that something is wrong meanwhile.
    """
    while not done():
        pause = session._tick()
        assert problem_allowed or not session.state().problem, session.state().problem
        time.sleep(pause or 0.0)
