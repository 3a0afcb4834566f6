"""Lines of the protocol, and the engine's answers to malformed lines."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import numpy as np
import pytest

from optisense.engine.failures import ProtocolError
from optisense.engine.protocol import MOST_OF_A_LINE, read_request, to_line


def test_a_request_is_read() -> None:
    request = read_request(b'{"id": "a", "do": "check", "design": "gelbelt"}\n')
    assert (request.id, request.do, request.fields) == ("a", "check", {"design": "gelbelt"})


@pytest.mark.parametrize(
    "line",
    [
        b"hello\n",
        b"[]\n",
        b'{"id": 1}\n',
        b'{"do": "hello"}\n',
        b'{"id": true, "do": "hello"}\n',
        b'{"id": "", "do": "hello"}\n',
        b'{"id": 1.5, "do": "hello"}\n',
        b'{"id": {}, "do": "hello"}\n',
        b'{"id": 1, "do": 2}\n',
        b'{"id": 1, "do": "x", "y": NaN}\n',
        b'{"id": 1, "do": "\xff"}\n',
        b"[" * 100_000,
        b" " * (MOST_OF_A_LINE + 1),
    ],
)
def test_what_is_no_request_is_refused_in_words(line: bytes) -> None:
    with pytest.raises(ProtocolError) as caught:
        read_request(line)
    assert caught.value.message
    assert caught.value.hint or "JSON" in caught.value.message


def test_messages_are_one_line_of_json_whatever_is_in_them() -> None:
    message = {
        "id": 1,
        "text": "one\ntwo äß",
        "bad": math.nan,
        "worse": np.float32(math.inf),
        "array": np.arange(3),
        "nested": [{"x": np.float64(0.5)}],
    }
    line = to_line(message)
    assert line.count(b"\n") == 1
    assert json.loads(line) == {
        "id": 1,
        "text": "one\ntwo äß",
        "bad": None,
        "worse": None,
        "array": [0, 1, 2],
        "nested": [{"x": 0.5}],
    }


def test_nothing_but_messages_reaches_standard_output() -> None:
    """`print`, C libraries and child processes cannot write to the protocol's output."""
    program = """
import ctypes, subprocess
from optisense.engine.protocol import Channel
channel = Channel.of_standard_output()
print("from Python")
libc = ctypes.CDLL(None)
libc.puts(b"from C")
libc.fflush(None)
subprocess.run(["echo", "from a child"], check=True)
channel.send({"id": 1})
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert ended.stdout == b'{"id":1}\n'
    for said in (b"from Python", b"from C", b"from a child"):
        assert said in ended.stderr
