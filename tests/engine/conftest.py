"""A minimal front end, and engines for tests."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from warm_python import programs


class Client:
    """Starts an engine; reads all that it says in a thread.

    Engines, and the searches that they start, are forks of one process unless a Python is given.
    """

    def __init__(self, folder: Path, hello: bool = True, python: str | None = None) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.log = folder / "log.txt"
        self.process = subprocess.Popen(
            [python or programs() / "python", "-m", "optisense.cli", "engine"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log.open("ab"),
            env={**os.environ, "OPTISENSE_LIBRARY": str(folder / "own-library")},
        )
        self._messages: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.all: list[dict[str, Any]] = []
        self.raw: list[bytes] = []
        self.last = 0
        threading.Thread(target=self._read, daemon=True).start()
        if hello:
            self.greeting = self.ask("hello", protocol=1, client="a test", folder=str(folder))

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.raw.append(line)
            self._messages.put(json.loads(line))
        self._messages.put(None)

    def write(self, line: bytes) -> None:
        """Write a line without checks."""
        assert self.process.stdin is not None
        self.process.stdin.write(line)
        self.process.stdin.flush()

    def send(self, do: str, **fields: Any) -> int:
        """Begin a request; returns its id."""
        return self.send_together([{"do": do, **fields}])[0]

    def send_together(self, requests: list[dict[str, Any]]) -> list[int]:
        """Begin requests that arrive at once; returns their ids."""
        numbers = range(self.last + 1, self.last + 1 + len(requests))
        rows = zip(numbers, requests, strict=True)
        self.write(b"".join(json.dumps({"id": n, **row}).encode() + b"\n" for n, row in rows))
        self.last += len(requests)
        return list(numbers)

    def next(self) -> dict[str, Any]:
        """Return the next message of any kind.

        Raises:
            EOFError: the engine has ended.
        """
        message = self._messages.get()
        if message is None:
            raise EOFError(self.log.read_text()[-2000:])
        self.all.append(message)
        return message

    def wait(self, number: int | str | None) -> dict[str, Any]:
        """The answer to a request; events and other answers before it stay in `all`."""
        return self.until(lambda message: message["id"] == number and "ok" in message)

    def until(self, fits: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The first message that fits, among those that came and those that come."""
        for message in self.all:
            if fits(message):
                return message
        while not fits(message := self.next()):
            pass
        return message

    def event(self, number: int, kind: str) -> dict[str, Any]:
        """The first event of a kind."""
        return self.until(lambda message: message["id"] == number and message.get("event") == kind)

    def events(self, number: int, kind: str) -> list[dict[str, Any]]:
        """The events of a kind that have come."""
        return [each for each in self.all if each["id"] == number and each.get("event") == kind]

    def ask(self, do: str, **fields: Any) -> dict[str, Any]:
        """Make a request that must succeed."""
        return self.result(self.send(do, **fields))

    def result(self, number: int) -> dict[str, Any]:
        """The result of a request that must succeed."""
        message = self.wait(number)
        assert message["ok"], message["error"]
        result: dict[str, Any] = message["result"]
        return result

    def refused(self, do: str, **fields: Any) -> dict[str, Any]:
        """Make a request that must be refused; its error."""
        return self.error(self.send(do, **fields))

    def error(self, number: int | str | None) -> dict[str, Any]:
        """The error of a request that must be refused."""
        message = self.wait(number)
        assert not message["ok"], message
        error: dict[str, Any] = message["error"]
        return error

    def leave(self) -> int:
        """Close the connection as a front end does; return the engine's exit code."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        return self.process.wait()


def _wait_until_gone(pid: int) -> None:
    while True:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        with contextlib.suppress(FileNotFoundError):  # it has gone, or this is no Linux
            state = Path(f"/proc/{pid}/stat").read_text()
            if state.rsplit(")", 1)[1].split()[0] == "Z":
                return
        time.sleep(0.05)


@pytest.fixture(scope="session")
def wait_until_gone() -> Callable[[int], None]:
    """Waits for the end of a process that is no child, by its number."""
    return _wait_until_gone


@pytest.fixture(scope="session")
def engine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """An engine that many tests share, as a front end does."""
    client = Client(tmp_path_factory.mktemp("engine"))
    yield client
    client.process.kill()
    client.process.wait()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Client]]:
    """Starter of engines that one test uses alone."""
    clients: list[Client] = []

    def begin(hello: bool = True, python: str | None = None) -> Client:
        clients.append(Client(tmp_path / f"engine{len(clients)}", hello, python))
        return clients[-1]

    yield begin
    for client in clients:
        client.process.kill()
        client.process.wait()
