"""Errors about scenes that do not form a design."""

from __future__ import annotations


class SceneError(ValueError):
    """Error about a scene that can't be written as a design.

    Attributes:
        path: dotted path in the design that the error is about; empty if it is about none.
    """

    def __init__(self, message: str, path: str = "") -> None:
        super().__init__(message)
        self.path = path
