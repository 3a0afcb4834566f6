"""The protocol: lines of requests, answers, events and errors, and the channel for them.

The reference is docs/engine.md; `PROTOCOL` is increased when a part of it is removed or changes its
meaning.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from optisense.design.problems import design_error
from optisense.engine.failures import ProtocolError
from optisense.json_values import json_ready
from optisense.untrusted_files import as_text, parse_json

PROTOCOL = 1
"""Version of the protocol; see the module's description for when it is increased."""

MOST_OF_A_LINE = 64 * 1024 * 1024
"""Largest size of a request, bytes; a longer one is an error and not read into memory. Requests
have some kilobytes, as large data are sent by files."""

LONGEST_ID = 64
"""Largest number of characters of a request's id. Every answer repeats the id; a UUID has 36."""

RequestId = int | str


class Fields(BaseModel):
    """Base class of the fields of a request; unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", strict=False)

    name: str | None = None
    to: str | None = None


@dataclass(frozen=True)
class Request:
    """Request whose fields are not checked yet."""

    id: RequestId
    do: str
    fields: dict[str, Any]


def read_request(line: bytes) -> Request:
    """Parse the request on a line.

    Raises:
        ProtocolError: the line is no request; the error has the id if it could be read.
    """
    if len(line) > MOST_OF_A_LINE:
        raise ProtocolError(
            "the line is too long", hint="Send large data by files, named in the request"
        )
    try:
        text = as_text(line, "request", ProtocolError, "the line")
        data = parse_json(text, "request", ProtocolError, "the line")
        if "\\u0000" in text:  # no file name or other text here has it
            raise ProtocolError("a text contains the character NUL")
    except ProtocolError as error:
        raise ProtocolError(error.message, hint="Write one JSON object on each line") from None
    if not isinstance(data, dict):
        raise ProtocolError("the line is not a JSON object", hint='Write {"id": 1, "do": "hello"}')
    number = data.pop("id", None)
    if not is_id(number):
        raise ProtocolError(
            "the request has no valid id",
            where="id",
            hint=f"Give a whole number or a text of at most {LONGEST_ID} characters",
        )
    do = data.pop("do", None)
    if not isinstance(do, str):
        raise ProtocolError(
            "the request has no field 'do' with its name", where="do",
            hint='Write "do": "simulate"', request=number,
        )  # fmt: skip
    return Request(number, do, data)


def is_id(value: object) -> bool:
    """Return whether a value can be the id of a request."""
    if isinstance(value, str):
        return 0 < len(value) <= LONGEST_ID
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**53


_F = TypeVar("_F", bound=Fields)


def checked_fields(kind: type[_F], request: Request) -> _F:
    """Return the checked fields of a request.

    Raises:
        ProtocolError: a field is missing, unknown (with a similar name) or of the wrong type.
    """
    try:
        return kind.model_validate(request.fields)
    except ValidationError as error:
        found = design_error(error, request.fields, where=request.do, model=kind)
        raise ProtocolError(
            found.message, where=found.where, hint=found.hint, request=request.id
        ) from None


def answer(number: RequestId | None, result: Mapping[str, Any]) -> dict[str, Any]:
    """Return the message that a request has succeeded."""
    return {"id": number, "ok": True, "result": result}


def refusal(number: RequestId | None, error: Mapping[str, Any]) -> dict[str, Any]:
    """Return the message that a request has failed; `failures.as_data` makes `error`."""
    return {"id": number, "ok": False, "error": error}


def to_line(message: Mapping[str, Any]) -> bytes:
    """Return a message as a line of JSON; numbers that are not finite become null."""
    text = json.dumps(
        json_ready(message, _plain), ensure_ascii=False, allow_nan=False, separators=(",", ":")
    )
    return text.encode("utf-8", "replace") + b"\n"


def _plain(value: object) -> object:
    """Return a model as a dict, and any other object as text."""
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else str(value)


class Channel:
    """Writer of messages, one per line, for any thread."""

    def __init__(self, descriptor: int) -> None:
        """Write to an open file descriptor, which belongs to the channel from here on."""
        self._descriptor = descriptor
        self._lock = threading.Lock()
        self._gone = False

    @staticmethod
    def of_standard_output() -> Channel:
        """Return a channel on the process's standard output, and redirect all other output to
        standard error.

        The redirection is on the level of file descriptors, so that it holds for libraries in C as
        well.
        """
        sys.stdout.flush()
        own = os.dup(1)
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        return Channel(own)

    @property
    def gone(self) -> bool:
        """True if the reader has closed the channel."""
        return self._gone

    def send(self, message: Mapping[str, Any]) -> None:
        """Write a message; it is dropped if the reader has closed the channel."""
        line = memoryview(to_line(message))
        with self._lock:
            if self._gone:
                return
            try:
                while line:
                    line = line[os.write(self._descriptor, line) :]
            except OSError:
                self._gone = True

    def close(self) -> None:
        """Close the channel; further messages are dropped."""
        with self._lock:
            self._gone = True
            with contextlib.suppress(OSError):
                os.close(self._descriptor)
