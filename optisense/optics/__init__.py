"""The one package that knows the renderer: from a design to a tactile image.

Names load on first use: whoever asks for one gets libLLVM checked before Mitsuba is imported.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optisense.optics.chief_rays import ChiefRays, Outcome
    from optisense.optics.image import TactileImage
    from optisense.optics.model import OpticalModel, Progress

_HOMES = {
    "ChiefRays": "chief_rays",
    "OpticalModel": "model",
    "Outcome": "chief_rays",
    "Progress": "model",
    "TactileImage": "image",
}

__all__ = ["ChiefRays", "OpticalModel", "Outcome", "Progress", "TactileImage"]


def __getattr__(name: str) -> object:
    """Check libLLVM, then import a public name (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'optisense.optics' has no attribute {name!r}")
    from optisense.optics.variant import select_variant

    select_variant("auto")
    value: object = getattr(import_module(f"optisense.optics.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
