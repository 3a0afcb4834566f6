"""Errors of scenes that are no design."""

from __future__ import annotations


class SceneError(ValueError):
    """A scene that can't be written down as a design.

    Attributes:
        path: the dotted path in the design that it is about; empty if it is about none.
    """

    def __init__(self, message: str, path: str = "") -> None:
        super().__init__(message)
        self.path = path
