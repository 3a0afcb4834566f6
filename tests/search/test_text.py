"""Reading what may change, and what may be off, from one line."""

from __future__ import annotations

import pytest

from optisense.errors import SearchError
from optisense.search import (
    Around,
    CagePoints,
    Choice,
    Continuous,
    Together,
    ToleranceDistribution,
)
from optisense.search.space.text import parse_errors, parse_space, parse_vary


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("a.b=0:1", Continuous(0.0, 1.0)),
        ("a.b=-2.5:1e3:11", Continuous(-2.5, 1000.0, 11)),
        (" a.b = 0 : 1 ", Continuous(0.0, 1.0)),
        ("a.b=+-0.5", Around(0.5)),
        ("a.b=±0.5:5", Around(0.5, 5)),
        ("a.b=smd-3528,ws2812b", Choice(["smd-3528", "ws2812b"])),
        ("a.b=1,2,5", Choice([1, 2, 5])),
        ("a.b=[[1, 0, 0], [0, 1, 0]]", Choice([(1, 0, 0), (0, 1, 0)])),
        ("a.b=0:1/symmetry=x", CagePoints(Continuous(0.0, 1.0), symmetry="x")),
        (
            "a.b=+-2/points=0,2,6-8/axes=xz",
            CagePoints(Around(2.0), points=(0, 2, 6, 7, 8), axes="xz"),
        ),
        ("a.b=0:1:5/together", Together(Continuous(0.0, 1.0, 5))),
        ("a.b=R,G / together", Together(Choice(["R", "G"]))),
    ],
)
def test_reads(text: str, meaning: object) -> None:
    assert parse_vary(text) == ("a.b", meaning)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a.b", "is not a parameter"),
        ("=0:1", "is not a parameter"),
        ("a.b=1", "neither a range nor a list"),
        ("a.b=1:0", "reversed"),
        ("a.b=1:1", "empty"),
        ("a.b=x:1", "not a number"),
        ("a.b=0:1:2:3", "too many colons"),
        ("a.b=0:1:many", "number of steps"),
        ("a.b=a,", "an option is empty"),
        ("a.b=a,a", "given twice"),
        ("a.b=0:1/symetry=x", "not known"),
        ("a.b=0:1/symmetry=w", "no symmetry"),
        ("a.b=0:1/points=a-b", "not indices"),
        ("a.b=a,b/symmetry=x", "range of numbers"),
    ],
)
def test_refuses(text: str, said: str) -> None:
    with pytest.raises(SearchError, match=said):
        parse_vary(text)


def test_a_path_is_varied_once() -> None:
    with pytest.raises(SearchError, match="twice"):
        parse_space(["a.b=0:1", "a.b=0:2"])


def test_errors_of_making() -> None:
    errors = parse_errors(["lights.position=0.1", "coating.specularity=+-0.05"])
    assert errors.distributions == {
        "lights.position": ToleranceDistribution(0.1),
        "coating.specularity": ToleranceDistribution(0.05, "uniform"),
    }
    for text in ("a", "a=", "a=x", "a=-1", "a=+-0"):
        with pytest.raises(SearchError):
            parse_errors([text])
    with pytest.raises(SearchError, match="two manufacturing errors"):
        parse_errors(["a=1", "a=2"])
