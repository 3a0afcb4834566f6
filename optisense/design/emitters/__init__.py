"""Kinds of lamps, one file for each; `LightModel` stands for any of them."""

from optisense.design.emitters.area import AreaEmitter
from optisense.design.emitters.base import LightModel, Window
from optisense.design.emitters.ies import IesEmitter
from optisense.design.emitters.intensity import Intensity
from optisense.design.emitters.spot import SpotEmitter

__all__ = ["AreaEmitter", "IesEmitter", "Intensity", "LightModel", "SpotEmitter", "Window"]
