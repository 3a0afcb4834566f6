"""The contract of objectives, over all of the package, a user's file and an installed package."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from optisense.objectives import registry
from optisense.objectives.testing import ObjectiveContract

OWN = '''
import numpy as np
import optisense

@optisense.objective("{name}", title="Contrast")
def contrast(evaluation, *, percentile=95.0):
    """How far colours spread over the presses."""
    spread = [np.percentile(p.colours(p.mask), percentile) for p in evaluation.presses]
    return float(np.mean(spread)), {{"places": [float(each) for each in spread], "n": len(spread)}}
'''


class TestRgb2Normal(ObjectiveContract):
    objective = "rgb2normal"


class TestNormDiff(ObjectiveContract):
    objective = "normdiff"


class TestAoap(ObjectiveContract):
    objective = "aoap"


class TestProjectionWarping(ObjectiveContract):
    objective = "2to3pw"


class TestCoverage(ObjectiveContract):
    objective = "coverage"


class TestDistortion(ObjectiveContract):
    objective = "distortion"


class TestReading(ObjectiveContract):
    objective = "reading"


class TestDepth(ObjectiveContract):
    objective = "depth"


class TestSharpness(ObjectiveContract):
    objective = "sharpness"


class TestUniformity(ObjectiveContract):
    objective = "uniformity"


class TestShadow(ObjectiveContract):
    objective = "shadow"


class TestPower(ObjectiveContract):
    objective = "power"


class TestFromAFile(ObjectiveContract):
    @pytest.fixture(autouse=True)
    def own_file(self, tmp_path: Path) -> Iterator[None]:
        path = tmp_path / "own.py"
        path.write_text(OWN.format(name="contrast-of-file"))
        self.objective = str(path)
        yield
        registry.OBJECTIVES._registered.pop("contrast-of-file", None)


class TestFromAnInstalledPackage(ObjectiveContract):
    objective = "contrast-of-package"

    @pytest.fixture(autouse=True)
    def package(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
        (tmp_path / "contrast_scores.py").write_text(OWN.format(name=self.objective))
        info = tmp_path / "contrast_scores-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: contrast\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(
            f"[optisense.objectives]\n{self.objective} = contrast_scores:contrast\n"
        )
        monkeypatch.syspath_prepend(str(tmp_path))
        yield
        registry.OBJECTIVES._registered.pop(self.objective, None)
        import sys

        sys.modules.pop("contrast_scores", None)


def test_no_objective_of_the_package_goes_without_the_contract() -> None:
    tested = {
        each.objective
        for each in ObjectiveContract.__subclasses__()
        if isinstance(getattr(each, "objective", None), str)
    }
    # The sensor of the contract has no bent part.
    by_shape = {"bend_radius", "draft", "clearance", "cage_roughness"}
    own = {*registry.OBJECTIVES.built_in} - by_shape
    assert own <= tested
