"""Parser of parameters and errors in one line, as the command line takes them.

```text
vary  = PATH "=" range [ "/" NAME "=" VALUE ]... [ "/together" ]
range = LOW ":" HIGH [ ":" STEPS ]      between two bounds
      | "+-" REACH [ ":" STEPS ]        a distance to either side of the present value
      | NAME "," NAME [ "," NAME ]...   one of several
```

For the points of a cage: `/symmetry=x`, `/axes=xz`, `/points=0,2,6-8`. For a path with a star:
`/together`. Manufacturing errors are written PATH=SIZE (see `parse_errors`).
"""

from __future__ import annotations

import re
from typing import Any

from optisense.design.yaml_reader import parse_yaml
from optisense.errors import SearchError
from optisense.near import suggestion
from optisense.search.space.manufacturing import ManufacturingErrors, ToleranceDistribution
from optisense.search.space.parameters import (
    Around,
    CagePoints,
    Choice,
    Continuous,
    Specification,
    Together,
)
from optisense.text import brief

EXAMPLE = "Write PATH=LOW:HIGH, such as coating.specularity=0:1, or PATH=NAME,NAME"
OPTIONS = ("symmetry", "axes", "points")
TOGETHER = "together"


def parse_vary(text: str) -> tuple[str, Specification]:
    """Parse the path and the specification of a parameter; SearchError if the text can't be read,
    or if its bounds are invalid.
    """
    path, equals, rest = (part.strip() for part in text.partition("="))
    if not equals or not path or not rest:
        raise SearchError(f"'{text}' is not a parameter and its range", hint=EXAMPLE)
    given, *extra = (part.strip() for part in rest.split("/"))
    try:
        spec = _range(given)
        if extra == [TOGETHER] and not isinstance(spec, CagePoints | Together):
            return path, Together(spec)
        return path, (_points(spec, extra) if extra else spec)
    except SearchError as error:
        raise SearchError(error.message, where=path, hint=error.hint or EXAMPLE) from None


def parse_space(texts: list[str]) -> dict[str, Specification]:
    """Parse several parameters, by path; SearchError if two have the same path."""
    found: dict[str, Specification] = {}
    for text in texts:
        path, spec = parse_vary(text)
        if path in found:
            raise SearchError(f"'{path}' is varied twice")
        found[path] = spec
    return found


def parse_errors(texts: list[str]) -> ManufacturingErrors:
    """Parse manufacturing errors: PATH=SIZE is a standard deviation, PATH=+-LIMIT a limit."""
    found: dict[str, ToleranceDistribution] = {}
    for text in texts:
        path, equals, size = (part.strip() for part in text.partition("="))
        if not equals or not path or not size:
            raise SearchError(f"'{text}' is not a manufacturing error", hint="Write PATH=SIZE")
        if path in found:
            raise SearchError(f"'{path}' has two manufacturing errors")
        limit = re.fullmatch(r"(?:\+-|\+/-|±)(.+)", size)
        try:
            found[path] = (
                ToleranceDistribution(_number(limit[1]), "uniform")
                if limit
                else ToleranceDistribution(_number(size))
            )
        except SearchError as error:
            raise SearchError(error.message, where=path, hint=error.hint) from None
    return ManufacturingErrors(found)


def _range(text: str) -> Specification:
    if text.startswith("["):
        return Choice(_options(text))
    around = re.fullmatch(r"(?:\+-|\+/-|±)([^:]+)(?::(.*))?", text)
    if around is not None:
        return Around(_number(around[1]), _steps(around[2]))
    if "," in text:
        return Choice([_scalar(part) for part in text.split(",")])
    if ":" in text:
        low, high, *steps = text.split(":")
        if len(steps) > 1:
            raise SearchError(f"'{text}' has too many colons")
        return Continuous(_number(low), _number(high), _steps(steps[0] if steps else None))
    raise SearchError(f"'{text}' is neither a range nor a list")


def _points(spec: Specification, extra: list[str]) -> CagePoints:
    if not isinstance(spec, Continuous | Around):
        raise SearchError("control points take a range of numbers")
    fields: dict[str, Any] = {}
    for part in extra:
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if name not in OPTIONS or not equals:
            raise SearchError(
                f"'/{part}' is not known", hint=suggestion(name, OPTIONS) or "Write /symmetry=x"
            )
        fields[name] = _indices(value) if name == "points" else value
    return CagePoints(spec, **fields)


def _indices(text: str) -> tuple[int, ...]:
    """Parse indices: 0,2,6-8 gives (0, 2, 6, 7, 8)."""
    found: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,5})\s*(?:-\s*(\d{1,5})\s*)?", part)
        if match is None:
            raise SearchError(f"'{text}' are not indices", hint="Write them like 0,2,6-8")
        found += range(int(match[1]), int(match[2] or match[1]) + 1)
    return tuple(found)


def _options(text: str) -> list[Any]:
    try:
        data, _ = parse_yaml(f"options: {text}", "the options", SearchError)
    except SearchError as error:
        raise SearchError(f"'{brief(text)}' is not a list: {error.message}") from None
    options = data.pop("options")
    if data or not isinstance(options, list):
        raise SearchError(f"'{brief(text)}' is not a list")
    return options


def _scalar(text: str) -> Any:
    """Return a number if the text is one, else the text itself."""
    word = text.strip()
    if not word:
        raise SearchError("an option is empty")
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            pass
    return word


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise SearchError(f"'{text.strip()}' is not a number") from None


def _steps(text: str | None) -> int | None:
    if text is None:
        return None
    try:
        return int(text)
    except ValueError:
        raise SearchError(f"'{text.strip()}' is not a number of steps") from None
