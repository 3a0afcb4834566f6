"""Questions at a terminal: each has a default answer, and is repeated until the answer is valid."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

import typer

from optisense.cli.console import messages
from optisense.errors import OptiSenseError

T = TypeVar("T")

_NONE = ("", "-", "none")


def ask(question: str, read: Callable[[str], T], default: str | None = None) -> T:
    """Ask a question until `read` accepts the answer.

    Args:
        question: text of the question, without a mark at its end.
        read: function that converts the answer; it raises a ValueError, or an OptiSenseError, for
            an invalid one.
        default: answer for Enter; None requires an answer.

    Raises:
        KeyboardInterrupt: the user has pressed Ctrl-C.
    """
    while True:
        try:
            answer = typer.prompt(question, default=default, err=True)
        except typer.Abort:
            raise KeyboardInterrupt from None
        try:
            return read(str(answer).strip())
        except OptiSenseError as error:
            hint = f". {error.hint}" if error.hint else ""
            messages.print(f"  {error.message}{hint}", style="yellow")
        except ValueError as error:
            messages.print(f"  {error}", style="yellow")


def ask_word(question: str, words: Iterable[str], default: str) -> str:
    """Ask for one of several words; the beginning of a word suffices if it is unique, and upper and
    lower case are alike.
    """
    known = list(words)

    def read(answer: str) -> str:
        if answer in known:
            return answer
        given = answer.casefold()
        begun = [word for word in known if given and word.casefold().startswith(given)]
        same = [word for word in begun if word.casefold() == given]
        for fitting in (same, begun):
            if len(fitting) == 1:
                return fitting[0]
        raise ValueError("the answer must be one of: " + ", ".join(begun or known))

    return ask(question, read, default)


def ask_name(question: str, default: str, taken: Iterable[str] = ()) -> str:
    """Ask for the name of an object of the design; empty or '-' means none."""
    import re

    used = set(taken)

    def read(answer: str) -> str:
        if answer.lower() in _NONE:
            return ""
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}", answer):
            raise ValueError("a name consists of at most 64 letters, digits, '-' and '_'")
        if answer in used:
            raise ValueError(f"the name '{answer}' is in use")
        return answer

    return ask(question, read, default)


def ask_number(question: str, default: float, least: float = float("-inf")) -> float:
    """Ask for a number."""
    return ask(question, lambda answer: _number(answer, least), f"{default:g}")


def ask_number_or_none(
    question: str, least: float = float("-inf"), whole: bool = False
) -> float | None:
    """Ask for a number; None for an empty answer or '-'."""

    def read(answer: str) -> float | None:
        if answer.lower() in _NONE:
            return None
        value = _number(answer, least)
        if whole and value != int(value):
            raise ValueError("the answer must be a whole number")
        return value

    return ask(question, read, "-")


def ask_count(question: str, default: int) -> int:
    """Ask for a whole number from 1."""

    def read(answer: str) -> int:
        if not answer.isdecimal() or int(answer) < 1:
            raise ValueError("the answer must be a whole number, 1 or larger")
        return int(answer)

    return ask(question, read, str(default))


def ask_yes(question: str, default: bool) -> bool:
    """Ask for yes or no."""
    return ask_word(f"{question} (yes, no)", ("yes", "no"), "yes" if default else "no") == "yes"


def three_numbers(answer: str) -> tuple[float, float, float]:
    """Parse "x,y,z".

    Raises:
        ValueError: the text has another form.
    """
    words = answer.replace(",", " ").split()
    if len(words) != 3:
        raise ValueError("the answer must be three numbers: x, y, z")
    x, y, z = (_number(word) for word in words)
    return x, y, z


def _number(text: str, least: float = float("-inf")) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"'{text}' is not a number") from None
    if not abs(value) < float("inf"):
        raise ValueError(f"'{text}' is not finite")
    if value < least:
        raise ValueError(f"the number must be at least {least:g}")
    return value
