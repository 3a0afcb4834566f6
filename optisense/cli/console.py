"""Output of commands and their exit codes.

Results go to standard output, everything else to standard error, so that output can be piped.
"""

from __future__ import annotations

import functools
import json
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from optisense import starting
from optisense.cli.from_options import with_options
from optisense.errors import OutputError, OwnCodeError, SetupError
from optisense.own_code import as_user_error
from optisense.text import visible

if TYPE_CHECKING:
    from rich.table import Table

EXIT_FAILURE = 1
"""Exit code of a command that could not do its work although its input was right."""
EXIT_BAD_INPUT = 2
"""Exit code of a command whose input is wrong, as shells and Click use it for wrong usage."""
EXIT_INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 and the number of SIGINT, as shells count."""


class PlainConsole(Console):
    """Console for text that may come from a stranger: brackets in it are no markup, and control
    characters are printed as visible symbols.

    Colours and bars consist of control segments and styles, which are kept.
    """

    def __init__(self, **settings: Any) -> None:
        """See `rich.console.Console`."""
        super().__init__(markup=False, highlight=False, **settings)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        """See `rich.console.Console.render`."""
        for segment in super().render(renderable, options):
            if segment.control or segment.text.isprintable():
                yield segment
            else:
                yield Segment(visible(segment.text), segment.style)


output = PlainConsole(soft_wrap=True)
messages = PlainConsole(stderr=True, soft_wrap=True)


def print_notes(notes: Iterable[str]) -> None:
    """Print notes for the user, beside the results."""
    for note in notes:
        messages.print(f"note: {note}", style="yellow")


def print_json(values: Mapping[str, Any]) -> None:
    """Print a result as JSON; NaN and infinity, which JSON does not have, are a defect."""
    print(json.dumps(values, indent=2, allow_nan=False))


_P = ParamSpec("_P")
_R = TypeVar("_R")
_debug = False
_ending: ContextVar[ExitStack] = ContextVar("ending")
"""Callbacks that run when the command ends."""


def set_debug(debug: bool) -> None:
    """Set whether tracebacks of unexpected errors are shown from here on."""
    global _debug
    _debug = debug


def on_exit(call: Callable[[], object]) -> None:
    """Register a function that is called when the running command ends, however it ends."""
    _ending.get().callback(call)


def table_of(*heads: str, texts: int = 1) -> Table:
    """Return a table without lines; its first columns hold texts and the others numbers."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for number, head in enumerate(heads):
        table.add_column(head, justify="left" if number < texts else "right")
    return table


def print_error(message: str, *, where: str | None = None, hint: str | None = None) -> None:
    """Print an error: the problem, its place, and the remedy."""
    messages.print("error:", style="bold red", end=" ")
    messages.print(message)
    if where:
        messages.print(f"  where: {where}")
    if hint:
        messages.print(f"  try:   {hint}")


def handles_errors(command: Callable[_P, _R]) -> Callable[..., _R]:
    """Decorate a command so that errors of the user show no traceback.

    Parameters of the command that are models of options become options of the command line.

    Exit codes: 2 for bad input, 1 for a failure, 130 for Ctrl-C.
    """

    @functools.wraps(command)
    def run(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        try:
            starting.begin()
            with ExitStack() as ending:
                before = _ending.set(ending)
                ending.callback(_ending.reset, before)
                return command(*args, **kwargs)
        except KeyboardInterrupt:
            messages.print("interrupted")
            raise typer.Exit(EXIT_INTERRUPTED) from None
        except BrokenPipeError:
            # The reader of the pipe has closed it; keep Python from complaining at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(EXIT_FAILURE) from None
        except typer.Exit:
            raise
        except Exception as error:
            # Compiled packages return with Ctrl-C still to be raised, of which Python makes another
            # error.
            if isinstance(error.__cause__, KeyboardInterrupt):
                messages.print("interrupted")
                raise typer.Exit(EXIT_INTERRUPTED) from None
            # Typer prints usage errors itself; every other error is a defect, here or in own code.
            if type(error).__module__.split(".")[0] in ("click", "typer"):
                raise
            told = as_user_error(
                error,
                less_work="Use a smaller --resolution or fewer --photons",
                see="`optisense --debug ...`",
            )
            print_error(told.message, where=told.where, hint=told.hint)
            is_own = isinstance(told, OwnCodeError)
            if told is not error or is_own:
                _show_traceback()
            failure = told is not error or is_own or isinstance(told, (OutputError, SetupError))
            raise typer.Exit(EXIT_FAILURE if failure else EXIT_BAD_INPUT) from None

    return with_options(run)


def _show_traceback() -> None:
    if _debug:
        messages.print(traceback.format_exc())
