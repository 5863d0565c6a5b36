"""Workers forked from a process that has already imported their modules, which saves two seconds each.

From its first message on, a worker behaves as usual. Tests of how workers start and end use `real_workers`.
"""

import faulthandler
import multiprocessing
import os
import subprocess
import sys
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext, ForkServerProcess
from pathlib import Path
from typing import Any

_FORKING = multiprocessing.get_context("forkserver")
_FORKING.set_forkserver_preload(
    [
        *("vigil.runner.workers.worker", "vigil.sim.engines.fake", "vigil.sim.engines.mujoco"),
        *(
            "vigil.authoring.closure.generation",
            "vigil.authoring.packing.level_measurement",
            "vigil.analysis.measures.rows",
        ),
    ]
)


class PoolProcess(ForkServerProcess):
    """A process of a pool; like a new process, it has the environment variables of the process that starts it."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.environment = dict(os.environ)

    def run(self) -> None:
        os.environ.clear()
        os.environ.update(self.environment)
        super().run()


class PoolContext(ForkServerContext):
    """Context that starts the processes of a pool, in place of `vigil.base.processes.spawn_context`."""

    Process = PoolProcess


class ForkedWorker:
    """The part of `subprocess.Popen` that `vigil.runner.workers.process` uses."""

    def __init__(self, process: ForkServerProcess) -> None:
        self._process = process
        self.pid = process.pid

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit status. Raises subprocess.TimeoutExpired."""
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("worker", timeout or 0.0)
        return self._process.exitcode

    def terminate(self) -> None:
        """Ask the process to end."""
        self._process.terminate()

    def kill(self) -> None:
        """Kill the process."""
        self._process.kill()


def fork(fd: int, log: Path | None, environment: dict[str, str]) -> ForkedWorker:
    """Fork a worker on its end of a socket pair, as `vigil.runner.workers.process.launch` starts one."""
    connection = Connection(os.dup(fd))
    arguments = (connection, log or os.devnull, {**environment, **os.environ})
    process = _FORKING.Process(target=_work, args=arguments, daemon=True)
    process.start()
    connection.close()
    return ForkedWorker(process)


def _work(connection: Connection, log: Path | str, environment: dict[str, str]) -> None:
    from vigil.runner.workers.worker import serve  # noqa: PLC0415 - already imported by the forking process

    os.setsid()
    os.environ.clear()
    os.environ.update(environment)
    with open(log, "ab") as file, open(os.devnull, "rb") as nothing:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
        os.dup2(nothing.fileno(), 0)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115 - multiprocessing has replaced it
    faulthandler.enable()
    serve(connection)
