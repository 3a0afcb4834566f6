"""Optics: rendering tactile images of designs; the only package that imports the renderer.

Names load on first use, so that libLLVM is checked before Mitsuba is imported.

Shapes in docstrings follow NumPy. An array of the renderer (`mi.Float`, `mi.UInt32`, `mi.Bool`) has
one entry per ray, photon, point or pixel, and shape (n,); `mi.Point3f`, `mi.Vector3f` and
`mi.Color3f` hold three such arrays, x, y, z or R, G, B. Arrays of one entry apply to all n.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from optisense.optics._model import OpticalModel
    from optisense.optics.backend.stages import RenderProgress
    from optisense.optics.drafts import CoarseModel
    from optisense.optics.imaging.tactile_image import TactileImage
    from optisense.optics.ledger import LightLedger, light_ledger
    from optisense.optics.light_at_camera import CameraLight, camera_light
    from optisense.optics.place_light import PlaceLight, light_at
    from optisense.optics.transport.chief_rays import ChiefRays, RayOutcome

__all__ = [
    "CameraLight",
    "ChiefRays",
    "CoarseModel",
    "LightLedger",
    "OpticalModel",
    "PlaceLight",
    "RayOutcome",
    "RenderProgress",
    "TactileImage",
    "camera_light",
    "light_at",
    "light_ledger",
]


def _check_llvm() -> None:
    from optisense.optics.backend.variant import select_variant

    select_variant("auto")


if not TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__, __dir__ = load_on_first_use(__name__, __file__, before=_check_llvm)
