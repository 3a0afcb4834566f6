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


BY_SHAPE = {"bend_radius", "draft", "clearance", "cage_roughness"}
"""Objectives of bent parts, of which the sensor of the contract has none."""


@pytest.mark.parametrize(
    "named", [each for each in registry.OBJECTIVES.built_in if each not in BY_SHAPE], scope="class"
)
class TestOfThisPackage(ObjectiveContract):
    @pytest.fixture(autouse=True, scope="class")
    def name(self, request: pytest.FixtureRequest, named: str) -> None:
        request.cls.objective, request.cls._kept = named, None


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
