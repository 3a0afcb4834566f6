"""Dask plugin that prepares every worker, also those that join later."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from distributed import WorkerPlugin

if TYPE_CHECKING:
    from distributed import Worker


class PreparingPlugin(WorkerPlugin):
    """Calls a function in a worker's process when it starts, and another one when it ends."""

    def __init__(self, begin: Callable[[], None], end: Callable[[], None]) -> None:
        self.begin = begin
        self.end = end

    def setup(self, worker: Worker) -> None:
        """Begin; Dask calls this when the worker starts or gets the plugin."""
        self.begin()

    def teardown(self, worker: Worker) -> None:
        """End; Dask calls this when the worker or the plugin ends."""
        self.end()
