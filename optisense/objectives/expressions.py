"""Arithmetic with scores, such as ``aoap + 0.5 * coverage``: a small language, read without `eval`.

```text
sum      = product (("+" | "-") product)*
product  = sign (("*" | "/") sign)*
sign     = ("-" | "+") sign | value
value    = number | quantity | function "(" sum ("," sum)* ")" | "(" sum ")"
quantity = objective ["." part]
function = "min" | "max" | "abs" | "sqrt"
```

The name of an objective with other characters than letters, digits and underscores is quoted.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from optisense.errors import ObjectiveError

MOST_CHARACTERS = 500
"""Largest length of an expression in characters: more than anybody writes by hand."""

MOST_BRACKETS = 50
"""Largest number of brackets, functions and signs inside one another, which keeps the parser far
below Python's limit of recursion."""

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.]))"
    r"|(?P<name>\w+(?:\.[A-Za-z_]\w*)?)"
    r"|(?P<quoted>'[^']*'(?:\.[A-Za-z_]\w*)?|\"[^\"]*\"(?:\.[A-Za-z_]\w*)?)"
    r"|(?P<sign>[-+*/(),]))"
)

_OPERATORS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}

_FUNCTIONS: dict[str, Callable[..., float]] = {
    "min": min,
    "max": max,
    "abs": abs,
    "sqrt": math.sqrt,
}

_SEVERAL = ("min", "max")

SUM, PRODUCT, SIGN, VALUE = 1, 2, 3, 4
"""Precedence of operations: a weaker operation inside a stronger one is put in brackets."""


@dataclass(frozen=True)
class ScoreTerm:
    """The value of an objective, or one of its parts.

    Attributes:
        objective: its name.
        part: the name of the number; empty for the value itself.
    """

    objective: str
    part: str = ""

    def __str__(self) -> str:
        plain = re.fullmatch(r"\w+", self.objective)
        quote = '"' if "'" in self.objective else "'"
        name = self.objective if plain else f"{quote}{self.objective}{quote}"
        return f"{name}.{self.part}" if self.part else name


@dataclass(frozen=True)
class _Term:
    """A node of the tree: the function of its value, its text, and the text's precedence."""

    value: Callable[[Mapping[ScoreTerm, float]], float]
    text: str
    strength: int

    def within(self, strength: int) -> str:
        """Return the text as an operand of an operation, in brackets if that binds stronger."""
        return f"({self.text})" if self.strength < strength else self.text


@dataclass(frozen=True)
class Expression:
    """Arithmetic with the values of objectives.

    Attributes:
        text: the expression with standard spacing; equal expressions have equal texts.
        quantities: the quantities that it is computed from, each once, in the order of the text.
    """

    text: str
    quantities: tuple[ScoreTerm, ...]
    _tree: _Term = field(repr=False, compare=False)

    def __reduce__(self) -> tuple[Callable[[str], Expression], tuple[str]]:
        """Pickle the expression as its text."""
        return _parsed, (self.text,)

    @property
    def objectives(self) -> tuple[str, ...]:
        """The names of its objectives, each once."""
        return tuple(dict.fromkeys(each.objective for each in self.quantities))

    @property
    def single(self) -> ScoreTerm | None:
        """The quantity that the expression consists of; None for anything else."""
        same = len(self.quantities) == 1 and str(self.quantities[0]) == self.text
        return self.quantities[0] if same else None

    def value(self, known: Mapping[ScoreTerm, float]) -> float:
        """The value of the expression.

        Args:
            known: the value of each quantity.

        Raises:
            ObjectiveError: the expression divides by zero, or takes the root of a negative number.
        """
        try:
            return float(self._tree.value(known))
        except (ZeroDivisionError, ValueError, OverflowError) as error:
            raise ObjectiveError(f"'{self.text}' can't be computed: {error}") from error

    @staticmethod
    def parse(text: str) -> Expression:
        """Read an expression.

        Raises:
            ObjectiveError: the text is not an expression; the message marks the place.
        """
        if len(text) > MOST_CHARACTERS:
            raise ObjectiveError(
                f"an expression has {len(text):,} characters",
                hint=f"Write it with at most {MOST_CHARACTERS}",
            )
        return _parsed(text)


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    place: int


def marked(text: str, place: int, problem: str) -> ObjectiveError:
    """Return an error that shows a place of a text with a caret below it."""
    return ObjectiveError(
        f"{problem}:\n  {text}\n  {' ' * place}^",
        hint="Write it as in 'aoap + 0.5*coverage', with + - * / ( ) min max abs sqrt",
    )


def _parsed(text: str) -> Expression:
    """Read an expression of any length, as standard spacing may lengthen a given text."""
    return _Parser(text).expression()


