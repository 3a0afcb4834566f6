"""Splits: presses of a cell stay together, none is empty, and more samples change nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optisense.tasks._splits import CELLS, SPLITS, TEST, split_of


@pytest.mark.parametrize(("rows", "held"), [(6, 5), (8, 6), (2, 2), (1, 1)])
def test_the_shares_are_those_of_the_cells(rows: int, held: int) -> None:
    spots = [((i + 0.5) / CELLS, (j + 0.5) / CELLS) for i in range(CELLS) for j in range(rows)]
    for seed in range(20):
        found = [split_of(seed, "sphere:2", spot, rows / CELLS) for spot in spots]
        assert [found.count(name) for name in SPLITS] == [len(spots) - 2 * held, held, held]


def test_a_cell_is_in_one_split_whatever_presses_it() -> None:
    generator = np.random.default_rng(1)
    by_cell: dict[tuple[int, int], set[str]] = {}
    for x, y in generator.random((2000, 2)).tolist():
        cell = math.floor(CELLS * x), math.floor(CELLS * y)
        for indenter in ("plane", "sphere:2"):
            by_cell.setdefault(cell, set()).add(split_of(7, indenter, (x, y), 1.0))
    assert len(by_cell) == CELLS**2
    assert all(len(names) == 1 for names in by_cell.values())


def test_seeds_split_each_in_their_own_way_and_indenters_are_held_out() -> None:
    spots = [((i + 0.5) / CELLS, 0.1) for i in range(CELLS)]

    def splits(seed: int, indenter: str, *held: str) -> list[str]:
        return [split_of(seed, indenter, spot, 0.75, held) for spot in spots]

    assert len({tuple(splits(seed, "plane")) for seed in range(9)}) > 3
    assert set(splits(1, "plane", "plane")) == {TEST}
    assert splits(1, "sphere:2", "plane") == splits(1, "sphere:2")
