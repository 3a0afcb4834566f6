"""Training, validation and test samples of a dataset."""

from __future__ import annotations

import hashlib
import math
from itertools import product

TRAIN, VALIDATION, TEST = "train", "validation", "test"

SPLITS = (TRAIN, VALIDATION, TEST)

SHARES = (0.8, 0.1, 0.1)
"""Shares of all cells in the training, validation and test split, usual for some 1000 samples."""

CELLS = 8
"""Number of square cells across the picture; on a GelSight Mini they are 2.5 mm wide, wider than
most contacts, so that few presses have one of another split beside them."""


def split_of(
    seed: int,
    indenter: str,
    spot: tuple[float, float],
    aspect: float,
    hold_out: tuple[str, ...] = (),
) -> str:
    """Return the split of a press.

    The picture is divided into cells, and all presses in a cell are in one split; a press may still
    have one of another split beside it, across the border of its cell. The split depends on the
    arguments only, so that further samples do not change those of existing ones.

    Args:
        indenter: text of the indenter, as given.
        spot: position of the place in the picture, as shares of its width from the left and from
            the upper edge.
        aspect: height of the picture over its width.
        hold_out: indenters that are in the test split only.
    """
    if indenter in hold_out:
        return TEST
    rows = max(math.ceil(CELLS * aspect - 1e-9), 1)
    column, row = (math.floor(CELLS * each) for each in spot)
    return _shuffled(seed, rows).get((column, row), TRAIN)


def _shuffled(seed: int, rows: int) -> dict[tuple[int, int], str]:
    """Return the validation and test cells (column, row) of a picture; the shares of all splits are
    exact to half a cell, and none is empty.
    """
    cells = sorted(product(range(CELLS), range(rows)), key=lambda cell: _digest(seed, *cell))
    validation, test = (max(round(share * len(cells)), 1) for share in SHARES[1:])
    return dict.fromkeys(cells[:validation], VALIDATION) | dict.fromkeys(
        cells[validation : validation + test], TEST
    )


def _digest(seed: int, column: int, row: int) -> bytes:
    return hashlib.sha256(f"{seed} {column} {row}".encode()).digest()
