"""The documentation as a site: `make docs` builds it, and fails where a link leads nowhere.

The source folder is the project's, so that links among README, docs and benchmarks work on the
site as they do in the repository.
"""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

import optisense

project = "OptiSense Studio"
author = "The OptiSense Studio developers"
version = release = optisense.__version__

root_doc = "docs/index"
include_patterns = [
    "docs/**.md",
    "benchmarks/*.md",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "LICENSE",
]
exclude_patterns = ["docs/examples/**", ".*", "site", "tests"]
"""What is no page, and folders without pages of which the files need not be looked at, as those of
``.venv``."""
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

myst_heading_anchors = 4
nitpicky = True
nitpick_ignore_regex = [("py:.*", ".*")]
"""Types of the programming interface that are other libraries', or private."""

autodoc_member_order = "groupwise"
autodoc_typehints = "description"
autodoc_class_signature = "separated"
autodoc_default_options = {
    "members": True,
    "imported-members": True,
    "exclude-members": "model_config, model_post_init",
}
autodoc_type_aliases = {"ArrayLike": "ArrayLike"}
napoleon_use_ivar = True

html_theme = "furo"
html_title = "OptiSense Studio"
html_show_copyright = False
html_show_sphinx = False
html_extra_path = ["site"]

LINK = re.compile(r"\[([^\]]+)\]\(([^)#\s]+)\.md\)")


def _contents(app: Sphinx, page: str, source: list[str]) -> None:
    """The site's contents are the links of the index: a chapter for each of its headings."""
    if page != root_doc:
        return
    chapters = []
    for chapter in re.split(r"^## ", source[0], flags=re.MULTILINE)[1:]:
        title, _, text = chapter.partition("\n")
        pages = "\n".join(f"{name} <{path}>" for name, path in LINK.findall(text))
        chapters.append(f"```{{toctree}}\n:hidden:\n:caption: {title}\n\n{pages}\n```\n")
    source[0] += "\n" + "\n".join(chapters)


def _without_backquotes(
    app: Sphinx, what: str, name: str, thing: object, options: Any, lines: list[str]
) -> None:
    """Docstrings write code as Markdown does: `so`."""
    lines[:] = [re.sub(r"(?<![`:])`([^`]+)`(?!`)", r"``\1``", line) for line in lines]


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("source-read", _contents)
    app.connect("autodoc-process-docstring", _without_backquotes, priority=400)
