"""No command loses what another one, or the user, has put into a folder: with real processes."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner
from warm_python import programs

import optisense as ots
from optisense.cli import app
from optisense.errors import OptiSenseError
from optisense.folders import FolderLock
from optisense.search import SearchSpace, Study, search
from optisense.search.executors import _remote

OWN_FILE = '''
import os
from pathlib import Path

HERE = Path(__file__).parent

def meet(name):
    """Tell the test that this place is reached, and wait until it says go."""
    if (HERE / name).exists():
        with (HERE / name).open("w") as place:
            place.write(str(os.getpid()))
        with (HERE / f"{name}-go").open() as place:
            place.read()

meet("loaded")

def fine(design):
    meet("asked")
    return True

def score(evaluation):
    return evaluation.design.coating.specularity
'''


class Meeting:
    """Barrier in the user's file at which processes wait for the test."""

    def __init__(self, folder: Path, name: str) -> None:
        self._here, self._go = folder / name, folder / f"{name}-go"
        os.mkfifo(self._here)
        os.mkfifo(self._go)

    def wait(self) -> int:
        """Wait until a process has reached the barrier, and return its number."""
        with self._here.open() as place:
            return int(place.read())

    def go(self) -> None:
        """Release the process, and let all others pass."""
        self._here.unlink()
        with self._go.open("w") as place:
            place.write("go")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    file = tmp_path / "mine.py"
    file.write_text(OWN_FILE)
    return file


_started: list[subprocess.Popen[str]] = []


@pytest.fixture(autouse=True)
def _none_stays() -> Iterator[None]:
    yield
    for process in _started:
        if process.returncode is None:
            process.kill()
            process.communicate()
    _started.clear()


def started(*words: object) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [programs() / "optisense", *map(str, words)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    _started.append(process)
    return process


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    said, _ = process.communicate()
    return process.returncode, said


def ran(*words: object) -> tuple[int, str]:
    return ended(started(*words))


def ran_here(*words: object) -> tuple[int, str]:
    """The same in this process."""
    result = CliRunner().invoke(app, list(map(str, words)))
    return result.exit_code, result.output


def search_words(mine: Path, out: Path, *more: object) -> list[object]:
    return ["search", "gelsight-mini-ideal", "--vary", "coating.specularity=0:1",
            "-b", f"{mine}:score", "--rule", f"{mine}:fine", "--budget", 3, "--method", "random",
            "--out", out, *more]  # fmt: skip


@pytest.mark.slow
def test_a_study_that_runs_is_not_touched_by_others(mine: Path, tmp_path: Path) -> None:
    """While its first trial runs, neither --resume nor a new search changes anything in it."""
    asked = Meeting(tmp_path, "asked")
    out = tmp_path / "study"
    first = started(*search_words(mine, out))
    running = asked.wait()
    (out / "notes.txt").write_text("mine")
    for words in (["search", "--resume", "--trust", "--out", out], search_words(mine, out)):
        code, said = ran(*words)
        assert code == 1, said
        assert f"process {running} on" in said
        assert "Wait for it" in said
    code, said = ran("apply", out, "--out", tmp_path / "early")
    assert code == 2 and "No trial is finished yet" in said
    asked.go()
    code, said = ended(first)
    assert code == 0, said
    assert ran("apply", out, "--out", tmp_path / "better")[0] == 0
    ots.load(tmp_path / "better")
    assert (out / "notes.txt").read_text() == "mine"
    with contextlib.closing(Study.open(out)) as study:
        assert len(study.trials) == 4


@pytest.mark.slow
def test_of_two_searches_that_begin_at_once_one_wins(mine: Path, tmp_path: Path) -> None:
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        folder.mkdir()
    files = [Path(shutil.copy(mine, folder)) for folder in folders]
    loaded = [Meeting(folder, "loaded") for folder in folders]
    out = tmp_path / "study"
    processes = [started(*search_words(file, out)) for file in files]
    for place in loaded:
        place.wait()
    for place in loaded:
        place.go()
    results = [ended(process) for process in processes]
    codes = [code for code, _ in results]
    assert codes.count(0) == 1, results
    lost = results[1 - codes.index(0)][1]
    assert "another process is writing" in lost or "a study in this folder already" in lost
    with contextlib.closing(Study.open(out)) as study:
        assert len(study.trials) == 4
        assert study.settings.rules == [f"{files[codes.index(0)]}:fine"]


@pytest.mark.slow
def test_of_two_datasets_in_one_folder_one_wins_whole(tmp_path: Path) -> None:
    out = tmp_path / "dataset"
    small = ["--count", 1, "--photons", 20000, "--resolution", "32x24"]
    processes = [
        started("dataset", sensor, "--out", out, "--seed", seed, *small)
        for sensor, seed in (("gelsight-mini-ideal", 1), ("gelsight-mini-ideal", 2))
    ]
    results = [ended(process) for process in processes]
    codes = [code for code, _ in results]
    assert codes.count(0) == 1, results
    lost = results[1 - codes.index(0)][1]
    assert "another process is writing" in lost or "with other settings" in lost
    made = json.loads((out / "dataset.json").read_text())
    assert made["settings"]["seed"] == 1 + codes.index(0)
    assert made["design_name"] == ots.load(out / "design").name
    again = ran("dataset", "gelsight-mini-ideal", "--out", out,
                "--seed", 1 + codes.index(0), *small)  # fmt: skip
    assert again[0] == 0, again[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["new", "gelsight-mini-ideal"],
        ["render", "gelsight-mini-ideal", "--photons", 1000, "--out"],
        ["dataset", "gelsight-mini-ideal", "--count", 1, "--out"],
        ["export", "gelsight-mini-ideal", "--out"],
        ["task", "cylinder-radius", "gelsight-mini-ideal", "--out"],
        ["tolerance", "gelsight-mini-ideal", "--out"],
        ["evaluate", "gelsight-mini-ideal", "--out"],
    ],
    ids=lambda words: words[0],
)
def test_every_command_asks_for_the_lock(words: list[object], tmp_path: Path) -> None:
    lock = FolderLock(tmp_path / "out")
    code, said = ran(*words, tmp_path / "out")
    assert code == 1, said
    assert f"process {os.getpid()} on" in said
    assert [path.name for path in (tmp_path / "out").iterdir()] == [".optisense.lock"]
    lock.release()


