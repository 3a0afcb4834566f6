"""Templates of pages, and rendering of pages from them."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from optisense import __version__
from optisense.text import shown_in_html


def template(name: str) -> str:
    """Return a file of the package's templates as text."""
    return (files("optisense.report") / "templates" / name).read_text(encoding="utf-8")


def page(name: str, **values: Any) -> str:
    """Return the text of an HTML page from a template.

    Args:
        name: name of the template, without ``.html.j2``.
        values: values that it shows; those that are no `Markup` are escaped.
    """
    environment = Environment(
        loader=FunctionLoader(lambda each: template(f"{each}.html.j2")),
        autoescape=True,
        finalize=shown_in_html,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name).render(
        version=__version__, css=Markup(template("report.css")), **values
    )


def script(name: str) -> Markup:
    """Return a script of the package's templates, to be included in a page."""
    return Markup(template(name))


def as_json(value: Any) -> Markup:
    """Return JSON that can't end the script element that contains it."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))
