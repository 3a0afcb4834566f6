"""All kinds of input."""

from . import engine_kind, text_kinds  # noqa: F401 - they register kinds of their own
from .kinds import KINDS

__all__ = ["KINDS"]
