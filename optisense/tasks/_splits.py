"""Training, validation and test samples of a dataset."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Sequence

TRAIN, VALIDATION, TEST = "train", "validation", "test"

SPLITS = (TRAIN, VALIDATION, TEST)

SHARES = (0.8, 0.1, 0.1)
"""Shares of the cells that show skin in the training, validation and test split, usual for some
1000 samples."""

CELLS = 8
"""Number of square cells across the picture; on a GelSight Mini they are 2.5 mm wide, wider than
most contacts, so that few presses have one of another split beside them."""


Cell = tuple[int, int]
"""Column and row of a cell, from 0 at the left and at the upper edge."""


def cell_of(spot: Sequence[float], aspect: float) -> Cell:
    """Return the cell of a position, in shares of the picture's width and height, from the height
    of the picture over its width.
    """
    return math.floor(CELLS * spot[0]), math.floor(CELLS * (spot[1] * aspect))


def split_of(
    seed: int,
    indenter: str,
    cell: Cell,
    cells: Collection[Cell],
    hold_out: tuple[str, ...] = (),
) -> str:
    """Return the split of a press of an indenter in a cell, of all cells in which the camera sees
    skin; indenters that are held out are in the test split only.

    The picture is divided into cells, and all presses in a cell are in one split; a press may still
    have one of another split beside it, across the border of its cell. The split depends on the
    arguments only, so that further samples do not change those of existing ones.
    """
    if indenter in hold_out:
        return TEST
    return _shuffled(seed, cells).get(cell, TRAIN)


def _shuffled(seed: int, cells: Collection[Cell]) -> dict[Cell, str]:
    """Return the validation and test cells. The shares of all splits are exact to half a cell, and
    each split has a cell if there are three or more; of fewer, all are training cells.
    """
    if len(cells) < len(SPLITS):
        return {}
    ranked = sorted(cells, key=lambda cell: _digest(seed, *cell))
    validation, test = (max(round(share * len(ranked)), 1) for share in SHARES[1:])
    return dict.fromkeys(ranked[:validation], VALIDATION) | dict.fromkeys(
        ranked[validation : validation + test], TEST
    )


def _digest(seed: int, column: int, row: int) -> bytes:
    return hashlib.sha256(f"{seed} {column} {row}".encode()).digest()
