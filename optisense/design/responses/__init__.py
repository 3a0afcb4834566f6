"""Response of a camera to light: `PictureChain` and its components.

`base` has `CameraResponse`, `tone_curve` the tone curves, `electronics` noise, black level and
colours; the effects of the lens are in `design/lenses`.
"""

from optisense.design.responses.base import CameraResponse, FullWellResponse
from optisense.design.responses.chain import USUAL_RESPONSE, PictureChain
from optisense.design.responses.electronics import BlackLevel, SensorNoise
from optisense.design.responses.tone_curve import ToneCurve

__all__ = [
    "USUAL_RESPONSE",
    "BlackLevel",
    "CameraResponse",
    "FullWellResponse",
    "PictureChain",
    "SensorNoise",
    "ToneCurve",
]
