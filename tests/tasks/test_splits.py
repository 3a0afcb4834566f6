"""Splits: near copies of a press stay together, and more samples change nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optisense.tasks._splits import CELLS, SHARES, SPLITS, TEST, split_of


def test_the_shares_are_those_of_the_cells() -> None:
    spots = [((i + 0.5) / CELLS, (j + 0.5) / CELLS) for i in range(CELLS) for j in range(CELLS)]
    found = [split_of(seed, "sphere:2", spot) for seed in range(60) for spot in spots]
    for name, share in zip(SPLITS, SHARES, strict=True):
        spread = math.sqrt(share * (1.0 - share) / len(found))
        assert found.count(name) / len(found) == pytest.approx(share, abs=4.0 * spread)


def test_a_cell_is_in_one_split() -> None:
    generator = np.random.default_rng(1)
    by_cell: dict[tuple[int, int], set[str]] = {}
    for x, y in generator.random((2000, 2)).tolist():
        cell = math.floor(CELLS * x), math.floor(CELLS * y)
        by_cell.setdefault(cell, set()).add(split_of(7, "plane", (x, y)))
    assert len(by_cell) == CELLS**2
    assert all(len(names) == 1 for names in by_cell.values())


def test_indenters_are_split_each_in_its_own_way_or_held_out() -> None:
    spots = [((i + 0.5) / CELLS, 0.1) for i in range(CELLS)] * 4
    seeds = [number // CELLS for number in range(len(spots))]

    def splits(indenter: str, *held: str) -> list[str]:
        return [split_of(s, indenter, spot, held) for s, spot in zip(seeds, spots, strict=True)]

    assert splits("sphere:2") != splits("plane")
    assert set(splits("plane", "plane")) == {TEST}
    assert splits("sphere:2", "plane") == splits("sphere:2")
