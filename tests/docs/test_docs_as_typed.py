"""Everything that README and docs show to type works, typed page by page and block by block.

`python` and `optisense` are forks of one process. On the pages that activate an environment
themselves, they are the real ones until it is seen that the activated ones start. `make
docs-as-typed` types with the real ones, also the blocks that take minutes.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner
from warm_python import programs

from optisense.cli import app
from paper.__main__ import app as paper_app

from .markdown import RUN, Block, blocks, code_spans
from .terminal import Outcome, Terminal, reader_environment

ROOT = Path(__file__).parents[2]
PROGRAMS = Path(sys.executable).parent
"""Folder of the programs of the tests' environment."""
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCKS = {page: blocks(page) for page in PAGES}

IN_THE_CLONE = (
    "README.md",
    "case-studies.md",
    "experiments.md",
    "install.md",
    "your-sensor.md",
)
"""Pages that say that their commands are typed in the folder of the clone."""
ACTIVATING = ("README.md",)
"""Pages that activate the virtual environment themselves."""
ACTIVATE = ". .venv/bin/activate"
"""How they do."""
ACTIVATED = """\
set -e
for each in optisense python; do [ "$(command -v $each)" -ef .venv/bin/$each ]; done
optisense --version
python -c 'import optisense'
"""
"""Commands that fail unless the programs of the activated environment are found and start."""
CLONED = (
    "Makefile",
    "README.md",
    "docs",
    "examples",
    "paper",
    "pyproject.toml",
    "requirements*.lock",
    "scripts",
)
"""Files of a clone that these pages use. The package itself is the one under test."""

LIMIT = 1200.0
"""Longest time (s) of a command or Python block. The slowest takes 10 s on two processors, so that
only a block that hangs takes so long."""
LONG_LIMIT = 6 * 3600.0
"""The same for blocks that say that they are long, of which the longest one takes an hour."""

TIME = re.compile(r"\b(seconds|minutes?|an hour|hours)\b")
"""How a page says how long something takes."""
COMMAND = re.compile(r"^(\$ )?(optisense|make|python3?|pip|conda|docker|\.|export) ", re.MULTILINE)
"""A line of a block that begins as a command of the shell does."""
NAMES_AN_OPTION = re.compile(r"\.\.\.| --\S+$")
"""Code that names an option or several commands and is no whole command: `optisense task ...`."""


WITH_SUBCOMMANDS = ("cage", "library", "task")
"""Commands of `optisense` whose next word is a command, too."""


def typed(page: Path) -> list[Block]:
    """The blocks that a test types or saves."""
    return [
        block
        for block in BLOCKS[page]
        if block.save or (block.language in RUN and block.not_run is None)
    ]


def ids(page: Path) -> str:
    return page.stem


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if typed(page)], ids=ids)
def test_a_page_works_as_typed(page: Path, tmp_path: Path) -> None:
    type_page(page, [block for block in typed(page) if not block.long], tmp_path, programs())


@pytest.mark.long
@pytest.mark.parametrize(
    "page", [page for page in PAGES if any(block.long for block in BLOCKS[page])], ids=ids
)
def test_a_page_works_as_typed_with_its_long_commands(page: Path, tmp_path: Path) -> None:
    type_page(page, typed(page), tmp_path, PROGRAMS)


def test_a_long_block_says_how_long_it_takes_and_has_a_quick_variant() -> None:
    """A page, this one or another, types the same command with options that take seconds."""
    quick = [block for page in PAGES for block in typed(page) if not block.long]
    for page, shown in BLOCKS.items():
        lines = page.read_text(encoding="utf-8").splitlines()
        for block in (each for each in shown if each.long):
            assert TIME.search(around(lines, block)), f"{block.place}: say how long it takes"
            assert any(verbs(each) & verbs(block) for each in quick), f"{block.place}: type it, too"


def test_a_saved_file_is_named_in_the_text_beside_its_block() -> None:
    for page, shown in BLOCKS.items():
        lines = page.read_text(encoding="utf-8").splitlines()
        for block in shown:
            if block.save is not None:
                before = " ".join(lines[max(block.line - 6, 0) : block.line - 1])
                assert f"`{block.save}`" in before, block.place