@pytest.mark.slow
@pytest.mark.parametrize("cause", ["cluster", "rule", "all fail"])
def test_a_failed_search_removes_nothing_of_others(
    cause: str, mine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it made itself is removed where it holds no trial; a study that was there stays."""
    out = tmp_path / "study"
    run = ran
    if cause == "cluster":
        run = ran_here  # which need not wait long for a scheduler
        monkeypatch.setattr(_remote, "CONNECT_SECONDS", 0.5)
        code, said = run(*search_words(mine, out, "--cluster", "tcp://127.0.0.1:9"))
        assert code == 1 and "no Dask scheduler answers" in said
        assert "the study was removed" in said
        assert not out.exists()
    elif cause == "all fail":
        mine.write_text(OWN_FILE.replace("return True", "return 'never'"))
        code, said = ran(*search_words(mine, out))
        assert code == 2 and "have failed" in said
    if cause != "all fail":
        words = search_words(mine, out)
        asked = Meeting(tmp_path, "asked")
        first = started(*words)
        asked.wait()
        first.kill()
        first.communicate()
        (tmp_path / "asked").unlink()
    (out / "notes.txt").write_text("mine")
    before = (out / "study.json").read_text()
    more: list[object] = []
    if cause == "cluster":
        more = ["--cluster", "tcp://127.0.0.1:9"]
    else:
        mine.write_text(mine.read_text() + "\n# edited\n")
    code, said = run("search", "--resume", "--trust", "--out", out, *more)
    assert code != 0
    assert (out / "notes.txt").read_text() == "mine"
    assert (out / "study.json").read_text() == before
    if cause == "cluster":
        assert "keeps its 0 finished trials" in said
        code, said = ran("search", "--resume", "--trust", "--out", out)
        assert code == 0, said
    else:
        assert "was edited" in said


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A finished study."""

    def brightness(design: ots.SensorDesign) -> float:
        return design.coating.specularity

    space = SearchSpace({"coating.specularity": (0.0, 1.0)})
    out = tmp_path / "study"
    search(ots.load("gelsight-mini-ideal"), space, brightness, budget=4, out=out).study.close()
    return out


@contextlib.contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """The folder as on a read-only disk; for root by a mount, which needs its rights."""
    if os.geteuid():
        folder.chmod(0o555)
        yield
        folder.chmod(0o755)
        return
    for words in (["--bind", folder, folder], ["-o", "remount,ro,bind", folder]):
        if subprocess.run(["mount", *map(str, words)], capture_output=True).returncode:
            pytest.skip("nothing can be mounted here, and root may write anywhere")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("killed", [False, True], ids=["closed", "killed"])
def test_looking_at_a_study_needs_no_writing(killed: bool, study: Path, tmp_path: Path) -> None:
    """Also where its last trials are still in the write-ahead log, as after a kill."""
    if killed:
        holding = Study.open(study)
        holding.lock()
        holding.store.set_fact("ended", "in the log")
        other = tmp_path / "copy"
        shutil.copytree(study, other, ignore=shutil.ignore_patterns("*-shm", ".*"))
        holding.close()
        study = other
        assert (study / "trials.sqlite-wal").stat().st_size > 0
    before = sorted(path.name for path in study.iterdir())
    with read_only(study):
        code, said = ran("apply", study, "--out", tmp_path / "better")
        assert code == 0, said
        code, said = ran("report", study, "--no-pictures", "--out", tmp_path / "page.html")
        assert code == 0, said
        code, said = ran("report", study, "--no-pictures")
        assert code == 1 and "can't be written" in said and "--out" in said
        code, said = ran("search", "--resume", "--out", study)
        assert code in (1, 2), said
        assert "unexpected" not in said
        with contextlib.closing(Study.open(study)) as opened:
            assert opened.store.fact("ended") == ("in the log" if killed else "the budget is spent")
    assert sorted(path.name for path in study.iterdir()) == before
    assert "<html" in (tmp_path / "page.html").read_text()
    ots.load(tmp_path / "better")


def test_looking_at_a_study_leaves_its_folder_as_it_was(study: Path) -> None:
    before = sorted(study.iterdir())
    with contextlib.closing(Study.open(study)) as opened:
        assert len(opened.trials) == 5
        assert sorted(study.iterdir()) == before
    assert sorted(study.iterdir()) == before


@contextlib.contextmanager
def small_disk(place: Path, size: str) -> Iterator[Path]:
    """A file system in memory of the given size."""
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("only root can make a small file system")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["new", "gelsight-mini-ideal"],
        ["export", "gelsight-mini-ideal", "--out"],
        ["render", "gelsight-mini-ideal", "--photons", 1000, "--resolution", "64x48", "--out"],
    ],
    ids=lambda words: words[0],
)
def test_a_full_disk_leaves_nothing_half(words: list[object], tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", "48k") as disk:
        code, said = ran(*words, disk / "out")
        assert code == 1, said
        assert "No space left on device" in said and "unexpected" not in said
        assert not [path for path in disk.rglob("*") if path.is_file()]


@pytest.mark.slow
def test_a_read_only_folder_is_told_before_the_work(tmp_path: Path) -> None:
    with read_only(tmp_path):
        for words in (
            ["export", "gelsight-mini-ideal", "--out"],
            ["dataset", "gelsight-mini-ideal", "--out"],
        ):
            code, said = ran(*words, tmp_path / "out")
            assert code == 1, said
            assert "can't be written" in said and "tracing" not in said


@pytest.mark.slow
def test_a_full_disk_is_told_as_it_is(tmp_path: Path) -> None:
    """On a file system of 2 MB: first too small for a study, then for all of its trials."""
    design = ots.load("gelsight-mini-ideal")
    space = SearchSpace({"coating.specularity": (0.0, 1.0)})

    def brightness(design: ots.SensorDesign) -> float:
        return design.coating.specularity

    with small_disk(tmp_path / "disk", "2m") as disk:
        mine = disk / "mine.txt"
        mine.write_text("m" * 1_950_000)
        with pytest.raises(OptiSenseError) as told:
            search(design, space, brightness, budget=3, out=disk / "study")
        assert "No space left" in told.value.message or "disk is full" in told.value.message
        assert "kept" not in str(told.value)
        assert [path.name for path in disk.iterdir()] == ["mine.txt"]
        mine.write_text("mine")
        with pytest.raises(OptiSenseError, match="disk is full") as told:
            search(design, space, brightness, method="random", budget=20000, out=disk / "study")
        study = Study.open(disk / "study")
        finished = len(study.trials)
        study.close()
        assert f"keeps its {finished} finished trials" in str(told.value.hint)
        assert finished > 10
        assert mine.read_text() == "mine"


@pytest.mark.slow
def test_of_two_parts_of_one_name_one_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = tmp_path / "library"
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(library))
    sources = []
    for number in (1, 2):
        file = tmp_path / str(number) / "twin.yaml"
        file.parent.mkdir()
        file.write_text(PART.format(number=number))
        sources.append(file)
    results = [ended(process) for process in [started("library", "add", file) for file in sources]]
    codes = [code for code, _ in results]
    assert codes.count(0) == 1, results
    assert "already has a material 'twin'" in results[1 - codes.index(0)][1]
    stored = (library / "materials" / "twin.yaml").read_text()
    assert f"number {1 + codes.index(0)}" in stored
    assert [path.name for path in library.rglob(".*")] == []


PART = """
description: number {number}
value: {{kind: dielectric, ior: 1.4, roughness: 0.{number}}}
sources: {{ior: {{status: assumed, source: a guess}}}}
"""
