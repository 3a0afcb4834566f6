"""Splits: presses of a cell stay together, none is empty, and more samples change nothing."""

from __future__ import annotations

import numpy as np
import pytest

from optisense import OpticalModel, load
from optisense.tasks._draws import Places
from optisense.tasks._splits import CELLS, SPLITS, TEST, Cell, cell_of, split_of


def grid(rows: int) -> list[Cell]:
    return [(column, row) for column in range(CELLS) for row in range(rows)]


@pytest.mark.parametrize(("rows", "held"), [(6, 5), (8, 6), (2, 2), (1, 1)])
def test_the_shares_are_those_of_the_cells(rows: int, held: int) -> None:
    cells = grid(rows)
    for seed in range(20):
        found = [split_of(seed, "sphere:2", cell, cells) for cell in cells]
        assert [found.count(name) for name in SPLITS] == [len(cells) - 2 * held, held, held]


def test_the_shares_are_those_of_the_skin_where_it_fills_a_part_of_the_picture() -> None:
    """Skin fills 31 % of the picture of GelSight Svelte."""
    cells = Places.of(OpticalModel(load("builtin:gelsight-svelte"))).cells(0.75)
    assert len(cells) == 24 < len(grid(6))
    held = round(0.1 * len(cells))
    for seed in range(40):
        found = [split_of(seed, "plane", cell, cells) for cell in cells]
        assert [found.count(name) for name in SPLITS] == [len(cells) - 2 * held, held, held]


def test_a_cell_is_in_one_split_whatever_presses_it() -> None:
    generator = np.random.default_rng(1)
    by_cell: dict[Cell, set[str]] = {}
    for spot in generator.random((2000, 2)).tolist():
        cell = cell_of(spot, 1.0)
        for indenter in ("plane", "sphere:2"):
            by_cell.setdefault(cell, set()).add(split_of(7, indenter, cell, grid(CELLS)))
    assert len(by_cell) == CELLS**2
    assert all(len(names) == 1 for names in by_cell.values())


def test_seeds_split_each_in_their_own_way_and_indenters_are_held_out() -> None:
    def splits(seed: int, indenter: str, *held: str) -> list[str]:
        return [split_of(seed, indenter, (i, 0), grid(6), held) for i in range(CELLS)]

    assert len({tuple(splits(seed, "plane")) for seed in range(9)}) > 3
    assert set(splits(1, "plane", "plane")) == {TEST}
    assert splits(1, "sphere:2", "plane") == splits(1, "sphere:2")
