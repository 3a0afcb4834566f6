"""Ctrl-C at any moment of a render is Ctrl-C to the caller."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import pytest

from optisense import OpticalModel, load
from optisense.optics.backend.interrupts import reraise_interrupts
from optisense.optics.transport import interact


@pytest.mark.parametrize("step", ["sample_coating", "refract"])
def test_ctrl_c_while_a_loop_is_recorded(step: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(*args: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(interact, step, pressed)
    model = OpticalModel(load("gelsight-mini-ideal"), "llvm")
    with pytest.raises(KeyboardInterrupt):
        model.render(resolution=(40, 30), photons=10_000)


def test_other_errors_in_a_loop_stay_what_they_are() -> None:
    @reraise_interrupts
    @dr.syntax
    def count() -> mi.UInt32:
        number = mi.UInt32(0)
        while number < 3:
            number += 1
            raise ValueError("inside")
        return number

    with pytest.raises(RuntimeError, match="while_loop") as error:
        count()
    assert isinstance(error.value.__cause__, ValueError)
