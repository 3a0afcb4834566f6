"""Locks of folders, so that one process at a time writes to them, and removal of what killed
processes left.

A command that writes into a folder takes its lock before the first byte. The lock is the file
`.optisense.lock` in the folder, locked with `flock`: the kernel releases the lock when the process
ends, however it ends, so that a lock is never stale on its own machine, even if another process has
the same number later. The file names the holder of the lock, and the files that it is about to
make; it is removed when the lock is released. A lock file without a holder was left by a process
that was killed, and the next command removes the files that it names. No other file is ever
removed.

`flock` works across machines only if the network file system supports it. So a lock file of another
machine is not judged: the error names the machine and how to clear the lock. The machine is
recognised by its boot identifier, which containers on it share, or by its name.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import threading
import weakref
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path, PurePosixPath

from optisense.errors import FolderInUseError, OutputError
from optisense.lock_holder import UNKNOWN, Holder, process_lives, read_holder
from optisense.writing import TEMPORARY, remedy

LOCK_FILE = ".optisense.lock"

SUBFOLDERS = (
    "arrays",
    "cameras",
    "coatings",
    "design",
    "design/meshes",
    "images",
    "layers",
    "lights",
    "materials",
    "meshes",
    "parquet",
    "radiance",
    "renderings",
    "units",
)
"""Subfolders in which commands write temporary files, besides the folder itself."""


class FolderLock:
    """Exclusive right of one process to write into a folder.

    Attributes:
        folder: path of the folder.
    """

    def __init__(self, folder: str | Path, *, wait: bool = False, hint: str | None = None) -> None:
        """Take the lock, create the folder if needed, and clean up after killed processes.

        Args:
            wait: whether to wait for another process instead of failing.
            hint: remedy if the folder can't be written; by default, the one for the reason.

        Raises:
            FolderInUseError: another process holds the lock; the message names it.
            OutputError: the folder can't be created or written.
        """
        self.folder = Path(folder)
        self._path = self.folder / LOCK_FILE
        self._hint = hint
        self._me = Holder.of_this_process()
        self._made_folders: list[Path] = []
        self._made_files: tuple[str, ...] = ()
        self._made_subfolders: tuple[str, ...] = ()
        self._end: weakref.finalize[..., FolderLock] | None = None
        try:
            self._file, left = self._open(wait)
            self._end = weakref.finalize(self, _give_back, self._file, self._path, os.getpid())
            own = os.fstat(self._file).st_uid == os.getuid()
            half = left is not None and own and not _is_whole(self.folder, left)
            files, folders = (left.making, left.folders) if left and half else ((), ())
            remove_temporary_files(self.folder, (*SUBFOLDERS, *folders))
            _remove(self.folder, files, folders)
            self._write(self._me)
        except OSError as error:
            self.release()
            raise _cannot_write(self.folder, error, self._hint) from error
        except BaseException:
            self.release()
            raise

    def check_empty(self) -> None:
        """Raise OutputError if the folder contains something other than the lock."""
        if not is_empty(self.folder):
            raise OutputError(
                "the folder is not empty",
                where=str(self.folder),
                hint="Name a folder that doesn't exist, or empty this one",
            )

    def will_make(self, files: Iterable[str]) -> None:
        """Record which new files are about to be made.

        If this process is killed before `is_whole`, the next one that takes the lock removes them.

        Args:
            files: paths relative to the folder; none may exist. The last one must be made last: if
                it exists, all of them are complete.

        Raises:
            OutputError: one of the files exists, or the lock file can't be written.
        """
        names = tuple(PurePosixPath(file).as_posix() for file in files)
        for name in names:
            if os.path.lexists(self.folder / name):
                raise OutputError(
                    "the file exists already",
                    where=str(self.folder / name),
                    hint="Name a folder that doesn't exist, or empty this one",
                )
        parents = {
            parent.as_posix()
            for name in names
            for parent in PurePosixPath(name).parents
            if parent.parts and not (self.folder / parent).exists()
        }
        self._made_files += names
        self._made_subfolders += tuple(sorted(parents, reverse=True))  # the innermost first
        try:
            self._write(replace(self._me, making=self._made_files, folders=self._made_subfolders))
        except OSError as error:
            raise _cannot_write(self.folder, error, self._hint) from error

    def is_whole(self) -> None:
        """Record that the files of `will_make` are complete; from now only `undo` removes them."""
        with contextlib.suppress(OSError):
            self._write(self._me)

    @property
    def has_made(self) -> bool:
        """True if there are files that `undo` would remove."""
        return bool(self._made_files)

    def undo(self) -> None:
        """Remove the files of `will_make`, and their folders if these are empty then."""
        _remove(self.folder, self._made_files, self._made_subfolders)
        self._made_files = self._made_subfolders = ()

    def release(self) -> None:
        """Release the lock; a folder that was created for it and is empty is removed."""
        if self._end is not None:
            self._end()
        for folder in self._made_folders:
            with contextlib.suppress(OSError):
                folder.rmdir()
        self._made_folders = []

    def _open(self, wait: bool) -> tuple[int, Holder | None]:
        """Return the lock file, locked, and the record of a killed process in it, if any."""
        while True:
            self._make_folder()
            flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
            try:
                file = os.open(self._path, flags, 0o666)
            except FileNotFoundError:  # another process has removed its new folder
                continue
            try:
                fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
                if _is_still(file, self._path):
                    left = read_holder(file)
                    if left is None or not left.is_elsewhere:
                        return file, left
                    raise _elsewhere(self.folder, left)
            except BlockingIOError:
                raise _in_use(self.folder, read_holder(file)) from None
            except BaseException:
                os.close(file)
                raise
            os.close(file)  # its holder has removed it since it was opened

    def _make_folder(self) -> None:
        """Create the folder and its parents, and remember which were missing."""
        missing = []
        folder = self.folder
        while not folder.exists() and folder != folder.parent:
            missing.append(folder)
            folder = folder.parent
        for each in reversed(missing):
            with contextlib.suppress(FileExistsError):
                each.mkdir()
                self._made_folders.insert(0, each)
        if not self.folder.is_dir():
            hint = self._hint or "Name a folder"
            raise OutputError("this is a file, not a folder", where=str(self.folder), hint=hint)

    def _write(self, holder: Holder) -> None:
        data = (json.dumps(asdict(holder), indent=1) + "\n").encode("utf-8")
        if os.pwrite(self._file, data, 0) < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self._path))
        os.ftruncate(self._file, len(data))


_held: dict[tuple[int, int, int], tuple[FolderLock, int]] = {}
"""Locks taken by `hold` and their counts, by thread, device and inode of the folder."""


def hold(folder: str | Path, *, wait: bool = False, hint: str | None = None) -> Callable[[], None]:
    """Take the lock of a folder, or share the one that this thread has taken by `hold`.

    Returns:
        Function that releases it.

    Raises:
        FolderInUseError, OutputError: see `FolderLock`.
    """
    place = Path(folder)
    key = _key(place)
    lock, times = _held.get(key, (None, 0)) if key else (None, 0)
    if lock is None:
        lock = FolderLock(place, wait=wait, hint=hint)
        key = _key(place)
    assert key is not None
    _held[key] = lock, times + 1

    def give_back() -> None:
        lock, times = _held.pop(key)
        if times > 1:
            _held[key] = lock, times - 1
        else:
            lock.release()

    return give_back


@contextmanager
def held(
    folder: str | Path, *, wait: bool = False, hint: str | None = None
) -> Iterator[FolderLock]:
    """Hold the lock of a folder for the duration of a block, and yield it."""
    give_back = hold(folder, wait=wait, hint=hint)
    try:
        key = _key(Path(folder))
        assert key is not None
        yield _held[key][0]
    finally:
        give_back()


@contextmanager
def begun(folder: str | Path, files: Iterable[str]) -> Iterator[None]:
    """Begin a new folder: it must be empty, and a block that fails leaves none of its files in it.

    Args:
        folder: folder, created if needed.
        files: files that the block makes, relative to the folder; the last one must be made last.

    Raises:
        FolderInUseError: another process is writing to the folder.
        OutputError: the folder is not empty, or can't be written.
    """
    with held(folder) as lock:
        lock.check_empty()
        lock.will_make(files)
        try:
            yield
        except BaseException:
            lock.undo()
            raise
        lock.is_whole()


def is_empty(folder: Path) -> bool:
    """Return whether a folder is empty except for its lock."""
    return all(each.name == LOCK_FILE for each in folder.iterdir())


def holder_of(folder: Path) -> Holder | None:
    """Return the process that writes to a folder at present, or None; nothing is written."""
    try:
        file = os.open(folder / LOCK_FILE, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        holder = read_holder(file)
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return holder or UNKNOWN
    except OSError:
        return None
    else:
        return holder if holder is not None and holder.is_elsewhere else None
    finally:
        os.close(file)


def remove_temporary_files(folder: Path, subfolders: Iterable[str]) -> None:
    """Remove the temporary files of ended processes from a folder whose lock is held."""
    for place in (folder, *(folder / name for name in subfolders)):
        with contextlib.suppress(OSError):
            if _leaves(folder, place) or ".." in place.parts:
                continue
            for each in place.iterdir():
                found = TEMPORARY.fullmatch(each.name)
                if found and not process_lives(int(found["process"])) and not each.is_dir():
                    each.unlink()


def _key(folder: Path) -> tuple[int, int, int] | None:
    try:
        found = folder.stat()
    except OSError:
        return None
    return threading.get_ident(), found.st_dev, found.st_ino


def _give_back(file: int, path: Path, process: int) -> None:
    """Remove a lock file and close it, unless this process is a fork of the one that took it."""
    if os.getpid() == process:
        with contextlib.suppress(OSError):
            if _is_still(file, path):
                path.unlink()
    with contextlib.suppress(OSError):
        os.close(file)


def _is_still(file: int, path: Path) -> bool:
    """Return whether an open file is the one at a path."""
    try:
        there = path.lstat()
    except OSError:
        return False
    here = os.fstat(file)
    return (here.st_dev, here.st_ino) == (there.st_dev, there.st_ino)


def _remove(folder: Path, files: Iterable[str], folders: Iterable[str]) -> None:
    """Remove files of a folder, and folders in it that are then empty; links are not followed."""
    for name, remove in [
        *((name, Path.unlink) for name in files),
        *((name, Path.rmdir) for name in folders),
    ]:
        path = folder / name
        with contextlib.suppress(OSError, ValueError):
            if not _leaves(folder, path.parent) and ".." not in path.parts:
                remove(path)


def _leaves(folder: Path, place: Path) -> bool:
    """Return whether a place is outside of a folder after links are resolved."""
    return not Path(os.path.realpath(place)).is_relative_to(os.path.realpath(folder))


def _is_whole(folder: Path, left: Holder) -> bool:
    """Return whether a killed process had made all its files; the last is made last."""
    try:
        return bool(left.making) and os.path.lexists(folder / left.making[-1])
    except ValueError:  # a name that no file can have
        return False


def _in_use(folder: Path, holder: Holder | None) -> FolderInUseError:
    return FolderInUseError(
        f"another process is writing to this folder: {holder or UNKNOWN}",
        where=str(folder),
        hint="Wait for it, or end it: nothing that it has finished is lost",
    )


def _elsewhere(folder: Path, holder: Holder) -> FolderInUseError:
    return FolderInUseError(
        f"another machine seems to be writing to this folder: {holder}",
        where=str(folder),
        hint=f"If that process has ended, delete {folder / LOCK_FILE}",
    )


def _cannot_write(folder: Path, error: OSError, hint: str | None) -> OutputError:
    if error.errno == errno.ELOOP:
        return OutputError(
            "the lock file is a link", where=str(folder / LOCK_FILE), hint="Delete the link"
        )
    return OutputError(
        f"the folder can't be written: {error.strerror or error}",
        where=str(folder),
        hint=remedy(error, hint),
    )
