"""Blocks of a page are found in order, with what their fences say."""

from __future__ import annotations

from pathlib import Path

import pytest

from .markdown import Block, blocks, code_spans


def shown(folder: Path, text: str) -> list[Block]:
    page = folder / "page.md"
    page.write_text(text, encoding="utf-8")
    return blocks(page)


def test_blocks_come_in_order_with_their_places(tmp_path: Path) -> None:
    page = "# Page\n\n```console\n$ one\n```\n\n- item:\n\n  ```python\n  two = 2\n  ```\n"
    first, second = shown(tmp_path, page)
    assert (first.language, first.text, first.place) == ("console", "$ one\n", "page.md:3")
    assert (second.language, second.text, second.place) == ("python", "two = 2\n", "page.md:9")


def test_a_fence_within_a_longer_fence_is_text(tmp_path: Path) -> None:
    (only,) = shown(tmp_path, "````text\n```console\n$ not a command\n```\n````\n")
    assert only.language == "text"


def test_commands_are_the_lines_with_a_prompt(tmp_path: Path) -> None:
    (block,) = shown(
        tmp_path, "```console\n$ first --long \\\n    option\nits output\n$ second\n```\n"
    )
    assert block.commands == ["first --long \\\n    option", "second"]


def test_a_fence_says_how_its_block_is_run(tmp_path: Path) -> None:
    text = (
        "```console exit=2\n$ a\n```\n```console long\n$ b\n```\n```console enter\n$ c\n```\n"
        '```console not-run="opens a window"\n$ d\n```\n'
        "```python save=rules.py\ne\n```\n```\nf\n```\n"
    )
    fails, long, asks, opens, saved, plain = shown(tmp_path, text)
    assert fails.exit_code == 2 and plain.exit_code == 0
    assert long.long and not fails.long
    assert asks.enter and not fails.enter
    assert opens.not_run == "opens a window" and fails.not_run is None
    assert saved.save == "rules.py" and plain.save is None


@pytest.mark.parametrize("words", ["lnog", "exit", "not-run", "not-run=", "long=yes", "save"])
def test_a_fence_that_is_not_understood_is_an_error(tmp_path: Path, words: str) -> None:
    with pytest.raises(ValueError, match=r"page\.md:1: .* is not understood"):
        shown(tmp_path, f"```console {words}\n$ a\n```\n")


def test_code_in_sentences_and_tables_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("Type `one`.\n\n| a |\n|---|\n| `two` |\n\n```\nthree\n```\n", encoding="utf-8")
    assert code_spans(page) == ["one", "two"]
