"""Errors that a user can cause. Each states the problem, its place, and the remedy."""

from __future__ import annotations

import errno


class OptiSenseError(Exception):
    """Base of all errors caused by input, set-up or output, never by a defect of the program.

    Args:
        message: problem, as a sentence without its full stop.
        where: file and line, part name or dotted path, if there is one.
        hint: remedy, as a sentence without its full stop.
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
        """Keep `where` and `hint` when the error is pickled for another process."""
        return _rebuild, (type(self), self.message, self.where, self.hint)


def _rebuild(
    kind: type[OptiSenseError], message: str, where: str | None, hint: str | None
) -> OptiSenseError:
    return kind(message, where=where, hint=hint)


class DesignError(OptiSenseError):
    """A sensor design can't be read, or its values contradict each other."""


class MeshError(OptiSenseError):
    """A mesh is empty, not closed, not finite or can't be read."""


class ContactError(OptiSenseError):
    """A contact is off the sensing surface, too deep, or can't be read."""


class LibraryError(OptiSenseError):
    """A library entry is unknown, or one of its data files can't be read."""


class RenderError(OptiSenseError):
    """A design or a setting can't be rendered."""


class NoDerivativeError(RenderError):
    """Chief rays have no derivative by a part that moves."""


class ObjectiveError(OptiSenseError):
    """An objective is unknown, can't be loaded, or can't score a sensor."""


class UnknownPartError(ObjectiveError):
    """An expression names a part that its objective does not have, so no sensor can be scored."""


class SetupError(OptiSenseError):
    """A component, such as libLLVM, is missing or too old on this machine."""


_TAKEN = "Another file or folder has this name: choose another one"
_NAMES = {
    errno.ENAMETOOLONG: "Choose a shorter name",
    errno.EEXIST: _TAKEN,
    errno.ENOTDIR: _TAKEN,
    errno.EISDIR: _TAKEN,
}
"""Remedies for the names of files that can't be written, by the number of the system's error."""


class OutputError(OptiSenseError):
    """A file or folder can't be written."""

    @staticmethod
    def of(error: OSError) -> OutputError:
        """Return an error of the operating system with a message and a hint for the user."""
        where = str(error.filename) if error.filename else None
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            hint = "Free some space and try again"
            return OutputError("the disk is full", where=where, hint=hint)
        if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            hint = "Choose a folder that you may write to"
            return OutputError("permission denied", where=where, hint=hint)
        text = error.strerror or str(error)
        return OutputError(text, where=where, hint=_NAMES.get(error.errno or 0))


class FolderInUseError(OutputError):
    """Another process is writing to a folder."""


class OwnCodeError(OptiSenseError):
    """Python code of a user, such as the class of a kind of indenter, has failed."""


class TaskError(OptiSenseError):
    """A perception task or a dataset can't be made or read."""


class CalibrationError(OptiSenseError):
    """Photographs of a sensor can't be read, or can't be compared with a design."""


class SearchError(OptiSenseError):
    """A search space, a method or a study is invalid, or a search can't be resumed."""