class _Parser:
    """A recursive-descent parser of one expression."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = list(self._split(text))
        self._next = 0
        self._depth = 0
        self._found: dict[ScoreTerm, None] = {}

    def expression(self) -> Expression:
        """Parse the whole text."""
        tree = self._sum()
        token = self._peek()
        if token.kind != "end":
            raise self._error(token, f"'{token.text}' is not expected here")
        if not self._found:
            raise marked(self._text, 0, "the expression names no objective")
        return Expression(tree.text, tuple(self._found), tree)

    def _split(self, text: str) -> Iterator[_Token]:
        place = 0
        end = len(text.rstrip())
        while place < end:
            found = _TOKEN.match(text, place)
            if found is None:
                place += len(text[place:]) - len(text[place:].lstrip())
                raise marked(text, place, f"'{text[place]}' can't be read")
            kind = found.lastgroup or ""
            yield _Token(kind, found[kind], found.start(kind))
            place = found.end()
        yield _Token("end", "", end)

    def _peek(self) -> _Token:
        return self._tokens[self._next]

    def _take(self, *signs: str) -> _Token | None:
        token = self._peek()
        if token.kind != "sign" or token.text not in signs:
            return None
        self._next += 1
        return token

    def _error(self, token: _Token, problem: str) -> ObjectiveError:
        return marked(self._text, token.place, problem)

    def _sum(self) -> _Term:
        return self._chain(("+", "-"), self._product, SUM)

    def _product(self) -> _Term:
        return self._chain(("*", "/"), self._sign, PRODUCT)

    def _chain(self, signs: tuple[str, ...], inner: Callable[[], _Term], strength: int) -> _Term:
        """Parse operands of one precedence with operators between them, from left to right."""
        left = inner()
        while token := self._take(*signs):
            left = _operation(token.text, left, inner(), strength)
        return left

    def _sign(self) -> _Term:
        token = self._take("-", "+")
        if token is None:
            return self._value()
        self._deeper(token)
        inner = self._sign()
        self._depth -= 1
        if token.text == "+":
            return inner
        return _Term(lambda known: -inner.value(known), f"-{inner.within(SIGN)}", SIGN)

    def _value(self) -> _Term:
        if bracket := self._take("("):
            self._deeper(bracket)
            inner = self._sum()
            self._close()
            return inner
        token = self._peek()
        if token.kind == "end":
            raise self._error(token, "something is missing here")
        if token.kind == "sign":
            raise self._error(token, f"a number or an objective is missing before '{token.text}'")
        self._next += 1
        if token.kind == "number":
            number = float(token.text)
            if math.isinf(number):
                raise self._error(token, f"{token.text} is too large a number")
            return _Term(lambda known: number, repr(number).removesuffix(".0"), VALUE)
        if token.kind == "name" and self._take("("):
            if token.text not in _FUNCTIONS:
                raise self._error(token, f"there is no function '{token.text}'")
            return self._call(token)
        quantity = _quantity(token)
        self._found[quantity] = None
        return _Term(lambda known: known[quantity], str(quantity), VALUE)

    def _call(self, token: _Token) -> _Term:
        self._deeper(token)
        function = _FUNCTIONS[token.text]
        given = [self._sum()]
        while self._take(","):
            given.append(self._sum())
        self._close()
        if (len(given) > 1) != (token.text in _SEVERAL):
            wanted = "two numbers or more" if token.text in _SEVERAL else "one number"
            raise self._error(token, f"'{token.text}' takes {wanted}")
        text = f"{token.text}({', '.join(each.text for each in given)})"
        return _Term(lambda known: function(*(each.value(known) for each in given)), text, VALUE)

    def _close(self) -> None:
        if self._take(")") is None:
            raise self._error(self._peek(), "a ')' is missing")
        self._depth -= 1

    def _deeper(self, token: _Token) -> None:
        self._depth += 1
        if self._depth > MOST_BRACKETS:
            raise self._error(token, f"more than {MOST_BRACKETS} brackets are inside one another")


def _operation(sign: str, left: _Term, right: _Term, strength: int) -> _Term:
    compute = _OPERATORS[sign]
    space = " " if strength == SUM else ""
    text = f"{left.within(strength)}{space}{sign}{space}{right.within(strength + 1)}"
    return _Term(lambda known: compute(left.value(known), right.value(known)), text, strength)


def _quantity(token: _Token) -> ScoreTerm:
    """Return the objective and the part that a name stands for."""
    if token.kind == "quoted":
        name, _, part = token.text[1:].rpartition(token.text[0])
        return ScoreTerm(name.strip().lower(), part.removeprefix("."))
    name, _, part = token.text.partition(".")
    return ScoreTerm(name.lower(), part)
