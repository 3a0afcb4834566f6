"""Tests of tasks run on the processor, or where OPTISENSE_TEST_VARIANT says."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from optisense.optics.backend.variant import use_variant

use_variant(os.environ.get("OPTISENSE_TEST_VARIANT", "llvm"))

from optisense import Contact, OpticalModel, load  # noqa: E402
from optisense.optics import TactileImage  # noqa: E402
from optisense.optics.transport.chief_rays import ChiefRays  # noqa: E402


@pytest.fixture(scope="session")
def mini() -> OpticalModel:
    """A flat GelSight Mini; tests don't change it."""
    return OpticalModel(load("gelsight-mini-ideal"))


@pytest.fixture(scope="session")
def cylindrical_mini() -> OpticalModel:
    """A GelSight Mini bent to a cylinder; tests don't change it."""
    return OpticalModel(load("gelsight-mini-ideal-cylindrical"))


LIGHTS = np.array([[0.8, 0.0, -0.6], [-0.4, 0.69282, -0.6], [-0.4, -0.69282, -0.6]])
"""Towards red, green and blue light, which come from all sides of a flat Mini, from inside (-z)."""


class LambertianSensor:
    """The geometry of a real model, but colours from algebra: each channel is the cosine between
    the normal and that channel's light, infinitely far away, with no shadows.
    """

    def __init__(self, model: OpticalModel, rays: Callable[..., ChiefRays]) -> None:
        self._model, self._rays = model, rays
        self.pictures = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def render(
        self,
        contacts: Sequence[Contact] = (),
        resolution: tuple[int, int] = (160, 120),
        skin: str = "elastic",
        **ignored: object,
    ) -> TactileImage:
        """An image without noise."""
        self.pictures += 1
        rays = self._rays(resolution, tuple(contacts), skin)
        light = np.maximum(rays.normals @ LIGHTS.T, 0).astype(np.float32)
        return TactileImage(
            layers={"all": np.where(rays.hit[..., None], light, 0)},
            normals=rays.normals,
            contact_mask=rays.hit & (rays.region == 2),
            points=rays.points,
            settings={"versions": {}},
        )


@pytest.fixture(scope="session")
def rays_of_mini(mini: OpticalModel) -> Callable[..., ChiefRays]:
    """Chief rays of the flat Mini, kept for as many presses as a test repeats: each takes a second
    to find the elastic skin under a cylinder."""
    return lru_cache(maxsize=48)(mini.chief_rays)


@pytest.fixture
def lambertian(mini: OpticalModel, rays_of_mini: Callable[..., ChiefRays]) -> Any:
    """A flat Mini whose colours are algebra."""
    return LambertianSensor(mini, rays_of_mini)
