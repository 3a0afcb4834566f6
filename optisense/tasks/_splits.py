"""Training, validation and test samples of a dataset."""

from __future__ import annotations

import hashlib
import math

TRAIN, VALIDATION, TEST = "train", "validation", "test"

SPLITS = (TRAIN, VALIDATION, TEST)

SHARES = (0.8, 0.1, 0.1)
"""Shares of all cells in the training, validation and test split, usual for some 1000 samples."""

CELLS = 8
"""Number of square cells across the picture; on a GelSight Mini they are 2.3 mm wide, and presses
of one indenter inside a cell look alike."""


def split_of(
    seed: int, indenter: str, spot: tuple[float, float], hold_out: tuple[str, ...] = ()
) -> str:
    """Return the split of a press.

    The picture is divided into cells, and all presses of an indenter in a cell are in one split, so
    that no press has a near copy in another split. The split depends on the arguments only, so that
    further samples do not change those of existing ones.

    Args:
        indenter: text of the indenter, as given.
        spot: position of the place in the picture, as shares of its width from the left and from
            the upper edge.
        hold_out: indenters that are in the test split only.
    """
    if indenter in hold_out:
        return TEST
    cell = [math.floor(CELLS * each) for each in spot]
    name = f"{seed} {indenter} {cell[0]} {cell[1]}"
    drawn = int.from_bytes(hashlib.sha256(name.encode("utf-8")).digest()[:8], "big") / 2.0**64
    if drawn < SHARES[0]:
        return TRAIN
    return VALIDATION if drawn < SHARES[0] + SHARES[1] else TEST
