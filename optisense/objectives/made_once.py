"""Values that several objectives need, each made on first use."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar, cast

from optisense.errors import OptiSenseError

_T = TypeVar("_T")


class MadeOnce:
    """What keeps the values that it has made.

    Attributes:
        seconds: wall time that each value took, by its name, without that of others inside it.
    """

    def __init__(self) -> None:
        """Nothing is made yet."""
        self.seconds: dict[str, float] = {}
        self._made: dict[str, Any] = {}

    def shared(self, name: str, make: Callable[[], _T]) -> _T:
        """A value that is made on first use; an error is kept too, and raised again.

        Args:
            name: of it, with the settings that it depends on.
            make: makes it.
        """
        if name not in self._made:
            began = time.perf_counter()
            inner = sum(self.seconds.values())
            try:
                self._made[name] = make()
            except OptiSenseError as error:
                self._made[name] = error
            spent_inside = sum(self.seconds.values()) - inner
            self.seconds[name] = round(time.perf_counter() - began - spent_inside, 4)
        made = self._made[name]
        if isinstance(made, OptiSenseError):
            raise made
        return cast("_T", made)
