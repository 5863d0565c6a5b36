import subprocess
import sys

import psutil
import pytest

from tests.support.waiting import HANGS_AFTER_S
from vigil.base.processes import worker_pool

SCRIPT = """
import time
from vigil.base.processes import worker_pool

if __name__ == "__main__":
    with worker_pool(2) as pool:
        futures = [pool.submit(time.sleep, 0.2) for _ in range(1000)]
        futures[1].result()
        print("at work", flush=True)
        futures[-1].result()
"""


def begin(folder: str, name: str) -> None:
    with open(f"{folder}/{name}", "a") as file:
        file.write("begun\n")


def test_workers_begin_with_what_they_are_told(tmp_path) -> None:
    with worker_pool(2, begin, str(tmp_path), "log") as pool:
        assert list(pool.map(abs, [-1, -2])) == [1, 2]
    assert "begun" in (tmp_path / "log").read_text()


@pytest.mark.skipif(sys.platform == "win32", reason="kills by a signal")
def test_killed_processes_leave_no_workers(tmp_path) -> None:
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
