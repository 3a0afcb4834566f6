"""Worker processes score each trial and report it once, even if some of them die."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from optisense.design import SensorDesign
from optisense.errors import SearchError, SetupError
from optisense.search import SearchProgress, search
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors import ExecutorRunner, ProcessPool, _remote
from optisense.search.space.search_space import BoundSpace, SearchSpace

LINE = {"coating.specularity": (0.0, 1.0, 11)}


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Log of the calls of objectives, and the files that they need."""
    monkeypatch.setenv("TRIAL_LOG", str(tmp_path / "log"))
    monkeypatch.setenv("STRUCK", str(tmp_path / "struck"))
    monkeypatch.setenv("CROWD", str(tmp_path / "crowd"))
    (tmp_path / "crowd").mkdir()
    return tmp_path / "log"


def calls(log: Path) -> Counter[float]:
    return Counter(float(line.split()[0]) for line in log.read_text().splitlines())


class Slow:
    """An evaluator that stores its process id in a folder and never returns."""

    renders = False

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, vector: np.ndarray, seed: int) -> Outcome:
        (self.folder / str(os.getpid())).touch()
        signal.pause()
        raise AssertionError


class Unfit:
    """An evaluator that can't be set up."""

    renders = False

    def __call__(self, vector: np.ndarray, seed: int) -> Outcome:
        raise AssertionError

    def __setstate__(self, state: object) -> None:
        raise SetupError("the renderer is missing", hint="Install it")

    def __getstate__(self) -> dict[str, object]:
        return {"anything": True}


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets workers import this file as they would a user's module."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    for kind in (Slow, Unfit):
        monkeypatch.setattr(kind, "__module__", Path(__file__).stem)
    monkeypatch.setitem(sys.modules, Path(__file__).stem, sys.modules[__name__])


class TestPool:
    @pytest.mark.usefixtures("forks")
    def test_scores_as_one_process_does(self, mini: SensorDesign, goals: ModuleType) -> None:
        space = {**LINE, "camera.position.x": (-1.0, 3.0, 3)}
        one, many = (
            search(mini, space, goals.nearness, method="grid", workers=workers)
            for workers in (1, 2)
        )
        assert [t.score for t in one.trials] == [t.score for t in many.trials]
        assert {trial.outcome.worker for trial in one.trials} == {""}
        assert "" not in {trial.outcome.worker for trial in many.trials}

    @pytest.mark.usefixtures("forks")
    def test_a_dead_worker_costs_its_trial_only(
        self, mini: SensorDesign, goals: ModuleType, log: Path
    ) -> None:
        result = search(mini, LINE, goals.struck, method="grid", workers=2)
        assert Path(os.environ["STRUCK"]).exists()
        assert len(result.trials) == 12
        assert all(trial.failure is None for trial in result.trials)
        # The start lies on the grid: it is one point, scored once.
        expected = Counter({float(trial.vector[0]) for trial in result.trials})
        expected += Counter(float(t.vector[0]) for t in result.trials for _ in t.fresh)
        assert calls(log) == expected

    @pytest.mark.usefixtures("forks")
    def test_a_trial_that_kills_its_workers_fails(
        self, mini: SensorDesign, goals: ModuleType
    ) -> None:
        space = {"coating.specularity": (0.0, 1.0, 3)}
        result = search(mini, space, goals.deadly, method="grid", workers=2)
        (failed,) = [trial for trial in result.trials if trial.failure]
        assert failed.values == {"coating.specularity": 1.0}
        assert "died 2 times (exit code 3" in str(failed.failure)

    @pytest.mark.usefixtures("here")
    def test_closing_ends_the_workers_at_once(self, tmp_path: Path) -> None:
        with ProcessPool(Slow(tmp_path), 2) as pool:
            futures = [pool.submit(np.zeros(1), 0) for _ in range(3)]
            while len(workers := [int(file.name) for file in tmp_path.iterdir()]) < 2:
                time.sleep(0.01)
        assert all(_gone(worker) for worker in workers)
        assert not any(future.done() and future.exception() is None for future in futures)

    @pytest.mark.usefixtures("here", "forks")
    def test_a_worker_that_can_not_be_set_up_ends_the_search(self) -> None:
        with ProcessPool(Unfit(), 2) as pool:
            future = pool.submit(np.zeros(1), 0)
            with pytest.raises(SetupError, match="renderer is missing") as told:
                future.result()
        assert told.value.hint == "Install it"

    def test_functions_that_others_can_not_find_are_refused(self, mini: SensorDesign) -> None:
        def local(design: SensorDesign) -> float:
            return 1.0

        with pytest.raises(SearchError, match="workers can't be given") as told:
            search(mini, LINE, local, method="grid", workers=2)
        assert "FILE.py:FUNCTION" in str(told.value.hint)
        with pytest.raises(SearchError, match="number of workers is 0"):
            search(mini, LINE, local, method="grid", workers=0)


