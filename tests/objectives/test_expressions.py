"""Arithmetic with objectives: what it means, and where errors are marked."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from optisense import evaluate
from optisense.errors import ObjectiveError, UnknownPartError
from optisense.objectives import Objective, find
from optisense.objectives.combined import combined, goal_of, objective_of, resolve
from optisense.objectives.expressions import MOST_CHARACTERS, Expression, ScoreTerm
from optisense.objectives.named import are_rays_only, named_in
from optisense.objectives.testing import evaluation

KNOWN = {ScoreTerm("a"): 3.0, ScoreTerm("b"): -2.0, ScoreTerm("a", "part"): 0.25}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a", 3.0),
        ("a + b", 1.0),
        ("a - b - 1", 4.0),
        ("2*a/3/2", 1.0),
        ("-a*-b", -6.0),
        ("-(a + b)*2", -2.0),
        ("a - (b - 1)", 6.0),
        ("a/(b*2)", -0.75),
        ("a.part*4", 1.0),
        ("min(a, b, 1) + max(a, 7)", 5.0),
        ("abs(b)*sqrt(a + 1)", 4.0),
        ("1e-3*A", 0.003),
        ("+.5 + a", 3.5),
        ("'a' + \"b\"", 1.0),
    ],
)
def test_the_value_is_that_of_arithmetic(text: str, value: float) -> None:
    expression = Expression.parse(text)
    assert expression.value(KNOWN) == pytest.approx(value, rel=1e-15)
    again = Expression.parse(expression.text)
    assert again.text == expression.text
    assert again.value(KNOWN) == expression.value(KNOWN)
    sent = pickle.loads(pickle.dumps(expression))
    assert sent == expression
    assert sent.value(KNOWN) == expression.value(KNOWN)


def test_random_expressions_keep_their_value_when_they_are_written_out() -> None:
    """The text of an expression has the brackets that it needs; Python's arithmetic judges."""
    random = np.random.default_rng(5)

    def build(depth: int) -> str:
        kind = int(random.integers(0, 6 if depth else 2))
        if kind == 0:
            return str(random.choice(["x", "y", "z"]))
        if kind == 1:
            return f"{random.uniform(0.5, 3):.3f}"
        if kind == 2:
            return f"-{build(depth - 1)}"
        if kind == 3:
            return f"({build(depth - 1)})"
        sign = random.choice(["+", "-", "*", "/"])
        return f"{build(depth - 1)} {sign} {build(depth - 1)}"

    values = {"x": 1.7, "y": -0.3, "z": 2.9}
    known = {ScoreTerm(name): value for name, value in values.items()}
    tried = 0
    for _ in range(300):
        text = f"x + {build(4)}"
        try:
            expected = eval(text, {}, dict(values))
        except ZeroDivisionError:
            continue
        expression = Expression.parse(text)
        assert expression.value(known) == pytest.approx(expected, rel=1e-12), text
        assert Expression.parse(expression.text).value(known) == pytest.approx(expected, rel=1e-12)
        tried += 1
    assert tried > 250


@pytest.mark.parametrize(
    ("text", "place", "says"),
    [
        ("aoap +", 6, "something is missing"),
        ("aoap + * 3", 7, "missing before"),
        ("aoap 3", 5, "not expected"),
        ("(aoap + 1", 9, "is missing"),
        ("aoap ^ 2", 5, "can't be read"),
        ("min(aoap)", 0, "two numbers or more"),
        ("sqrt(aoap, 2)", 0, "one number"),
        ("1 + __import__('os')", 4, "no function '__import__'"),
        ("3 + 4", 0, "names no objective"),
        ("aoap + 1e999", 7, "too large a number"),
        ("", 0, "something is missing"),
    ],
)
def test_an_error_marks_the_place(text: str, place: int, says: str) -> None:
    with pytest.raises(ObjectiveError, match=says) as caught:
        Expression.parse(text)
    lines = str(caught.value.message).splitlines()
    assert lines[1] == f"  {text}"
    assert lines[2].index("^") == 2 + place


