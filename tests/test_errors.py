"""Errors say what, where and what to do, also after a trip to another process."""

from __future__ import annotations

import pickle

from optisense.engine.failures import Cancelled, as_data
from optisense.errors import DesignError
from optisense.own_code import as_user_error


def test_the_text_has_message_place_and_hint() -> None:
    error = DesignError("the fov is 0", where="design.yaml:3", hint="Give degrees")
    assert str(error) == "the fov is 0 (design.yaml:3). Give degrees"
    assert str(DesignError("alone")) == "alone"


def test_an_error_survives_pickling() -> None:
    error = pickle.loads(pickle.dumps(DesignError("a", where="b", hint="c")))
    assert (type(error), str(error)) == (DesignError, "a (b). c")


def test_errors_of_any_kind_become_errors_for_the_user() -> None:
    def told(error: BaseException) -> str:
        found = as_user_error(error, less_work="Use less", see="the log")
        return f"{type(found).__name__}: {found}"

    own = DesignError("a", where="b")
    assert as_user_error(own, less_work="", see="") is own
    assert told(MemoryError()) == "SetupError: not enough memory. Use less"
    assert told(OSError(28, "full", "/x")) == (
        "OutputError: the disk is full (/x). Free some space and try again"
    )
    assert told(KeyError("k")) == (
        "OptiSenseError: unexpected KeyError: 'k'. This is a defect of OptiSense; the log shows "
        "where it is"
    )
    assert as_data(KeyError("k"))["kind"] == "InternalError"
    assert as_data(MemoryError())["kind"] == "SetupError"
    assert as_data(Cancelled())["kind"] == "Cancelled"
