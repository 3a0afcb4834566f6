"""Server of a page that refreshes itself, for this machine only."""

from __future__ import annotations

import queue
import re
import threading
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from optisense.errors import OutputError

HERE = "127.0.0.1"
"""Address of this machine, to which the server listens; others can't reach it."""

MOST_WAITING = 16
"""Largest number of pictures in the queue; a reader looks at one at a time."""

PATIENCE = 300.0
"""Longest wait for a picture, s, which suffices to render one even on a busy machine."""

PICTURE = re.compile(r"/trial/(\d{1,9})\.png")


class LiveServer:
    """Server of a page, its version, and pictures of trials, for browsers of this machine.

    Requests are answered by threads; pictures are made by the caller of `wait`, since the renderer
    works in one thread. Only these addresses are answered, and only to requests that name this
    machine as their host: pages of other sites in the same browser get nothing.

    Attributes:
        address: address of the page.
    """

    def __init__(self, port: int = 0) -> None:
        """Start serving.

        Args:
            port: port; 0 takes a free one.

        Raises:
            OutputError: the port is not available.
        """
        self._page, self._version = b"", "0"
        self._asked: queue.Queue[tuple[int, Future[bytes | None]]] = queue.Queue(MOST_WAITING)
        try:
            self._server = ThreadingHTTPServer((HERE, port), self._handler())
        except (OSError, OverflowError) as error:
            raise OutputError(
                f"port {port} is not available: {error}", hint="Leave --port out for a free one"
            ) from error
        self._server.daemon_threads = True
        self.port = int(self._server.server_address[1])
        self.address = f"http://{HERE}:{self.port}/"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def show(self, page: str, version: str) -> None:
        """Serve this page from now on; open pages of other versions reload it."""
        self._page, self._version = page.encode("utf-8"), version

    def wait(self, seconds: float) -> tuple[int, Future[bytes | None]] | None:
        """Return the number of a trial whose picture is requested, and the future for its answer (a
        PNG file, or None); None if none is requested within `seconds`.
        """
        try:
            return self._asked.get(timeout=seconds)
        except queue.Empty:
            return None

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()

    def _picture(self, number: int) -> bytes | None:
        answer: Future[bytes | None] = Future()
        try:
            self._asked.put_nowait((number, answer))
            return answer.result(PATIENCE)
        except (queue.Full, FutureTimeoutError):
            return None

    def _answer(self, path: str) -> tuple[bytes, str] | None:
        """Return the content at an address, and its type."""
        if path == "/":
            return self._page, "text/html; charset=utf-8"
        if path == "/version":
            return self._version.encode("ascii"), "text/plain; charset=utf-8"
        asked = PICTURE.fullmatch(path)
        picture = None if asked is None else self._picture(int(asked[1]))
        return None if picture is None else (picture, "image/png")

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        live = self

        class Handler(BaseHTTPRequestHandler):
            server_version = "OptiSense"
            sys_version = ""
            timeout = 30.0

            def do_GET(self) -> None:
                known = {f"{name}:{live.port}" for name in (HERE, "localhost")}
                if self.headers.get("Host") not in known:
                    self.send_error(HTTPStatus.FORBIDDEN)
                    return
                found = live._answer(self.path)
                if found is None:
                    self.send_error(HTTPStatus.NOT_FOUND)
                    return
                body, kind = found
                self.send_response(HTTPStatus.OK)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.send_header("Cache-Control", "no-store")
                self.send_header("X-Content-Type-Options", "nosniff")
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: object) -> None:
                """Print nothing: the terminal belongs to the command."""

        return Handler
