"""The kernels of an image, which Dr.Jit compiles once for all sizes of images and of contacts."""

from __future__ import annotations

import random

import drjit as dr
import pytest

import optisense as ots
from optisense import Contact, OpticalModel, Sphere

FEW = 512
"""Number of lanes below which kernels are not counted: whether a rare event happens, such as the
late reflection of a ray, differs between images."""

SHORT = 10_000
"""Number of characters of kernels that are not counted, as they are compiled in 10 ms: one copies
the image to NumPy, and contains its size."""


@pytest.mark.parametrize("specularity", [0.0, 0.8, 1.0])
def test_images_of_other_sizes_and_contacts_compile_nothing(specularity: float) -> None:
    design = ots.set_value(ots.load("gelsight-mini-ideal"), "coating.specularity", specularity)
    model = OpticalModel(design, "llvm")
    chance = random.Random()  # without a seed: Dr.Jit keeps kernels of earlier runs in files

    def compiled() -> list[int]:
        ball = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=chance.uniform(0.5, 0.9))
        size = chance.randint(60, 100), chance.randint(50, 80)
        dr.kernel_history_clear()
        model.render([ball], size, photons=30_000, seed=chance.randint(1, 10**6))
        missed = (kernel for kernel in dr.kernel_history() if kernel.get("cache_hit") == 0)
        found = [(kernel["size"], len(kernel["ir"].getvalue())) for kernel in missed]
        return [size for size, length in found if size >= FEW and length >= SHORT]

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        compiled(), compiled()  # what is compiled once
        assert compiled() == []
