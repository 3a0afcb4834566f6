"""The tests run with the environment of an ordinary user."""

from __future__ import annotations

import os
import re
from pathlib import Path

MAKEFILE = Path(__file__).parents[1] / "Makefile"


def test_no_variable_is_set_that_an_ordinary_user_does_not_have() -> None:
    """Else tests pass or fail here for reasons that no user's machine has."""
    text = MAKEFILE.read_text(encoding="utf-8").replace("\\\n", " ")
    names = re.findall(r"^UNSET := *(.*)$", text, re.MULTILINE)[0].split()
    assert {"PYTHONDONTWRITEBYTECODE", "PYTHONUNBUFFERED"} <= set(names)
    present = [name for name in names if name in os.environ]
    assert not present, f"unset {', '.join(present)}, or type: make pytest"
