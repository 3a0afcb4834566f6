"""The errors a user can cause. Each says what is wrong, where, and what to do about it."""

from __future__ import annotations


class OptiSenseError(Exception):
    """Base of all errors caused by input, set-up or output, never by a defect of the program.

    Args:
        message: what is wrong, as a sentence without its full stop.
        where: file and line, part name or dotted path, when there is one.
        hint: what to do about it, as a sentence without its full stop.
    """

    def __init__(self, message: str, *, where: str | None = None, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.where = where
        self.hint = hint

    def __str__(self) -> str:
        text = self.message
        if self.where:
            text += f" ({self.where})"
        if self.hint:
            text += f". {self.hint}"
        return text

    def __reduce__(self) -> tuple[object, ...]:
        """Keep `where` and `hint` when the error crosses to another process."""
        return _rebuild, (type(self), self.message, self.where, self.hint)


def _rebuild(
    kind: type[OptiSenseError], message: str, where: str | None, hint: str | None
) -> OptiSenseError:
    return kind(message, where=where, hint=hint)


class DesignError(OptiSenseError):
    """A sensor design that can't be read, or makes no sense."""


class MeshError(OptiSenseError):
    """A mesh that is empty, not closed, not finite or can't be read."""


class ContactError(OptiSenseError):
    """A contact that is off the sensing surface, too deep, or can't be read."""


class LibraryError(OptiSenseError):
    """A library entry that is unknown, or a data file of it that can't be read."""


class RenderError(OptiSenseError):
    """A design or a setting that can't be rendered."""


class NoDerivativeError(RenderError):
    """Chief rays have no derivative by something that moves."""


class ObjectiveError(OptiSenseError):
    """An objective that is unknown or can't be loaded, or a sensor that it can't score."""


class SetupError(OptiSenseError):
    """Something missing or too old on this machine, such as libLLVM."""


class OutputError(OptiSenseError):
    """A file or folder that can't be written."""


class FolderInUseError(OutputError):
    """A folder that another process is writing to."""


class TaskError(OptiSenseError):
    """A perception task, or a dataset, that can't be made or read as asked."""


class CalibrationError(OptiSenseError):
    """Photographs of a sensor that can't be read, or that a design can't be compared with."""


class SearchError(OptiSenseError):
    """A search space, a method or a study that makes no sense, or can't go on."""
