"""Importing the package is light, and its public names are there."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

import optisense


def test_import_loads_neither_the_renderer_nor_numpy() -> None:
    code = (
        "import sys, optisense;"
        "print([m for m in ('mitsuba', 'drjit', 'numpy') if m in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_loading_a_design_does_not_load_the_renderer() -> None:
    code = (
        "import sys, optisense as o; o.load('gelsight-mini-ideal');"
        "print([m for m in ('mitsuba', 'drjit') if m in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_unknown_names_are_attribute_errors() -> None:
    with pytest.raises(AttributeError, match="nothing"):
        optisense.nothing  # noqa: B018


@pytest.mark.parametrize("package", ["optisense", "optisense.optics", "optisense.report"])
def test_every_public_name_loads_and_is_listed(package: str) -> None:
    module = import_module(package)
    assert dir(module) == sorted(module.__all__)
    for name in module.__all__:
        assert getattr(module, name) is getattr(module, name)
        assert name in vars(module)


def test_an_integrator_of_normals_is_made_of_public_names() -> None:
    from optisense.reading import integration

    assert set(integration.__all__) >= {"NormalIntegrator", "UntouchedSurface"}
    for name in integration.__all__:
        assert getattr(integration, name).__name__ == name


def test_search_is_a_package_with_the_function_in_it() -> None:
    from optisense import search

    assert search is sys.modules["optisense.search"]
    assert callable(search.search)
