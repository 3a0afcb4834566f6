"""Digests of files that identify indenters when a dataset is continued."""

from __future__ import annotations

import hashlib
from pathlib import Path

from optisense.errors import TaskError
from optisense.untrusted_files import MOST_MESH, MOST_STEP, read_bytes


def file_digest(path: Path) -> str:
    """Return the digest of a file's content.

    Raises:
        TaskError: the file cannot be read.
    """
    content = read_bytes(path, max(MOST_MESH, MOST_STEP), TaskError, "the mesh")
    return hashlib.sha256(content).hexdigest()
