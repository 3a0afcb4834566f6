"""Kinds in requests: what front ends learn of them is what the models refuse and accept."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from optisense.design import AreaEmitter, Role
from optisense.design.emitters import LightModel
from optisense.design.lenses import LensBlur, LensDistortion, LensShading
from optisense.design.materials import CoatingModel, Material
from optisense.design.responses import CameraResponse, ToneCurve

NOUNS = {
    "emitter": LightModel,
    "material": Material,
    "coating": CoatingModel,
    "response": CameraResponse,
    "distortion": LensDistortion,
    "shading": LensShading,
    "blur": LensBlur,
    "tone_curve": ToneCurve,
}


def test_all_kinds_and_their_fields_are_told(engine: Any) -> None:
    told = engine.ask("kinds")["kinds"]
    assert set(told) == set(NOUNS)
    for noun, model in NOUNS.items():
        kinds = [model.kinds.find(name) for name in model.kinds.names()]
        assert len(told[noun]) == sum("optisense." in kind.__module__ for kind in kinds)
        for row in told[noun]:
            shown = {field["name"] for field in row["fields"]}
            own = set(model.kinds.find(row["name"]).model_fields)
            assert shown == own - {"kind", "library", "lambertian"}
            assert row["summary"] and row["title"]


def test_bounds_are_those_that_the_models_hold(engine: Any) -> None:
    """A value at a bound is taken, one beyond it refused."""
    spot = next(row for row in engine.ask("kinds")["kinds"]["emitter"] if row["name"] == "spot")
    cutoff = next(field for field in spot["fields"] if field["name"] == "cutoff")
    assert (cutoff["above"], cutoff["maximum"], cutoff["unit"]) == (0.0, 90.0, "degrees")
    light = {"kind": "spot", "beam": 5.0, "cutoff": cutoff["maximum"]}
    assert engine.ask("lamp", value=light)["window"] is None
    refused = engine.refused("lamp", value={**light, "cutoff": cutoff["maximum"] + 0.1})
    assert "cutoff" in refused["message"] and "90" in refused["message"]


def test_values_to_begin_with_are_valid(engine: Any) -> None:
    told = engine.ask("kinds")["kinds"]
    for noun in ("emitter", "material"):
        for row in told[noun]:
            start = {f["name"]: f["start"] for f in row["fields"] if not f["absent"]}
            if None not in start.values():
                kind = NOUNS[noun].kinds.find(row["name"])
                assert kind.model_validate({"kind": row["name"], **start}).kind == row["name"]


def test_roles_name_the_materials_that_a_part_can_be_made_of(engine: Any) -> None:
    fitting = engine.ask("kinds")["materials_of_role"]
    assert fitting[Role.SENSING_SURFACE] == []
    assert fitting[Role.ELASTOMER] == fitting[Role.SUPPORT] == ["dielectric"]
    assert set(fitting[Role.MIRROR]) == {"conductor", "diffuse"}


def test_a_lamp_is_told_as_it_is_drawn(engine: Any) -> None:
    disc = AreaEmitter(size=(2.0, 2.0))
    told = engine.ask("lamp", value=disc.model_dump(mode="json"))
    assert told["window"] == {"shape": "disc", "size": [2.0, 2.0]}
    assert told["half_angle"] == pytest.approx(60.0, abs=0.01)
    lens = engine.ask("lamp", entry="round-5mm-30")
    assert lens["window"] is None and np.isclose(lens["half_angle"], 15.0, atol=1.0)
    assert "'kind'" in engine.refused("lamp", value={"size": [1.0, 1.0]})["message"]
    refused = engine.refused("lamp", value={"kind": "spot", "cutoff": 20.0, "beam": 30.0})
    assert (refused["message"], refused["where"]) == ("beam can't be wider than cutoff", "value")
