"""What every search method keeps, and that each finds what it is meant to find."""

from __future__ import annotations

import signal
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.stats import qmc

from optisense.errors import SearchError
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods import Method, Problem, find, make, names, register
from optisense.search.methods._registry import METHODS
from optisense.search.methods.base import values_to_maximise
from optisense.search.space.search_space import BoundSpace, SearchSpace
from optisense.sensors import load

FloatArray = np.ndarray
Score = Callable[[FloatArray], float]

GENERAL = ("grid", "random", "cma-es")
"""Methods for any space and one goal; those for special ones have tests of their own."""


def bowl(space: BoundSpace, share: float = 0.3) -> Score:
    """Highest (0) where every coordinate is at this share of its range."""
    peak = space.lower + share * (space.upper - space.lower)
    span = space.upper - space.lower
    return lambda point: -float((((point - peak) / span) ** 2).sum())


def drive(method: Method, score: Score, generations: int) -> list[FloatArray]:
    """Ask and tell; returns the generations."""
    asked = []
    for _ in range(generations):
        points = method.ask()
        if not len(points):
            break
        asked.append(points)
        name = method.problem.objectives[0]
        method.tell(points, [Outcome({name: score(point)}) for point in points])
    return asked


def best_of(asked: list[FloatArray], score: Score) -> float:
    return max(score(point) for points in asked for point in points)


@pytest.mark.parametrize("name", GENERAL)
class TestContract:
    def test_telling_a_new_one_the_same_continues_it(self, name: str, mixed: BoundSpace) -> None:
        """This is what resuming a study rests on: the same to the last bit."""
        problem = Problem(mixed, ("score",), 1000, seed=4)
        score = bowl(mixed)
        first, second = make(name, problem), make(name, problem)
        drive(first, score, 5)
        np.random.seed(1)
        drive(second, score, 5)
        assert np.array_equal(first.ask(), second.ask())

    def test_the_global_random_numbers_are_left_alone(self, name: str, mixed: BoundSpace) -> None:
        np.random.seed(7)
        expected = np.random.random()
        np.random.seed(7)
        drive(make(name, Problem(mixed, ("score",), 1000)), bowl(mixed), 3)
        assert np.random.random() == expected

    def test_another_seed_is_another_search(self, name: str, two_numbers: BoundSpace) -> None:
        one, other = (
            make(name, Problem(two_numbers, ("score",), 1000, seed=seed)) for seed in (1, 2)
        )
        same = np.array_equal(one.ask(), other.ask())
        assert same == (name == "grid")


def test_grid_has_every_combination_once(mixed: BoundSpace) -> None:
    kind = find("grid")
    budget = kind.default_budget(mixed)
    assert budget == 3 * 3 * 5
    asked = drive(make("grid", Problem(mixed, ("score",), budget)), bowl(mixed), 10)
    points = {tuple(point) for points in asked for point in points}
    assert len(points) == budget == sum(map(len, asked))


def test_grid_needs_steps_and_budget(mini_free: BoundSpace, two_numbers: BoundSpace) -> None:
    with pytest.raises(SearchError, match="number of steps") as told:
        find("grid").default_budget(mini_free)
    assert told.value.where == "coating.specularity"
    with pytest.raises(SearchError, match="15 designs, the budget is 3"):
        make("grid", Problem(two_numbers, ("score",), 3))


def test_cma_es_learns_the_shape_of_a_valley(valley: BoundSpace) -> None:
    """A valley a hundred times longer than wide, at an odd angle in ten dimensions."""
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(10, 10)))[0]
    widths = np.logspace(0, 2, 10)

    def score(point: FloatArray) -> float:
        return -float(((widths * (turn @ (valley.to_unit(point) - 0.6))) ** 2).sum())

    def best(name: str, generations: int) -> float:
        method = make(name, Problem(valley, ("s",), 9999, seed=1))
        return best_of(drive(method, score, generations), score)

    assert best("cma-es", 500) > -1e-6
    assert best("random", 90) < -1.0


def test_cma_es_starts_at_the_design(valley: BoundSpace) -> None:
    """The first generation surrounds what the design is, at the given part of the range."""
    problem = Problem(valley, ("s",), 9999, seed=3)
    points = make("cma-es", problem, {"sigma": 0.01, "population": 400}).ask()
    away = (points - valley.start) / (valley.upper - valley.lower)
    assert np.abs(away.mean(axis=0)).max() < 4 * 0.01 / 20
    assert np.allclose(away.std(axis=0), 0.01, rtol=0.2)


