"""Preview pictures: the ball of a material, the polar plot of a light, the field of a camera."""

from optisense.library.previews.draw import draw, save

__all__ = ["draw", "save"]
