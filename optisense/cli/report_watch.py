"""``optisense report --watch``: serve the page of a running study, on this machine only."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from optisense.cli.console import messages, output

if TYPE_CHECKING:
    from optisense.report.before_after import DesignView
    from optisense.report.live import LiveServer
    from optisense.search import Study

POLL_INTERVAL = 1.0
"""Interval between checks of the study's files, s; trials that end in one are shown together."""


def watch(study: Path, port: int, pictures: bool) -> None:
    """Serve the page of a study until Ctrl-C.

    Args:
        study: folder of the study, as the user names it.
        port: port of the server; 0 takes a free one.
        pictures: whether to render the trials that are clicked.

    Raises:
        SearchError: there is no study, or it was damaged meanwhile.
        OutputError: the port is not available.
    """
    from optisense.report.live import LiveServer
    from optisense.search import Study

    with closing(Study.open(study)) as opened, closing(LiveServer(port)) as server:
        watched = _Watched(opened, str(study), server, pictures)
        watched.refresh()
        output.print(f"watching: {server.address}")
        messages.print("Open it in a browser of this machine. Ctrl-C ends it.")
        while True:
            watched.answer()
            watched.refresh()


class _Watched:
    """Study and the page that shows it."""

    def __init__(self, study: Study, named: str, server: LiveServer, pictures: bool) -> None:
        from optisense.report.trial_pictures import TrialPictures

        self._study, self._named, self._server = study, named, server
        self._pictures = TrialPictures(study) if pictures else None
        self._version = ""
        self._views: dict[int, DesignView] = {}

    def refresh(self) -> None:
        """Update the page if the study's files have changed."""
        from optisense.report.study import render_study

        version = _version_of(self._study)
        if version == self._version:
            return
        page = render_study(self._study, self._sides(), named=self._named, live=version)
        self._server.show(page, version)
        self._version = version

    def answer(self) -> None:
        """Wait up to `POLL_INTERVAL` seconds for a browser's request for a picture; answer it."""
        from optisense.picture_files import png

        asked = self._server.wait(POLL_INTERVAL)
        if asked is None:
            return
        number, answer = asked
        found = None
        try:
            trial = next((each for each in self._study.trials if each.number == number), None)
            if trial is not None and self._pictures is not None:
                found = self._pictures.of(trial)
        finally:
            answer.set_result(None if found is None else png(found))

    def _sides(self) -> dict[str, DesignView]:
        """Return chief rays of the start and of the best trial; each design is traced once."""
        from optisense.report.before_after import design_view

        best = self._study.best
        designs = {-1: ("before", self._study.space.design)}
        if best is not None:
            designs[best.number] = ("after", best.design)
        settings = self._study.settings.settings
        self._views = {
            number: self._views.get(number) or design_view(design, settings, pictures=False)
            for number, (_, design) in designs.items()
        }
        return {label: self._views[number] for number, (label, _) in designs.items()}


def _version_of(study: Study) -> str:
    """Return a value that changes if the study's store changes."""
    from optisense.search.study.folder import STORE_FILE

    assert study.folder is not None
    parts = []
    for end in ("", "-wal"):
        try:
            found = (study.folder / f"{STORE_FILE}{end}").stat()
        except OSError:
            continue
        parts.append(f"{found.st_mtime_ns:x}.{found.st_size:x}")
    return "-".join(parts)
