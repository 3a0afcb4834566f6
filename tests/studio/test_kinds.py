"""Kinds come from the engine: menus, fields and bounds; files of before and of other machines."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import bpy
import pytest
from waiting import until

from studio.core import schema
from studio.engine import catalogue, session
from studio.scene import old_files
from studio.scene.gather import gather_document
from studio.scene.lamps import window

LAMP = '''"""A lamp of another package."""

from typing import Literal

import numpy as np
from pydantic import Field

from optisense.design import LightModel
from optisense.design.emitters import Window
from optisense.design.fields import Number


class CosinePower(LightModel):
    """An intensity that falls with a power of the cosine."""

    title = "Power of the cosine"

    kind: Literal["cosine-power"] = "cosine-power"
    power: Number = Field(default=4.0, ge=1.0, le=200.0, description="more is narrower")
    mode: Literal["even", "odd"] = "even"

    def relative_intensity(self, polar, azimuth=0.0):
        cosine = np.cos(np.radians(np.minimum(polar, 90.0)))
        return np.maximum(cosine, 0.0) ** self.power + 0.0 * np.asarray(azimuth)

    def window(self):
        return Window("rectangle", (3.0, 1.0))
'''


@pytest.fixture
def with_lamp(tmp_path: Path, mini: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A scene whose engine has a package with a kind of emitter installed."""
    (tmp_path / "our_lamps.py").write_text(LAMP)
    info = tmp_path / "our_lamps-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: our_lamps\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[optisense.emitters]\ncosine-power = our_lamps:CosinePower\n"
    )
    # An engine is started without the PYTHONPATH of Blender; this one has a package more.
    # A fork of a warm Python would not see the package.
    python = Path(__file__).parents[2] / ".venv" / "bin" / "python"
    started = ["env", f"PYTHONPATH={tmp_path}", str(python), "-m", "optisense.cli", "engine"]
    monkeypatch.setenv("OPTISENSE_ENGINE", shlex.join(started))
    session.restart()
    schema.learn({})
    catalogue.learn_kinds()
    yield mini
    monkeypatch.undo()
    session.restart()
    schema.learn({})
    catalogue.learn_kinds()


def test_a_kind_of_an_installed_package_is_chosen_changed_and_drawn(with_lamp: Any) -> None:
    group = with_lamp.optisense.light_groups["red"]
    group.emitter = "cosine-power"
    assert group.field_values() == {"power": 4.0, "mode": "even"}
    group.put("power", 500.0)
    assert group.value("power") == 200.0  # the class's bound
    group.put("mode", "odd")
    assert group.fields["mode"].choice == "odd"
    emitter = gather_document(with_lamp)["lights"]["red"]["emitter"]
    assert emitter == {"kind": "cosine-power", "power": 200.0, "mode": "odd"}
    until(lambda: window(group)[0] == "rectangle")
    shape, size, angle = window(group)
    assert (shape, size) == ("rectangle", (3.0, 1.0)) and angle == pytest.approx(4.77, abs=0.01)
    bpy.ops.optisense.check()
    assert not session.state().problem


def test_a_kind_that_no_engine_has_told_of_keeps_its_values(mini: Any) -> None:
    """A scene that was made on a machine with more packages."""
    values = {"kind": "comet", "tail": 3.5, "colours": [0.1, 0.2, 0.3], "deep": {"a": [1]}}
    group = mini.optisense.light_groups["red"]
    group.fill("comet", {name: each for name, each in values.items() if name != "kind"})
    assert group.emitter == "comet"
    emitter = gather_document(mini)["lights"]["red"]["emitter"]
    assert emitter == values
    bpy.ops.optisense.check()
    assert "comet" in session.state().problem


def test_a_number_stays_within_the_bounds_of_its_kind(mini: Any) -> None:
    catalogue.learn_kinds()
    gel = mini.optisense.materials["silicone-xp565"]
    for given, kept in ((9.0, 4.0), (0.2, 1.0), (1.43, 1.43)):
        gel.put("ior", given)
        assert gel.value("ior") == pytest.approx(kept)
    group = mini.optisense.light_groups["red"]
    group.emitter = "spot"
    group.put("cutoff", -3.0)
    assert 0.0 < group.value("cutoff") < 0.01
    assert bpy.ops.optisense.reset_field(path=group.fields["cutoff"].path_from_id()) == {"FINISHED"}
    assert group.value("cutoff") == 45.0


def test_roles_take_the_materials_that_the_engine_names(mini: Any) -> None:
    catalogue.learn_kinds()
    assert schema.materials_of("elastomer") == ["dielectric"]
    assert set(schema.materials_of("mirror")) == {"conductor", "diffuse"}


def test_values_of_files_from_before_become_fields(mini: Any) -> None:
    """Blender keeps the values of properties that are no more."""
    wanted = gather_document(mini)
    design = mini.optisense
    gel, group = design.materials["silicone-xp565"], design.light_groups["red"]
    coating = design.coating
    for name, value in coating.field_values().items():
        coating[name] = value
    for material in design.materials:
        values = material.field_values()
        material["kind"] = old_files.MATERIALS.index(material.kind_name)
        for name, value in values.items():
            material[name] = value
        material.fill("absorber", {})
    group["emitter"], group["beam"], group["cutoff"] = 3, 12.0, 30.0
    gel["ior"] = 1.47
    coating.fields.clear()
    old_files.bring_up_to_date(mini)
    after = gather_document(mini)
    assert after["lights"]["red"]["emitter"] == {"kind": "spot", "cutoff": 30.0, "beam": 12.0}
    assert after["materials"]["silicone-xp565"]["ior"] == 1.47
    assert after["coating"] == wanted["coating"]
    for name, values in wanted["materials"].items():
        assert after["materials"][name]["kind"] == values["kind"]
