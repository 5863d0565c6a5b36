"""Worker processes of tests, forked from a template process that has imported the modules of workers.

Importing takes most of the processor time of a short worker. A forked worker is a child of the test's process, as one
that was started by `vigil.base.processes.worker.LocalProcess` is.
"""

import atexit
import ctypes
import gc
import importlib
import os
import pickle
import platform
import runpy
import signal
import socket
import subprocess
import sys
import threading
import traceback
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PRELOADED = (
    "vigil.runner.workers.worker",
    "vigil.sim.core.embedded",
    "vigil.assets.making",
    "vigil.sim.engines.fake",
    "vigil.authoring.solving.solvers",
    "vigil.authoring.streaming.houses",
    "vigil.agents.exec_agent",
    "PIL.JpegImagePlugin",
    "PIL.PngImagePlugin",
    "mujoco",
)
CLONE_PARENT = 0x8000
CLONE = {"x86_64": 56, "aarch64": 220}
"""Machine -> number of Linux's system call that makes a process."""
CAN_FORK = sys.platform == "linux" and platform.machine() in CLONE
_REQUEST_BYTES = 1 << 18
_lock = threading.Lock()


@cache
def _template(pid: int) -> tuple[socket.socket, "subprocess.Popen[bytes]"]:
    """Start the template of this process, which is `pid`; return the connection to the template, and the template."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.support.forked_workers", str(theirs.fileno())],
            pass_fds=(theirs.fileno(),),
            stdin=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            cwd=ROOT,
        )
    return ours, process


def end_template() -> None:
    """End this process's template, if it was started."""
    if _template.cache_info().currsize:
        connection, process = _template(os.getpid())
        connection.close()
        process.wait()


def execute_child(process: Any, args: Sequence[str], *options: Any) -> None:
    """Fork a worker from the template, in place of `subprocess.Popen._execute_child`, whose arguments these are."""
    (fd,), env, (stdin, _, _, stdout, _, stderr) = options[3], options[5], options[9:15]
    streams = [stdin, stdout if stdout != -1 else 1, stderr if stderr != -1 else 2]
    request = pickle.dumps((os.getcwd(), dict(env)))
    with _lock:
        template, _ = _template(os.getpid())
        socket.send_fds(template, [request], [fd, *streams])
        process.pid = int.from_bytes(template.recv(8), "little")
    process._child_created = True
    process._close_pipe_fds(*options[9:15])


def serve(connection: socket.socket) -> None:
    """Fork a worker for each request, until the other end is closed."""
    while True:
        request, fds, _, _ = socket.recv_fds(connection, _REQUEST_BYTES, 4)
        if not request:
            return
        pid = _fork_sibling()
        if pid == 0:
            connection.close()
            _become_worker(*pickle.loads(request), *fds)
        connection.send(pid.to_bytes(8, "little"))
        for fd in fds:
            os.close(fd)


def _fork_sibling() -> int:
    """Fork a child of this process's parent; return its process id, or 0 in the new process."""
    ctypes.pythonapi.PyOS_BeforeFork()
    pid = ctypes.PyDLL(None).syscall(CLONE[platform.machine()], CLONE_PARENT | signal.SIGCHLD, 0, 0, 0, 0)
    if pid == 0:
        ctypes.pythonapi.PyOS_AfterFork_Child()
    else:
        ctypes.pythonapi.PyOS_AfterFork_Parent()
    return pid


def _become_worker(folder: str, environment: dict[str, str], fd: int, *streams: int) -> None:
    """Do what `python -m vigil.base.processes FD` does, and exit."""
    code = 1
    try:
        os.setsid()
        os.chdir(folder)
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        os.environ.clear()
        os.environ.update(environment)
        sys.path[0] = folder
        sys.argv = ["", str(fd)]
        runpy.run_module("vigil.base.processes", run_name="__main__", alter_sys=True)
        code = 0
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 0
    except BaseException:  # noqa: BLE001 - the interpreter prints any error
        traceback.print_exc()
    finally:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        os._exit(code)


if __name__ == "__main__":
    os.environ["MUJOCO_GL"] = "disable"  # so that no OpenGL library is loaded before the worker's environment is known
    for name in PRELOADED:
        importlib.import_module(name)
    gc.collect()
    gc.freeze()
    serve(socket.socket(fileno=int(sys.argv[1])))
