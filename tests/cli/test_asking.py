"""Questions at a terminal: which answers mean which word."""

from __future__ import annotations

import io
import sys

import pytest

from optisense.cli.asking import ask_word

PARTS = ["Gel", "Acrylic-Window", "LED", "LED-2"]


@pytest.mark.parametrize(
    ("answer", "word"),
    [("acr", "Acrylic-Window"), ("Acr", "Acrylic-Window"), ("gel", "Gel"), ("led", "LED")],
)
def test_upper_and_lower_case_are_alike(
    monkeypatch: pytest.MonkeyPatch, answer: str, word: str
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(answer + "\n"))
    assert ask_word("Which", PARTS, "Gel") == word


def test_a_beginning_of_two_words_is_asked_again(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("le\nLED-2\n"))
    assert ask_word("Which", PARTS, "Gel") == "LED-2"
    assert "one of: LED, LED-2" in capfd.readouterr().err
