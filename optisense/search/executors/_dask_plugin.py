"""Dask plugin that gives an evaluator to every worker, also to those that join later."""

from __future__ import annotations

from typing import TYPE_CHECKING

from distributed import WorkerPlugin

from optisense.search.executors._remote_worker import drop_evaluator, store_evaluator

if TYPE_CHECKING:
    from distributed import Worker


class EvaluatorPlugin(WorkerPlugin):
    """Keeps a packed evaluator in the worker's process."""

    def __init__(self, key: str, blob: bytes) -> None:
        self.key = key
        self.blob = blob

    def setup(self, worker: Worker) -> None:
        """Remember the evaluator; Dask calls this when the worker starts or gets the plugin."""
        store_evaluator(self.key, self.blob)

    def teardown(self, worker: Worker) -> None:
        """Forget the evaluator; Dask calls this when the worker or the plugin ends."""
        drop_evaluator(self.key)
