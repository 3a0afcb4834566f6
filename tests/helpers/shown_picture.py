"""The picture that the studio shows in Blender."""

from __future__ import annotations

import bpy
import numpy as np
from waiting import until

from studio.simulate import picture, relight


def shown() -> np.ndarray:
    """Return the picture (h, w, 4), row 0 at the bottom, without an open relighting."""
    until(lambda: relight._open is None or relight._open.done)
    image = bpy.data.images[picture.IMAGE]
    values = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(values)
    width, height = image.size
    return values.reshape(height, width, 4)
