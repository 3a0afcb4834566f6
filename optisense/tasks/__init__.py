"""What a robot would read from a sensor: datasets, perception tasks, shape reconstruction.

Names load on first use, so that importing the package loads neither scikit-learn nor the renderer.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optisense.tasks.dataset import Dataset, Sample
    from optisense.tasks.draws import ContactDraw
    from optisense.tasks.generation import DatasetSettings, generate
    from optisense.tasks.snr import signal_to_noise

_HOMES = {
    "ContactDraw": "draws",
    "Dataset": "dataset",
    "DatasetSettings": "generation",
    "Sample": "dataset",
    "generate": "generation",
    "signal_to_noise": "snr",
}

__all__ = ["ContactDraw", "Dataset", "DatasetSettings", "Sample", "generate", "signal_to_noise"]


def __getattr__(name: str) -> object:
    """Import a public name on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'optisense.tasks' has no attribute {name!r}")
    value: object = getattr(import_module(f"optisense.tasks.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
