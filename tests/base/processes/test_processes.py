"""Worker processes: what they answer, and that none is left when the process that started them is killed."""

import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import psutil
import pytest

from tests.support.waiting import HANGS_AFTER_S
from vigil.base.processes.child import report
from vigil.base.processes.group import given_state, map_in_workers
from vigil.base.processes.worker import Worker, WorkerLost, WorkerSettings
from vigil.errors import SettingError, SimulatorError

pytestmark = pytest.mark.usefixtures("started_workers")

SCRIPT = """
import time
from functools import partial
from operator import call
from vigil.base.processes.group import given_state, map_in_workers

answers = map_in_workers(partial(given_state, time.sleep), call, [0.2] * 1000, 2)
next(answers)
print("at work", flush=True)
list(answers)
"""


class Notebook:
    """State of a worker: a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.note("begun")

    def note(self, text: str) -> int:
        with self.path.open("a") as file:
            file.write(f"{text}\n")
        return os.getpid()

    def refuse(self) -> None:
        raise LookupError("nothing here")

    def die_once(self, item: int) -> int:
        if self.path.read_text().count("begun") < 2:
            self.note("dies")
            os._exit(3)
        return item

    def tell(self) -> int:
        report("one")
        report("two", is_awaited=True)
        return len(self.path.read_text().splitlines())

    def close(self) -> None:
        self.note("closed")


@pytest.fixture
def notes(tmp_path: Path) -> Path:
    return tmp_path / "notes"


def test_a_state_is_made_once_and_closed_at_the_end(notes: Path) -> None:
    worker = Worker(partial(Notebook, notes), "Notebook")
    assert worker.pid is None
    pids = [worker.submit(Notebook.note, text).result(HANGS_AFTER_S) for text in "ab"]
    assert pids == [worker.pid] * 2
    assert os.getpid() not in pids
    worker.close()
    worker.join()
    assert notes.read_text().split() == ["begun", "a", "b", "closed"]
    with pytest.raises(WorkerLost, match="Notebook has been closed"):
        worker.submit(Notebook.note, "c").result(HANGS_AFTER_S)


def test_events_are_handled_before_the_answer(notes: Path) -> None:
    worker, events = Worker(partial(Notebook, notes), "Notebook"), list[str]()

    def on_event(event: str) -> None:
        events.append(event)
        with notes.open("a") as file:
            file.write(f"{event}\n")

    assert worker.submit(Notebook.tell, on_event=on_event).result(HANGS_AFTER_S) == 3
    assert events == ["one", "two"]
    worker.close()


def test_an_error_is_raised_with_the_traceback_of_the_process_or_as_the_settings_say(notes: Path) -> None:
    worker = Worker(partial(Notebook, notes), "Notebook")
    with pytest.raises(LookupError, match="nothing here") as raised:
        worker.submit(Notebook.refuse).result(HANGS_AFTER_S)
    assert "in refuse" in raised.value.__notes__[0]
    with pytest.raises(SettingError, match="Cannot send <lambda> to Notebook"):
        worker.submit(lambda _: 1).result(HANGS_AFTER_S)
    worker.close()
    worker = Worker(partial(Notebook, notes), "Notebook", WorkerSettings(fault=SimulatorError))
    with pytest.raises(SimulatorError, match=r"^Traceback[\s\S]*in refuse[\s\S]*LookupError: nothing here"):
        worker.submit(Notebook.refuse).result(HANGS_AFTER_S)
    worker.close()


def test_a_process_that_died_is_replaced_for_the_next_request(notes: Path) -> None:
    worker = Worker(partial(Notebook, notes), "Notebook", WorkerSettings(advice="Why?"))
    with pytest.raises(WorkerLost, match=r"^Notebook died \(exit code 3\)\. Why\?$"):
        worker.submit(Notebook.die_once, 7).result(HANGS_AFTER_S)
    assert worker.submit(Notebook.die_once, 7).result(HANGS_AFTER_S) == 7
    worker.close()


def test_results_come_in_order_though_a_process_dies(notes: Path) -> None:
    notes.touch()
    assert list(map_in_workers(partial(Notebook, notes), Notebook.die_once, range(5), 2)) == [0, 1, 2, 3, 4]


def test_what_a_process_prints_goes_to_the_log_or_where_this_process_prints(tmp_path: Path, capfd) -> None:
    log = tmp_path / "log"
    for settings in (WorkerSettings(log=log), WorkerSettings(log=None)):
        worker = Worker(partial(given_state, "hello"), "Printer", settings)
        worker.submit(print).result(HANGS_AFTER_S)
        worker.close()
        worker.join()
    assert log.read_text() == capfd.readouterr().out == "hello\n"


def test_one_worker_works_in_this_process() -> None:
    items = [-1, 2]
    assert list(map_in_workers(partial(given_state, 3), pow, items, 1)) == [1 / 3, 9]
    assert list(map_in_workers(partial(given_state, 3), pow, items, 2)) == [1 / 3, 9]


@pytest.mark.skipif(sys.platform == "win32", reason="kills by a signal")
def test_killed_processes_leave_no_workers(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "at work\n"
        workers = psutil.Process(process.pid).children(recursive=True)
        assert len(workers) >= 2
        process.kill()
    _, alive = psutil.wait_procs(workers, timeout=HANGS_AFTER_S)
    assert [worker for worker in alive if worker.status() != psutil.STATUS_ZOMBIE] == []


def test_an_iteration_that_is_left_ends_the_processes(notes: Path) -> None:
    before = set(psutil.Process().children())
    answers = map_in_workers(partial(given_state, None), _sleep, [0.0, 1000.0, 1000.0], 2)
    next(answers)
    del answers
    assert set(psutil.Process().children()) == before


def _sleep(_: None, seconds: float) -> None:
    time.sleep(seconds)
