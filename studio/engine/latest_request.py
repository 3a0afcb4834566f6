"""A request to the engine that follows the changes of a scene's design."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import bpy

from ..core.engine import EngineError, Request
from ..scene.subject import Subject
from . import design_transfer, session


class LatestRequest:
    """A request that is sent again after each change of the design.

    One request is open at a time; the next one has all changes that were made meanwhile.

    Attributes:
        open: the request that was sent last; None before the first one.
    """

    def __init__(self, rest: float = 0.0) -> None:
        """Create the request, which is sent after the first change.

        Args:
            rest: time without a change after which the request is sent, s.
        """
        self.open: Request | None = None
        self._rest = rest
        self._when: float | None = None

    @property
    def is_wanted(self) -> bool:
        """Whether there was a change since the last request."""
        return self._when is not None

    @property
    def is_due(self) -> bool:
        """Whether the request can be sent now."""
        return (
            self._when is not None
            and time.monotonic() >= self._when
            and (self.open is None or self.open.done)
            and not session.is_busy()
        )

    def want(self) -> None:
        """Note a change."""
        self._when = time.monotonic() + self._rest

    def drop(self) -> None:
        """Send no further request until the next change."""
        self._when = None

    def leave(self) -> None:
        """Drop the request, and ignore the answer of the open one."""
        self.drop()
        if self.open is not None:
            self.open.ignore()
        self.open = None

    def send(
        self,
        what: str,
        take: Callable[[dict[str, Any], bpy.types.Scene], None],
        refused: Callable[[EngineError, bpy.types.Scene], None] = lambda error, scene: None,
        **fields: Any,
    ) -> None:
        """Send the request with the scene's design.

        Args:
            take: function that is called with the answer and the scene of the sensor, unless that
                is gone or has another sensor by then.
            refused: function that is called likewise with an error; none is shown by default, as
                the buttons show those of the design.
            fields: further fields of the request.
        """
        self.drop()
        try:
            design = design_transfer.design(bpy.context.scene)
        except EngineError as error:
            refused(error, bpy.context.scene)
            return
        subject = Subject(bpy.context.scene)
        self.open = session.ask(
            what, subject.taking(take), subject.taking(refused), design=design, **fields
        )
