"""The templates of pages, and pages made of them."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from optisense import __version__
from optisense.text import shown_in_html


def template(name: str) -> str:
    """A file of the package's templates as text."""
    return (files("optisense.report") / "templates" / name).read_text(encoding="utf-8")


def page(name: str, **values: Any) -> str:
    """The text of an HTML page, made of the template of a name.

    Args:
        name: of the template, without ``.html.j2``.
        values: that it shows; what is no `Markup` is escaped.
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
    """A script of the package's templates, to stand in a page."""
    return Markup(template(name))


def as_json(value: Any) -> Markup:
    """JSON that can't end the script element it stands in."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))
