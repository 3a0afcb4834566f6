"""Pickling of objects that are sent to other processes."""

from __future__ import annotations

from functools import cached_property


class PickledWithoutCaches:
    """Object whose cached properties are left out when it is pickled.

    Another process makes them anew when it needs them: a model, images, or functions of a user's
    file can't be sent to it, or take longer to send than to make.
    """

    def __getstate__(self) -> dict[str, object]:
        """Return the attributes without the values of cached properties."""
        kind = type(self)
        return {
            name: value
            for name, value in self.__dict__.items()
            if not isinstance(getattr(kind, name, None), cached_property)
        }
