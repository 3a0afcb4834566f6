"""Text of strangers does nothing to a terminal, a page or a spreadsheet but be read."""

from __future__ import annotations

import csv
import io
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.text import argument, cell, markdown, one_line, to_html, visible

EVIL = "a\x1b[2J\x1b]0;title\x07b\x00\x9bc\u202ed <script>alert(1)</script> | [x](http://x) =1+1"


@pytest.mark.parametrize("text", ["", "plain", "µm ± 0.5°, é, 中", "two\nlines\tand a tab"])
def test_plain_text_stays(text: str) -> None:
    assert visible(text) == text


def test_control_characters_are_shown() -> None:
    assert visible(EVIL).startswith(r"a\x1b[2J\x1b]0;title\x07b\x00\x9bc\u202ed <script>")
    assert visible("\ud800") == r"\ud800"
    assert one_line("a\n\n b\x0b") == "a b"


def test_html_is_text() -> None:
    found: list[str] = []

    class Tags(HTMLParser):
        def handle_starttag(self, tag: str, attrs: object) -> None:
            found.append(tag)

    Tags().feed(f'<p title="{to_html(EVIL)}">{markdown(EVIL)}</p>')
    assert found == ["p"]


def test_a_cell_is_no_formula() -> None:
    assert cell("=cmd()") == "'=cmd()"
    assert cell("plain = text") == "plain = text"


@pytest.fixture
def evil(tmp_path: Path) -> Path:
    """A design whose name, descriptions and sources are hostile."""
    design = ots.load("gelsight-mini-ideal")
    folder = tmp_path / "evil"
    ots.save_design(design, folder)
    file = folder / "design.yaml"
    quoted = '"' + "".join(f"\\u{ord(c):04x}" for c in EVIL) + '"'
    lines = file.read_text().splitlines()
    known = ("name:", "description:", "    source:")
    mended = [
        f"{line.split(':')[0]}: {quoted}" if line.startswith(known) else line for line in lines
    ]
    file.write_text("\n".join(mended) + "\n")
    assert ots.load(folder).name == EVIL
    return folder


def test_no_command_lets_it_through(evil: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    for words in (["check", evil], ["export", evil, "--out", out], ["cage", "list", evil]):
        result = CliRunner().invoke(app, [str(word) for word in words])
        assert "unexpected" not in result.output
        assert not set(result.output) & set("\x1b\x00\x07\x9b\u202e"), words
    bill = (out / "bill-of-materials.md").read_text()
    assert "<script" not in bill and not re.search(r"(?<!\\)\]\(", bill)
    assert not set(bill) & set("\x1b\x00\x07\x9b\u202e")
    for row in csv.reader(io.StringIO((out / "bill-of-materials.csv").read_text())):
        assert not any(each.startswith(("=", "@")) for each in row)


def test_a_path_with_control_characters_is_refused(evil: Path) -> None:
    file = evil / "design.yaml"
    file.write_text(file.read_text().replace("meshes/gel.obj", '"meshes/gel\\u001b.obj"'))
    result = CliRunner().invoke(app, ["check", str(evil)])
    assert result.exit_code == 2
    assert "without control characters" in result.output
    assert "\x1b" not in result.output


def test_a_name_in_a_command_is_one_argument_of_a_shell() -> None:
    assert argument(Path("studies/one")) == "studies/one"
    assert argument("my study's; rm") == """'my study'"'"'s; rm'"""
    assert argument("-dash") == "./-dash"
