"""Kinds of other packages are found by their entry points and used through their methods."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.typing import ArrayLike
from pydantic import Field

from optisense import sensors
from optisense.array_types import FloatArray
from optisense.design import LightGroup, LightModel, check_design, load_design, save_design
from optisense.design.emitters import SpotEmitter
from optisense.design.fields import Positive
from optisense.errors import DesignError

COSINE_POWER = '''"""A lamp of another package."""

from typing import Literal

import numpy as np

from optisense.design import LightModel
from optisense.design.fields import Positive


class CosinePower(LightModel):
    """A point whose intensity falls with a power of the cosine."""

    kind: Literal["cosine-power"] = "cosine-power"
    power: Positive

    def relative_intensity(self, polar, azimuth=0.0):
        cosine = np.cos(np.radians(np.minimum(polar, 90.0)))
        return np.maximum(cosine, 0.0) ** self.power + 0.0 * np.asarray(azimuth)
'''


def installed(folder: Path, group: str, name: str, target: str, code: str) -> dict[str, str]:
    """The environment of a process that has a package installed with one entry point."""
    module = target.split(":")[0]
    (folder / f"{module}.py").write_text(code)
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{group}]\n{name} = {target}\n")
    return {**os.environ, "PYTHONPATH": str(folder)}


def python(code: str, environment: dict[str, str]) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_kind_of_an_installed_package_is_in_files_and_its_table_has_its_closed_form(
    tmp_path: Path,
) -> None:
    packages = tmp_path / "packages"
    packages.mkdir()
    environment = installed(
        packages, "optisense.emitters", "cosine-power", "our_lamps:CosinePower", COSINE_POWER
    )
    code = f"""
import json
from optisense import sensors
from optisense.design import load_design, save_design
design = sensors.load("builtin:gelsight-mini-ideal")
group = next(iter(design.lights.values()))
group.emitter = {{"kind": "cosine-power", "power": 4.0}}
save_design(design, {str(tmp_path / "sensor")!r})
lamp = next(iter(load_design({str(tmp_path / "sensor")!r}).lights.values())).emitter
print(json.dumps([type(lamp).__module__, lamp.power, lamp.half_angle(), lamp.in_words()]))
"""
    module, power, half, words = json.loads(python(code, environment))
    assert (module, power) == ("our_lamps", 4.0)
    assert half == pytest.approx(np.degrees(np.arccos(0.5**0.25)), abs=0.01)
    assert words == f"cosine-power, half at {half:.3g} degrees"


def test_without_the_package_the_design_is_refused_with_the_kinds_that_are_known(
    tmp_path: Path,
) -> None:
    design = sensors.load("builtin:gelsight-mini-ideal")
    next(iter(design.lights.values())).emitter = SpotEmitter(beam=10.0, cutoff=20.0)
    save_design(design, tmp_path / "sensor")
    file = tmp_path / "sensor" / "design.yaml"
    file.write_text(file.read_text().replace("kind: spot", "kind: spott"))
    with pytest.raises(DesignError, match="unknown kind 'spott' at 'lights") as caught:
        load_design(tmp_path / "sensor")
    assert "spot" in str(caught.value.hint)
    with pytest.raises(DesignError, match="no kind of emitter 'spott'"):
        LightModel.kinds.find("spott")


def test_a_package_that_cannot_be_imported_is_named(tmp_path: Path) -> None:
    environment = installed(
        tmp_path, "optisense.emitters", "broken", "our_broken:Lamp", "import nowhere_to_be_found"
    )
    code = """
from optisense.design import LightModel
from optisense.errors import DesignError
try:
    LightModel.kinds.find("broken")
except DesignError as error:
    print(error.message, error.where)
"""
    told = python(code, environment)
    assert "'broken'" in told and "our_broken:Lamp" in told and "nowhere_to_be_found" in told


def test_two_kinds_of_one_name_are_refused() -> None:
    with pytest.raises(DesignError, match="already a kind of emitter 'spot'"):

        class Other(LightModel):
            kind: Literal["spot"] = "spot"

    assert LightModel.kinds.find("spot") is SpotEmitter


class Ring(LightModel):
    """A lamp that shines to a cone's surface, more to one side; its sum may be wrong."""

    kind: Literal["test-ring"] = "test-ring"
    angle: Positive = Field(default=50.0, le=80.0)
    sign: float = 1.0

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        ring = np.exp(-(((np.asarray(polar, float) - self.angle) / 5.0) ** 2))
        side = 1.0 + 0.5 * np.cos(np.radians(np.asarray(azimuth, float)))
        return np.asarray(self.sign * ring * side / 1.5)


@pytest.mark.parametrize("angle", [10.0, 50.0, 75.0])
def test_the_table_of_any_kind_is_its_intensity(angle: float) -> None:
    ring = Ring(angle=angle)
    random = np.random.default_rng(1)
    polar, azimuth = random.uniform(0.0, 180.0, 2000), random.uniform(0.0, 360.0, 2000)
    table = ring.intensity()
    wanted = ring.relative_intensity(polar, azimuth)
    np.testing.assert_allclose(table.at(polar, azimuth), wanted, atol=1e-3)
    assert len(table.azimuth) > 1


def test_a_narrow_beam_is_not_lost_between_angles() -> None:
    class Pencil(LightModel):
        kind: Literal["test-pencil"] = "test-pencil"

        def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
            return np.asarray((np.asarray(polar) < 0.02) + 0.0 * np.asarray(azimuth))

    table = Pencil().intensity()
    assert table.at(np.array([0.015]), np.zeros(1)) == 1.0
    assert table.at(np.array([0.025]), np.zeros(1)) == 0.0
    assert len(table.azimuth) == 1  # symmetric about its axis


def test_an_intensity_below_zero_is_a_problem_of_the_design() -> None:
    design = sensors.load("builtin:gelsight-mini-ideal")
    name = next(iter(design.lights))
    group = LightGroup.model_validate(
        {**design.lights[name].model_dump(), "emitter": Ring(sign=-1.0)}
    )
    design.lights[name] = group
    found = [problem for problem in check_design(design) if "test-ring" in problem.message]
    assert [problem.severity for problem in found] == ["error"]
