"""Kinds of lamps; `LightModel` stands for any of them."""

from optisense.design.emitters._lamps import AreaEmitter, IesEmitter, SpotEmitter
from optisense.design.emitters.base import Intensity, LightModel, Window

__all__ = ["AreaEmitter", "IesEmitter", "Intensity", "LightModel", "SpotEmitter", "Window"]