def test_an_interrupt_while_the_tables_of_points_load_is_not_lost(
    two_numbers: BoundSpace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SciPy loads them in compiled code that drops exceptions."""
    made = qmc.Sobol

    def loading(*args: Any, **given: Any) -> Any:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return made(*args, **given)

    monkeypatch.setattr(qmc, "Sobol", loading)
    with pytest.raises(KeyboardInterrupt):
        make("random", Problem(two_numbers, ("s",), 10))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_cma_es_searches_a_single_number() -> None:
    """pycma fails there where it would keep the deviation within the bounds."""
    space = SearchSpace({"coating.specularity": (0.0, 1.0)}).bind(load("gelsight-mini-ideal"))
    score = bowl(space)
    asked = drive(make("cma-es", Problem(space, ("s",), 9999, seed=2)), score, 30)
    assert best_of(asked, score) > -1e-4


def test_cma_es_restarts_with_more(two_numbers: BoundSpace) -> None:
    method = make("cma-es", Problem(two_numbers, ("s",), 99999), {"restarts": 1})
    asked = drive(method, bowl(two_numbers), 2000)
    sizes = [len(points) for points in asked]
    assert sorted(set(sizes)) == [sizes[0], 2 * sizes[0]]
    assert len(method.ask()) == 0
    assert method.restarted == 1  # type: ignore[attr-defined]


def test_cma_es_finds_whole_numbers(mixed: BoundSpace) -> None:
    """The best option is the last one, the best number in the middle."""
    peak = np.array([0.4, 2.0, 102.0])

    def score(point: FloatArray) -> float:
        return -float(((point - peak) ** 2).sum())

    asked = drive(make("cma-es", Problem(mixed, ("s",), 9999, seed=2)), score, 60)
    best = max((point for points in asked for point in points), key=score)
    assert np.array_equal(best[1:], peak[1:])
    assert abs(best[0] - 0.4) < 1e-3


def test_random_points_are_spread_evenly(two_numbers: BoundSpace) -> None:
    """Of 64 Sobol points, each of 64 equal boxes of an 8 x 8 net holds one."""
    unit = two_numbers.to_unit(make("random", Problem(two_numbers, ("s",), 99)).ask())
    boxes = {(int(8 * x), int(8 * y)) for x, y in np.minimum(unit, 1 - 1e-12)}
    assert len(unit) == len(boxes) == 64


def test_pareto_finds_a_known_front(two_numbers: BoundSpace) -> None:
    """Fonseca and Fleming's problem, 1995: the best trade-offs lie on the line x = y."""

    def goals(point: FloatArray) -> dict[str, float]:
        x = 8.0 * two_numbers.to_unit(point) - 4.0
        root = 1.0 / np.sqrt(2.0)
        return {
            "a": -float(1.0 - np.exp(-((x - root) ** 2).sum())),
            "b": -float(1.0 - np.exp(-((x + root) ** 2).sum())),
        }

    t = np.linspace(-1, 1, 2001) / np.sqrt(2.0)
    true = [[np.exp(-2.0 * (t + side / np.sqrt(2)) ** 2) - 1.0 for side in (-1, 1)] for t in t]
    method = make("pareto", Problem(two_numbers, ("a", "b"), 2000, seed=1), {"population": 60})
    found = []
    for _ in range(40):
        points = method.ask()
        outcomes = [Outcome(goals(point)) for point in points]
        method.tell(points, outcomes)
        found += [list(outcome.scores.values()) for outcome in outcomes]
    reference = (-1.0, -1.0)
    assert hypervolume(found, reference) > 0.98 * hypervolume(true, reference)


def hypervolume(values: ArrayLike, reference: tuple[float, float]) -> float:
    """The area between values (k, 2) and a reference point that they dominate."""
    area, (left, height) = 0.0, reference
    for first, second in np.asarray(sorted(values, key=tuple, reverse=True)).tolist():  # type: ignore[arg-type, type-var]
        if first > left and second > height:
            area += (first - left) * (second - height)
            height = second
    return area


def test_pareto_needs_two_goals(two_numbers: BoundSpace) -> None:
    with pytest.raises(SearchError, match="two or more objectives"):
        make("pareto", Problem(two_numbers, ("a",), 100))


def test_failed_trials_count_less_than_the_worst() -> None:
    outcomes = [Outcome({"s": 2.0}), Outcome.of_failure(["s"], "no"), Outcome({"s": 1.0})]
    values = values_to_maximise(outcomes, "s")
    assert values[1] < values[2] < values[0]
    assert np.isnan(values_to_maximise(outcomes[1:2], "s")).all()


def test_bad_names_and_options_are_told(two_numbers: BoundSpace) -> None:
    problem = Problem(two_numbers, ("s",), 100)
    with pytest.raises(SearchError) as told:
        find("cma_es")
    assert "cma-es" in str(told.value)
    with pytest.raises(SearchError) as told:
        make("cma-es", problem, {"sigmas": 1})
    assert "sigma" in str(told.value)
    with pytest.raises(SearchError, match="sigma is 2"):
        make("cma-es", problem, {"sigma": 2})


@pytest.mark.parametrize(
    ("method", "option", "value", "wanted"),
    [
        ("cma-es", "sigma", "abc", "a number"),
        ("cma-es", "population", 3.5, "a whole number"),
        ("cma-es", "population", "many", "a whole number"),
        ("cma-es", "restarts", True, "a whole number"),
        ("gradient", "starts", 2.5, "a whole number"),
        ("gradient", "memory", None, "a whole number"),
    ],
)
def test_an_option_of_another_type_is_named(
    two_numbers: BoundSpace, method: str, option: str, value: object, wanted: str
) -> None:
    with pytest.raises(SearchError) as told:
        make(method, Problem(two_numbers, ("s",), 100), {option: value})
    assert told.value.message == f"the option '{option}' of {method} is {value!r}"
    assert told.value.hint == f"Give {wanted}"


def test_a_whole_number_may_be_written_with_a_point(two_numbers: BoundSpace) -> None:
    points = make("cma-es", Problem(two_numbers, ("s",), 100), {"population": 6.0}).ask()
    assert points.shape == (6, 2)
    make("cma-es", Problem(two_numbers, ("s",), 100), {"population": None, "sigma": 1})


class Choosy(Method):
    """A method with options that may be a word or a number, or that have no type."""

    name = "choosy"
    summary = "a test"

    def __init__(self, problem: Problem, step: float | str = "auto", count: Any = None) -> None:
        super().__init__(problem)
        self.step, self.count = step, 4 if count is None else int(count)

    def ask(self) -> FloatArray:
        return np.empty((0, self.space.size))

    def tell(self, vectors: FloatArray, outcomes: object) -> None:
        pass


class Broken(Choosy):
    """A method whose constructor fails."""

    name = "broken"

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, count=[])


