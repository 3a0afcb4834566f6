"""EXR files that are damaged are refused, whatever their header says."""

from __future__ import annotations

import struct
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from optisense.optics.backend.variant import threads_for_exr_files
from optisense.optics.imaging.radiance_files import decode_radiance

RADIANCE = np.random.default_rng(4).uniform(0.0, 1.0, (18, 24, 3)).astype(np.float32)


def exr_of(folder: Path, radiance: np.ndarray) -> bytes:
    path = folder / "radiance.exr"
    with threads_for_exr_files():
        mi.Bitmap(radiance).write(str(path))
    return path.read_bytes()


def test_only_the_expected_size_is_decoded(tmp_path: Path) -> None:
    data = exr_of(tmp_path, RADIANCE)
    assert np.allclose(decode_radiance(data, (24, 18)), RADIANCE, rtol=1e-3, atol=1e-3)
    huge = data
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        at = data.index(name) + len(name) + 4
        huge = huge[:at] + struct.pack("<4i", 0, 0, 10**9, 10**9) + huge[at + 16 :]
    with pytest.raises(ValueError, match="1000000001x1000000001 pixels"):
        decode_radiance(huge, (24, 18))


def test_values_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    radiance = RADIANCE.copy()
    radiance[3, 4] = np.nan, np.inf, 0.0
    with pytest.raises(ValueError, match="not all finite"):
        decode_radiance(exr_of(tmp_path, radiance))