def test_a_very_long_expression_is_refused() -> None:
    with pytest.raises(ObjectiveError, match="characters"):
        Expression.parse("a + " * MOST_CHARACTERS + "a")
    longest = Expression.parse("+".join("a" * (MOST_CHARACTERS // 2)))
    assert len(longest.text) > MOST_CHARACTERS
    assert pickle.loads(pickle.dumps(longest)) == longest
    deep = "(" * 40 + "a" + ")" * 40
    assert Expression.parse(deep).text == "a"
    for opening in ("(", "-", "abs("):
        with pytest.raises(ObjectiveError, match="inside one another"):
            Expression.parse(opening * 60 + "a")


def test_a_name_with_an_apostrophe_is_written_as_it_is_read() -> None:
    found = Expression.parse('2*"light\'s end"')
    assert found.objectives == ("light's end",)
    assert Expression.parse(found.text) == found


def test_division_by_zero_is_told() -> None:
    with pytest.raises(ObjectiveError, match="can't be computed"):
        Expression.parse("1/(a - a)").value(KNOWN)


def test_a_combined_score_is_made_of_its_objectives() -> None:
    view = evaluation()
    alone = evaluate(view, ["aoap", "coverage", "distortion"])
    text = "aoap + 0.5*coverage - max(0, distortion.area_variation - 0.1)"
    score = evaluate(view, text)
    expected = alone["aoap"].value + 0.5 * alone["coverage"].value
    expected -= max(0.0, alone["distortion"].parts["area_variation"] - 0.1)
    assert score.failure is None
    assert score.value == pytest.approx(expected, rel=1e-12)
    assert score.objective == text
    assert score.beside.startswith("aoap 0.")
    assert score.parts["parts"]["coverage"]["triangles"] > 0
    assert score.file_name == "aoap-+-0.5-coverage---max-0-distortion.area_variation---0.1"


def test_settings_reach_the_objectives_in_it() -> None:
    heavy = evaluate(evaluation(), "2*aoap", coverage_weight=1.0)
    plain = evaluate(evaluation(), "aoap", coverage_weight=1.0)
    assert heavy.value == pytest.approx(2 * plain.value)
    with pytest.raises(ObjectiveError, match="no setting 'jump'"):
        evaluate(evaluation(), "2*aoap", jump=3.0)


def test_a_part_that_is_missing_fails_with_the_near_match() -> None:
    with pytest.raises(UnknownPartError, match="Did you mean 'coverage'"):
        evaluate(evaluation(), "aoap.coverag + 1")


def test_a_failure_names_the_objective() -> None:
    def fails(view: Any) -> float:
        raise ObjectiveError("nothing to see")

    own = Objective("own", fails, "Own")
    score = evaluate(evaluation(), combined(Expression.parse("own + aoap"), {"own": own}))
    assert score.failure == "Own: nothing to see"


def test_names_and_expressions_are_resolved() -> None:
    assert objective_of(" AOAP ") is find("aoap")
    assert objective_of("'aoap'") is find("aoap")
    assert [each.name for each in resolve(["2to3pw", "aoap+coverage"])] == [
        "2to3pw",
        "aoap + coverage",
    ]
    with pytest.raises(ObjectiveError, match="named twice"):
        resolve(["aoap + coverage", "aoap+coverage"])
    with pytest.raises(ObjectiveError, match="Did you mean 'aoap'"):
        resolve("aop*2")
    assert named_in(["aoap + coverage", "aoap", "own.py:score"]) == [
        "aoap",
        "coverage",
        "own.py:score",
    ]


def test_a_search_maximises_the_negative_of_what_should_be_low() -> None:
    goal = goal_of("distortion")
    assert goal.name == "-distortion"
    assert not goal.lower_is_better
    assert evaluate(evaluation(), goal).value == -evaluate(evaluation(), "distortion").value
    assert goal_of("aoap") is find("aoap")
    assert goal_of("reading.mean_of_places").name == "-reading.mean_of_places"
    assert goal_of("-reading.mean_of_places").name == "-reading.mean_of_places"
    assert goal_of("aoap.coverage").name == "aoap.coverage"
    own = Objective("own", lambda view: 2.0, "Own", lower_is_better=True)
    assert evaluate(evaluation(), goal_of(own)).value == -2.0


def test_rays_only_is_known_without_running_files() -> None:
    assert are_rays_only(["aoap + coverage", "2to3pw"])
    assert not are_rays_only(["aoap + rgb2normal"])
    assert not are_rays_only(["missing.py:score"])