def test_commands_stand_in_console_blocks() -> None:
    """Blocks outside these pages would not be tested."""
    for shown in BLOCKS.values():
        for block in shown:
            found = COMMAND.search(block.text)
            assert block.language == "console" or not found, f"{block.place}: {found}"


def test_commands_that_are_not_typed_exist_with_their_options() -> None:
    """Of blocks that are not run or long, and of commands within sentences and tables."""
    commands = [
        (block.place, command)
        for shown in BLOCKS.values()
        for block in shown
        if block.long or block.not_run is not None
        for command in block.commands
    ]
    commands += [
        (page.name, span)
        for page in PAGES
        for span in code_spans(page)
        if not NAMES_AN_OPTION.search(span)
    ]
    for start, program, least in (("optisense ", app, 20), ("python -m paper ", paper_app, 5)):
        checked = [each for each in commands if each[1].startswith(start)]
        assert len(checked) > least
        # The arguments of all mentions of a command are given at once: --help prints it only if it
        # exists and has all the options, whatever their values, and takes time to print.
        mentions: dict[tuple[str, ...], list[str]] = defaultdict(list)
        places: dict[tuple[str, ...], list[str]] = defaultdict(list)
        for place, command in checked:
            words = shlex.split(command.removeprefix(start), comments=True)
            named = tuple(words[: 2 if words[0] in WITH_SUBCOMMANDS else 1])
            mentions[named] += words[len(named) :]
            places[named].append(place)
        for named, words in mentions.items():
            result = CliRunner().invoke(program, [*named, *words, "--help"])
            assert result.exit_code == 0, f"{places[named]}: {result.output}"


def type_page(page: Path, shown: list[Block], work: Path, programs: Path) -> None:
    """Type the blocks in the folder of a clone, or in an empty one, as the page says.

    `programs` has the programs that the shell finds first, before those of the tests' environment.
    """
    folder = work / "folder"
    folder.mkdir()
    if page.name in IN_THE_CLONE:
        clone(folder)
    environment = reader_environment(work / "own")
    found = [each for each in environment["PATH"].split(os.pathsep) if each != str(PROGRAMS)]
    if page.name not in ACTIVATING:
        found[:0] = [str(programs), str(PROGRAMS)]
    environment["PATH"] = os.pathsep.join(found)
    with Terminal(folder, environment) as terminal:
        for block in shown:
            for command, outcome in type_block(block, terminal):
                print(f"{block.place}: {outcome.seconds:5.1f} s  {command.splitlines()[0]}")
                assert outcome.exit_code == block.exit_code, (
                    f"{block.place}: {command}\nexit code {outcome.exit_code}, "
                    f"not {block.exit_code}\n{outcome.output[-4000:]}"
                )
                if command == ACTIVATE:
                    started = terminal.type(ACTIVATED, limit=LIMIT)
                    assert started.exit_code == 0, started.output
                    terminal.type(f'PATH="{programs}:$PATH"', limit=LIMIT)


def clone(folder: Path) -> None:
    """Copy what pages use of a clone, with the virtual environment that the tests run in.

    The environment is complete: make must not set it up anew for this copy. So the files are old.
    """
    assert (Path(sys.prefix) / ".set-up").exists(), "make sets up the environment of the tests"
    for source in (source for name in CLONED for source in ROOT.glob(name)):
        (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / source.name)
    for file in folder.rglob("*"):
        os.utime(file, (0, 0))
    (folder / ".venv").symlink_to(sys.prefix)


def type_block(block: Block, terminal: Terminal) -> Iterator[tuple[str, Outcome]]:
    """Each command of a block, or its text, and how it ended."""
    limit = LONG_LIMIT if block.long else LIMIT
    if block.save is not None:
        (terminal.folder / block.save).write_text(block.text, encoding="utf-8")
    elif block.language == "python":
        yield block.text, terminal.type_python(block.text, block.place, limit=limit)
    else:
        for command in block.commands:
            yield command, terminal.type(command, enter=block.enter, limit=limit)


def verbs(block: Block) -> set[str]:
    """The commands of a block without their arguments, such as ``optisense search``."""
    return {" ".join(command.split()[:2]) for command in block.commands}


def around(lines: list[str], block: Block) -> str:
    """The text from four lines before a block to eight lines after its end."""
    first = block.line - 1
    last = first + len(block.text.splitlines()) + 2
    return " ".join([*lines[max(first - 4, 0) : first], *lines[last : last + 8]])
