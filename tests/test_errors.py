"""Errors say what, where and what to do, also after a trip to another process."""

from __future__ import annotations

import pickle

from optisense.errors import DesignError


def test_the_text_has_message_place_and_hint() -> None:
    error = DesignError("the fov is 0", where="design.yaml:3", hint="Give degrees")
    assert str(error) == "the fov is 0 (design.yaml:3). Give degrees"
    assert str(DesignError("alone")) == "alone"


def test_an_error_survives_pickling() -> None:
    error = pickle.loads(pickle.dumps(DesignError("a", where="b", hint="c")))
    assert (type(error), str(error)) == (DesignError, "a (b). c")
