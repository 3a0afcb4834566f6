"""Executors of trials: this process, a pool of processes, any executor, or a Dask cluster."""

from optisense.search.executors._choice import Workers, create_runner
from optisense.search.executors._remote import DaskRunner, ExecutorRunner
from optisense.search.executors._serial import SerialRunner
from optisense.search.executors.base import Runner
from optisense.search.executors.pool import ProcessPool, processors

__all__ = [
    "DaskRunner",
    "ExecutorRunner",
    "ProcessPool",
    "Runner",
    "SerialRunner",
    "Workers",
    "create_runner",
    "processors",
]