def test_any_executor_will_do(two_numbers: BoundSpace, goals: ModuleType) -> None:
    evaluator = DesignEvaluator(two_numbers, [goals.nearness])
    with ThreadPoolExecutor(2) as threads, ExecutorRunner(evaluator, threads) as runner:
        outcome = runner.submit(two_numbers.start, 0).result()
    assert outcome.scores["nearness"] == goals.nearness(two_numbers.design)


needs_dask = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None, reason="the extra 'dask' is not installed"
)


def test_a_remote_without_a_package_of_the_search_names_itself_and_the_package() -> None:
    evaluator = b"cno_such_package\nObjective\n."  # a pickle that names a class of a module
    with pytest.raises(SetupError, match="No module named 'no_such_package'") as found:
        _remote.score_trial("a search", evaluator, np.zeros(1), 0)
    assert socket.gethostname() in found.value.message
    assert "Install the same packages" in str(found.value.hint)


def test_without_dask_the_extra_is_named(
    mini: SensorDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SetupError, match=r"optisense\[dask\]"):
        search(mini, {"camera.fov": (40, 50)}, "aoap", budget=1, workers="tcp://127.0.0.1:1")


@needs_dask
class TestDask:
    @pytest.mark.slow
    def test_no_scheduler(
        self,
        mini: SensorDesign,
        goals: ModuleType,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        monkeypatch.setattr(_remote, "CONNECT_SECONDS", 1.0)
        with pytest.raises(SetupError, match="is not the address"):
            search(mini, LINE, goals.nearness, workers="somewhere", out=tmp_path / "study")
        with pytest.raises(SetupError, match="no Dask scheduler answers") as told:
            search(mini, LINE, goals.nearness, workers="tcp://127.0.0.1:9", out=tmp_path / "study")
        assert "dask scheduler" in str(told.value.hint)
        assert not (tmp_path / "study").exists()  # nothing was scored: nothing is left

    @pytest.mark.slow
    def test_one_worker_is_killed_and_one_added(
        self,
        mini: SensorDesign,
        goals: ModuleType,
        goals_folder: Path,
        log: Path,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        """Two single-threaded workers; one dies at 0.5, one comes, and nothing is lost."""
        path = os.pathsep.join([str(goals_folder), *filter(None, sys.path)])
        monkeypatch.setenv("PYTHONPATH", path)
        file = tmp_path / "scheduler.json"
        with ExitStack() as processes:
            address = processes.enter_context(scheduler(file))
            for _ in range(2):
                processes.enter_context(worker(address))
            added: list[object] = []

            def add_one(progress: SearchProgress) -> None:
                if not added and progress.done >= 6:
                    added.append(processes.enter_context(worker(address)))

            space = SearchSpace({"coating.specularity": (0.0, 1.0, 21)})
            result = search(
                mini,
                space,
                goals.crowded,
                method="grid",
                workers=address,
                out=tmp_path / "study",
                progress=add_one,
            )
        assert len(result.trials) == 22
        assert all(trial.failure is None for trial in result.trials)
        assert len({trial.outcome.worker for trial in result.trials}) >= 2
        assert len(list(Path(os.environ["CROWD"]).iterdir())) == 3
        rows = result.study.store.rows()
        assert sorted(float(row.vector[0]) for row in rows[1:]) == pytest.approx(
            np.linspace(0, 1, 21)
        )


@contextmanager
def scheduler(file: Path) -> Iterator[str]:
    """A Dask scheduler in a process of its own; gives its address."""
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1"]
    command += ["--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
    with started(command) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "Scheduler at:" in line:
                yield line.split()[-1]
                return
        raise AssertionError("the scheduler did not start")


@contextmanager
def worker(address: str) -> Iterator[object]:
    """A single-threaded Dask worker in a process of its own."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address]
    command += ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
    with started(command) as process:
        yield process


@contextmanager
def started(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _gone(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False