def test_errors_in_a_constructor_are_told(two_numbers: BoundSpace) -> None:
    problem = Problem(two_numbers, ("s",), 100)
    with METHODS.forgetting():
        register(Choosy)
        register(Broken)
        for step in (0.5, 2, "auto"):
            assert make("choosy", problem, {"step": step}).step == step  # type: ignore[attr-defined]
        with pytest.raises(SearchError, match=r"is True\. Give a number or a word"):
            make("choosy", problem, {"step": True})
        for count in ("x", []):
            with pytest.raises(SearchError, match="option of choosy has the wrong type") as told:
                make("choosy", problem, {"count": count})
            assert told.value.hint == f"Check count={count}"
        with pytest.raises(SearchError, match="broken can't be set up: TypeError") as told:
            make("broken", problem)
    assert f"{__file__}:" in str(told.value.where)


def test_other_packages_bring_methods(two_numbers: BoundSpace) -> None:
    class Middle(Method):
        name = "middle-of-the-space"
        summary = "one point"

        def ask(self) -> FloatArray:
            return self.space.from_unit(np.full((1, self.space.size), 0.5))

        def tell(self, vectors: FloatArray, outcomes: object) -> None:
            pass

    register(Middle)
    assert "middle-of-the-space" in names()
    points = make("middle-of-the-space", Problem(two_numbers, ("s",), 1)).ask()
    assert np.allclose(points, [[0.5, 1.0]])

    class Grid(Middle):
        name = "grid"

    with pytest.raises(SearchError, match="already a search method"):
        register(Grid)


def test_what_is_no_method_is_refused_when_it_is_registered() -> None:
    class NoMethod:
        summary = "a test"

    class Nameless(Method):
        summary = "a test"

        def ask(self) -> FloatArray:
            return np.empty((0, self.space.size))

    class Undescribed(Choosy):
        name = "undescribed"
        summary = ""

    with METHODS.forgetting():
        for given in (NoMethod, len, 4):
            with pytest.raises(SearchError, match="is not a subclass of Method"):
                register(given)  # type: ignore[arg-type]
        with pytest.raises(SearchError, match="'Nameless' has no name and no tell"):
            register(Nameless)
        with pytest.raises(SearchError, match="'Undescribed' has no summary"):
            register(Undescribed)
        with pytest.raises(SearchError, match="is not a subclass of Method"):
            METHODS.register("mine", NoMethod)  # type: ignore[arg-type]  # as an entry point does


@pytest.fixture(scope="module")
def mini_free(mini: object) -> BoundSpace:
    return SearchSpace({"coating.specularity": (0.0, 1.0)}).bind(mini)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def valley(mini: object) -> BoundSpace:
    """Ten numbers: what they mean does not matter here."""
    space = {f"lights.red.lights[{k // 3}].shift.{'xyz'[k % 3]}": (-1.0, 3.0) for k in range(10)}
    return SearchSpace(space).bind(mini)  # type: ignore[arg-type]
