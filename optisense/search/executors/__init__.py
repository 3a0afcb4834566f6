"""Who works out trials: this process, a pool of processes, any executor, or a Dask cluster."""

from optisense.search.executors.base import Runner
from optisense.search.executors.pool import ProcessPool, processors
from optisense.search.executors.remote import DaskRunner, ExecutorRunner
from optisense.search.executors.serial import SerialRunner

__all__ = [
    "DaskRunner",
    "ExecutorRunner",
    "ProcessPool",
    "Runner",
    "SerialRunner",
    "processors",
]
