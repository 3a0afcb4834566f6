"""The handshake, lines that make no sense, and how a conversation ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import optisense
from optisense.engine.protocol import Request, checked_fields
from optisense.engine.requests import find, names
from optisense.engine.server import AT_ONCE


def test_hello_tells_the_versions_and_the_process(start: Callable[..., Any]) -> None:
    client = start(python=sys.executable)
    assert client.greeting["protocol"] == 1
    assert client.greeting["version"] == optisense.__version__
    assert client.greeting["pid"] == client.process.pid
    assert client.leave() == 0


def test_every_request_is_documented() -> None:
    page = (Path(__file__).parents[2] / "docs" / "engine.md").read_text(encoding="utf-8")
    shown = [json.loads(line[2:]) for line in page.splitlines() if line.startswith("> {")]
    assert {each["do"] for each in shown} == {*AT_ONCE, *names()}


def test_the_fields_that_the_documentation_shows_are_taken() -> None:
    """None is refused as unknown or of the wrong kind."""
    page = (Path(__file__).parents[2] / "docs" / "engine.md").read_text(encoding="utf-8")
    shown = [json.loads(line[2:]) for line in page.splitlines() if line.startswith("> {")]
    for each in shown:
        number, do = each.pop("id"), each.pop("do")
        if do not in AT_ONCE:
            checked_fields(find(do).fields, Request(number, do, each))


def test_an_engine_of_another_protocol_says_so_and_goes_on(start: Callable[..., Any]) -> None:
    client = start(hello=False)
    error = client.refused("hello", protocol=999, folder=str(client.folder))
    assert error["kind"] == "ProtocolError"
    assert "999" in error["message"] and "protocol 1" in error["message"]
    assert client.refused("sensors")["message"].startswith("'sensors' came before 'hello'")
    missing = client.refused("hello", protocol=1, folder=str(client.folder / "nowhere"))
    assert (missing["kind"], missing["where"]) == ("OutputError", str(client.folder / "nowhere"))
    assert client.ask("hello", protocol=1, folder=str(client.folder))["protocol"] == 1


def test_junk_is_answered_and_survived(start: Callable[..., Any]) -> None:
    client = start()
    junk = [b"junk\n", b"\xff\xfe\x00\n", b"[1, 2]\n", b'{"id": [], "do": "check"}\n']
    for line in [b"\n", *junk, b"   \n"]:
        client.write(line)
    assert len(client.ask("sensors")["sensors"]) >= 6
    refusals = [m for m in client.all if m["id"] is None]
    assert len(refusals) == len(junk)
    assert all(m["error"]["kind"] == "ProtocolError" for m in refusals)
    client.write(b'{"id": "x", "do": "sensors"}')  # the last line, without an end
    assert client.leave() == 0
    assert client.wait("x")


@pytest.mark.parametrize(
    ("do", "fields", "said"),
    [
        ("simulat", {}, "Did you mean 'simulate'?"),
        ("simulate", {"desing": "gelbelt"}, "Did you mean 'design'?"),
        ("simulate", {"design": "gelsight-mini-ideal", "photons": "many"}, None),
        ("simulate", {"design": "gelsight-mini-ideal", "files": ["movie"]}, None),
        ("simulate", {"design": "gelsight-mini-ideal", "photons": -1}, None),
        ("simulate", {"design": {}}, "Write a name"),
        ("cancel", {}, "Add it"),
        ("simulate", {"design": "gelsight-mini-ideal", "name": "../x"}, "Use letters"),
    ],
)
def test_a_mistaken_request_is_refused_before_any_work(
    engine: Any, do: str, fields: dict[str, Any], said: str | None
) -> None:
    error = engine.refused(do, **fields)
    assert error["kind"] in ("ProtocolError", "OutputError")
    assert said is None or said in (error["hint"] or "")
    assert "Traceback" not in json.dumps(error)


def test_an_id_that_is_taken_is_refused_and_the_first_answered_once(engine: Any) -> None:
    engine.write(b'{"id": "twin", "do": "sensors"}\n{"id": "twin", "do": "sensors"}\n')
    assert engine.wait("twin")["ok"]
    engine.ask("methods")  # a later answer: by now both were taken
    answers = [m for m in engine.all if m["id"] == "twin" and "ok" in m]
    refusals = [m for m in engine.all if m["id"] is None and "'twin'" in m["error"]["message"]]
    assert len(answers) + len(refusals) == 2  # the second one may come after the first is done
    assert all(m["ok"] for m in answers)


def test_it_ends_when_its_input_does(start: Callable[..., Any]) -> None:
    client = start()
    assert client.leave() == 0
    with pytest.raises(EOFError):
        client.next()


def test_it_ends_when_its_front_end_is_killed(
    tmp_path: Path, wait_until_gone: Callable[[int], None]
) -> None:
    program = f"""
import subprocess, sys, time
engine = subprocess.Popen(
    [sys.executable, "-m", "optisense.cli", "engine"],
    stdin=subprocess.PIPE, stdout=subprocess.PIPE,
)
engine.stdin.write(b'{{"id": 1, "do": "hello", "protocol": 1, "folder": "{tmp_path}"}}\\n')
engine.stdin.flush()
engine.stdout.readline()
print(engine.pid, flush=True)
time.sleep(1000)
"""
    front = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert front.stdout is not None
    number = int(front.stdout.readline())
    os.kill(number, 0)  # it is there
    front.kill()
    front.wait()
    wait_until_gone(number)


def test_a_killed_engine_ends_what_it_says(start: Callable[..., Any]) -> None:
    client = start()
    client.process.send_signal(signal.SIGKILL)
    with pytest.raises(EOFError):
        client.next()


def test_shutdown_answers_everything_first(start: Callable[..., Any]) -> None:
    client = start()
    waiting = [client.send("sensors") for _ in range(3)]
    last = client.send("shutdown")
    assert client.result(last) == {}
    assert all("ok" in client.wait(number) for number in waiting)
    assert client.process.wait() == 0
    with pytest.raises(EOFError):
        client.next()
    assert client.all[-1]["id"] == last
