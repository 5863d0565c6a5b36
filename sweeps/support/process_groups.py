"""Commands started in separate process groups, by a fork or by a command line, and the processes left of them."""

import os
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

TOKEN_VARIABLE = "VIGIL_SWEEP_TOKEN"
"""Environment variable that identifies the processes of a life."""
LEFT_S = 20.0
"""Seconds within which processes must notice that their parent has gone."""


@dataclass
class ProcessGroup:
    """A process that leads a group."""

    pid: int
    output: Path
    code: int | None = None

    def wait(self, seconds: float) -> int | None:
        """Return the exit code, or None when the process still runs after the timeout."""
        deadline = time.monotonic() + seconds
        while self.code is None:
            found, status = os.waitpid(self.pid, os.WNOHANG)
            if found:
                self.code = os.waitstatus_to_exitcode(status)
            elif time.monotonic() > deadline:
                break
            else:
                time.sleep(0.005)
        return self.code

    def signal(self, number: int) -> None:
        """Send a signal: SIGKILL to the whole group, another one to its leader."""
        if number == signal.SIGKILL:
            os.killpg(self.pid, number)
        else:
            os.kill(self.pid, number)

    def output_tail(self) -> str:
        """Return the end of what was printed."""
        return self.output.read_text(errors="replace")[-600:].strip()


def start(what: Callable[[], None] | Sequence[str], token: str, folder: Path) -> ProcessGroup:
    """Start a function in a fork, or a command line of `vigil`; its output goes to a file next to `folder`."""
    output = folder.with_name(f"{folder.name}.output")
    if not callable(what):
        command = [sys.executable, "-c", "from vigil.cli import main; main()", *what]
        with output.open("wb") as file:
            process = subprocess.Popen(
                command, stdout=file, stderr=file, start_new_session=True, env={**os.environ, TOKEN_VARIABLE: token}
            )
        process.returncode = 0  # `ProcessGroup` waits for it
        return ProcessGroup(process.pid, output)
    sys.stdout.flush()
    pid = os.fork()
    if pid:
        return ProcessGroup(pid, output)
    code = 70
    try:
        os.setsid()
        os.environ[TOKEN_VARIABLE] = token
        fd = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(fd, 1)
        os.dup2(fd, 2)
        what()
        code = 0
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    except BaseException:  # noqa: BLE001 - a fork must not go on into the sweep
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def leftovers(token: str) -> list[str]:
    """Return the processes of a life that do not end by themselves, and end them."""
    deadline = time.monotonic() + LEFT_S
    while (found := _processes_with(token)) and time.monotonic() < deadline:
        time.sleep(0.05)
    for pid in found:
        os.kill(pid, signal.SIGKILL)
    return list(found.values())


def _processes_with(token: str) -> dict[int, str]:
    found = {}
    wanted = f"{TOKEN_VARIABLE}={token}".encode()
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            if wanted in (entry / "environ").read_bytes().split(b"\0"):
                found[int(entry.name)] = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
    return found
