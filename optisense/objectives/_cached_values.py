"""Values that several objectives share, each computed on first use."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any, TypeVar, cast

from optisense.errors import OptiSenseError

_T = TypeVar("_T")


class CachedValues:
    """Base class of objects that keep the values that they have computed.

    Attributes:
        seconds: wall time (s) that each value took, by its name, without that of nested values.
    """

    def __init__(self) -> None:
        """Create an object without values."""
        self.seconds: dict[str, float] = {}
        self._made: dict[str, Any] = {}

    def take(self, other: CachedValues, names: Iterable[str]) -> None:
        """Take those of the named values that another object has computed."""
        self._made |= {name: other._made[name] for name in names if name in other._made}

    def shared(self, name: str, make: Callable[[], _T]) -> _T:
        """Return a value that is computed on first use; an error is kept as well, and raised again.

        Args:
            name: name of the value, with the settings that it depends on.
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
