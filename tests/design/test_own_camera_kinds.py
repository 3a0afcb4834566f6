"""Kinds of camera components of other packages are tried before they make pictures."""

from typing import Any, ClassVar, Literal

import numpy as np
import pytest

from optisense.design.lenses import LensBlur, LensDistortion, LensShading
from optisense.design.responses import CameraResponse, ToneCurve
from optisense.errors import LibraryError


class TriedResponse(CameraResponse):
    kind: Literal["test-response"] = "test-response"
    made: ClassVar[Any]

    def respond(self, exposed: Any, width: int | None = None) -> Any:
        return type(self).made(exposed)


class TriedCurve(ToneCurve):
    kind: Literal["test-curve"] = "test-curve"
    made: ClassVar[Any]

    def curve(self, linear: Any) -> Any:
        return type(self).made(linear)


class TriedBlur(LensBlur):
    kind: Literal["test-blur"] = "test-blur"
    made: ClassVar[Any]

    def deviation(self, camera: Any, vergence: Any) -> Any:
        return type(self).made(vergence)


class TriedShading(LensShading):
    kind: Literal["test-shading"] = "test-shading"
    made: ClassVar[Any]

    def transmission(self, places: Any) -> Any:
        return type(self).made(places.radius)


class TriedDistortion(LensDistortion):
    kind: Literal["test-distortion"] = "test-distortion"
    made: ClassVar[Any]

    def coefficients(self) -> Any:
        return type(self).made

    @staticmethod
    def distort(x: Any, y: Any, numbers: tuple[Any, ...]) -> Any:
        return numbers[0] * x, numbers[0] * y

    @staticmethod
    def jacobian(x: Any, y: Any, numbers: tuple[Any, ...]) -> Any:
        return numbers[1] + 0.0 * x, 0.0 * x, 0.0 * x, numbers[1] + 0.0 * x


def verify(monkeypatch: pytest.MonkeyPatch, kind: type[Any], made: Any) -> None:
    """Verify a kind whose method gives certain results."""
    monkeypatch.setattr(kind, "made", staticmethod(made) if callable(made) else made, False)
    kind().verify()


@pytest.mark.parametrize(
    ("kind", "made"),
    [
        (TriedResponse, lambda x: np.clip(x, 0.0, 1.0)),
        (TriedCurve, np.sqrt),
        (TriedBlur, lambda x: 0.01),
        (TriedBlur, lambda x: 0.01 + x),
        (TriedShading, lambda r: np.ones((*r.shape, 3))),
        (TriedDistortion, (1.1, 1.1)),
    ],
)
def test_what_a_camera_can_do_is_accepted(
    monkeypatch: pytest.MonkeyPatch, kind: Any, made: Any
) -> None:
    verify(monkeypatch, kind, made)


@pytest.mark.parametrize(
    ("kind", "made", "words"),
    [
        (TriedResponse, lambda x: x, r"respond\(\).* numbers from 0 to 2"),
        (TriedResponse, lambda x: np.full_like(x, np.nan), "not finite"),
        (TriedResponse, lambda x: np.clip(x, 0, 1).mean(axis=-1), r"shape \(4, 5\)"),
        (TriedResponse, lambda x: (255 * np.clip(x, 0, 1)).astype(np.uint8), "0 to 255"),
        (TriedResponse, lambda x: np.clip(x, 0, 1).tolist(), "0.0, 0.03"),
        (TriedCurve, lambda x: 3.0 * x, "curve.* from 0 to 3"),
        (TriedCurve, lambda x: x.ravel()[:3], r"shape \(3,\)"),
        (TriedBlur, lambda x: x - 0.1, "deviation.* from -0.1"),
        (TriedBlur, lambda x: np.ones(3), r"shape \(3,\)"),
        (TriedShading, lambda r: np.zeros((*r.shape, 3)), "transmission.* from 0 to 0"),
        (TriedShading, np.ones_like, r"shape \(4, 5\)"),
        (TriedDistortion, (1.0, 1.1), "not return the derivatives"),
        (TriedDistortion, (np.nan, 1.0), "coefficients.* not finite"),
        (TriedDistortion, ("a", "b"), "coefficients.*'a', 'b'"),
    ],
)
def test_what_makes_no_picture_is_refused(
    monkeypatch: pytest.MonkeyPatch, kind: Any, made: Any, words: str
) -> None:
    with pytest.raises(LibraryError, match=words):
        verify(monkeypatch, kind, made)
