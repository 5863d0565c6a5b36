"""A separate program that exchanges lines with VIGIL: how it is started, written to, read from and ended.

The program gets a new folder outside the run's folder as its working directory, home and place for temporary files. It
gets three pipes and no other open file, and the user's environment variables without those of VIGIL. So the program
does not learn any path to hidden state, or to files that it wrote when it was started before.
"""

import array
import contextlib
import fcntl
import hashlib
import math
import os
import select
import shutil
import signal
import site
import subprocess
import sys
import tempfile
import termios
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from vigil.errors import SettingError
from vigil.protocol.actions import ReplyCut

CODE_SUFFIXES = frozenset(
    {".py", ".sh", ".js", ".mjs", ".ts", ".jl", ".rb", ".pl", ".lua", ".yaml", ".yml", ".toml", ".ini", ".cfg"}
)
"""Suffixes of files that contain a program's code or settings."""
EXIT_TIMEOUT_S = 2.0
"""Time (s) that a program may take to end by itself."""
MAX_LINE_BYTES = 1024 * 1024
"""Greatest length of an answer; a longer answer is cut to this length and counts as too long."""
_CHUNK = 1 << 16
_POLL_SECONDS = 0.002
_OWN_PREFIXES = ("VIGIL_", "INSPECT_")
"""Prefixes of environment variables that the program does not get: those of VIGIL and of the library Inspect."""
_FOLDER_VARIABLES = ("PWD", "HOME", "TMPDIR", "TMP", "TEMP")
"""Environment variables that are set to the program's folder."""
_OTHER_FOLDER_VARIABLES = (
    "OLDPWD",
    "XDG_CACHE_HOME",
    "XDG_CONFIG_HOME",
    "XDG_DATA_HOME",
    "XDG_STATE_HOME",
    "XDG_RUNTIME_DIR",
)
"""Environment variables with the user's other folders. They are removed, so that the program uses its own folder."""
_SEARCH_PATH_VARIABLES = ("PATH", "PYTHONPATH")
"""Environment variables that are lists of folders; relative folders in them are made absolute."""

Redact = Callable[[str], str]
"""Function that returns a text without secrets."""


class ProgramFault(Exception):
    """An error of the program: it ended, hung, or wrote without a request. The program is not running any more."""

    def __init__(self, what: str, partial_output: bytes = b"", stderr_line: str = "") -> None:
        super().__init__(what)
        self.partial_output = partial_output
        """The part of an answer that the program wrote before the fault."""
        self.stderr_line = stderr_line
        """Last line that the program wrote to standard error, without secrets."""


class Program:
    """One running program. Methods except `close` raise ProgramFault if the program ends, hangs, or writes unasked."""

    def __init__(self, arguments: Sequence[str], folder: Path, timeout_s: float, redact: Redact) -> None:
        """Start the program with `folder` as its working directory. Raises OSError when it cannot be started.

        `timeout_s` is only quoted in messages; each call has its own deadline. `redact` removes secrets from logs.
        """
        self._duration = f"for {timeout_s:g} s"
        self._sent = 0
        self._has_begun_to_read: bool | None = None
        self._process = subprocess.Popen(
            arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,
            cwd=folder,
            env=program_environment(os.environ, Path.cwd(), folder),
        )
        for pipe in (self._process.stdin, self._process.stdout):
            os.set_blocking(_fileno(pipe), False)
        self._pending = bytearray()
        self._last_stderr_line = ""
        self._stderr = threading.Thread(
            target=self._copy_stderr, args=(_fileno(self._process.stderr), redact), daemon=True
        )
        self._stderr.start()

    @property
    def is_running(self) -> bool:
        """Whether the process is running."""
        return self._process.poll() is None

    def wait_until_read(self, deadline: float) -> None:
        """Wait until the program has read all that was sent; the last line break may still be unread."""
        while self.unread() > 1:
            ready, _, _ = select.select([_fileno(self._process.stdout)], [], [], _POLL_SECONDS)
            if ready:
                self.refuse_stray_output()
            if time.monotonic() > deadline:
                raise self.fault(f"does not read its input {self._duration}")

    def unread(self) -> int:
        """Return the number of sent bytes that the program has not read."""
        count = array.array("i", [0])
        fcntl.ioctl(_fileno(self._process.stdin), termios.FIONREAD, count)
        return count[0]

    @property
    def has_begun_to_read(self) -> bool:
        """Whether the program has read any part of the last message, provided that it has read all earlier messages."""
        return self.unread() < self._sent if self._has_begun_to_read is None else self._has_begun_to_read

    def send(self, data: bytes, deadline: float) -> None:
        """Write `data` to the program's input by `deadline` (monotonic clock). Raises ProgramFault if that fails."""
        left = memoryview(data)
        fd = _fileno(self._process.stdin)
        self._sent = 0
        while left:
            patience = deadline - time.monotonic()
            if patience <= 0 or not select.select([], [fd], [], patience)[1]:
                raise self.fault(f"does not read its input {self._duration}")
            try:
                count = os.write(fd, left[:_CHUNK])
            except BlockingIOError:
                continue
            except BrokenPipeError:
                raise self.ended("does not read its input") from None
            self._sent += count
            left = left[count:]

    def read_line(self, deadline: float) -> tuple[bytes, ReplyCut | None]:
        """Return (line, cut): the next line of output, cut to MAX_LINE_BYTES, and the size and hash of the whole line.

        `cut` is None if the line was not cut.
        """
        kept, size, digest = bytearray(), 0, hashlib.sha256()
        while True:
            line, end, rest = self._pending.partition(b"\n")
            size += len(line)
            digest.update(line)
            kept += line[: MAX_LINE_BYTES - len(kept)]
            self._pending = rest
            if end:
                break
            patience = deadline - time.monotonic()
            is_late = patience <= 0 or not select.select([_fileno(self._process.stdout)], [], [], patience)[0]
            if is_late or not self._read_chunk():
                self._pending = kept
                raise self.fault(f"does not answer {self._duration}") if is_late else self.ended()
        is_cut = size > len(kept)
        cut = ReplyCut(text_bytes=size, answer_bytes=size, sha256=digest.hexdigest()) if is_cut else None
        return bytes(kept), cut

    def refuse_stray_output(self) -> None:
        """Raise ProgramFault when the program has ended, or has written without a request."""
        ready, _, _ = select.select([_fileno(self._process.stdout)], [], [], 0)
        if ready and not self._read_chunk():
            raise self.ended()
        if self._pending:
            shown = bytes(self._pending[:200]).decode(errors="backslashreplace")
            raise self.fault(
                f"wrote {shown!r} when no observation was waiting for an answer (standard output is for answers only)"
            )

    def ended(self, if_running: str = "ended without an answer") -> ProgramFault:
        """Return the fault of a program that has closed a pipe: its exit code, or `if_running` if it still runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=EXIT_TIMEOUT_S)
        return self.fault(if_running if self.is_running else "ended without an answer")

    def fault(self, what: str) -> ProgramFault:
        """End the program, and return a ProgramFault whose message contains `what`."""
        self._has_begun_to_read = self.has_begun_to_read
        code = self._process.poll()
        partial_output = bytes(self._pending[:MAX_LINE_BYTES])
        self.close(timeout_s=0.0)
        return ProgramFault(
            what if code is None else f"{what} (exit code {code})", partial_output, self._last_stderr_line
        )

    def _copy_stderr(self, fd: int, redact: Redact) -> None:
        """Copy the program's standard error to this process's standard error, line by line and without secrets."""
        pending = b""
        while chunk := _read(fd):
            *lines, pending = (pending + chunk).split(b"\n")
            if len(pending) > MAX_LINE_BYTES:
                lines, pending = [*lines, pending], b""
            self._log_stderr(b"".join(line + b"\n" for line in lines), redact)
        self._log_stderr(pending, redact)

    def _log_stderr(self, data: bytes, redact: Redact) -> None:
        if data:
            text = redact(data.decode(errors="backslashreplace"))
            self._last_stderr_line = next(
                (line.strip() for line in reversed(text.splitlines()) if line.strip()), self._last_stderr_line
            )
            _write_log(text)

    def close(self, timeout_s: float = EXIT_TIMEOUT_S) -> None:
        """Close the program's input, wait up to `timeout_s` for its end, and kill it with all processes it started."""
        process = self._process
        with contextlib.suppress(OSError):
            process.stdin.close() if process.stdin else None
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=timeout_s)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        self._stderr.join(EXIT_TIMEOUT_S)
        if process.stdout:
            process.stdout.close()
        if process.stderr and not self._stderr.is_alive():
            process.stderr.close()

    def _read_chunk(self) -> bytes:
        chunk = os.read(_fileno(self._process.stdout), _CHUNK)
        self._pending += chunk
        return chunk


class WorkingFolder:
    """Working folder of a program, made when first needed and removed by `close`."""

    def __init__(self) -> None:
        self._folder: Path | None = None

    @property
    def folder(self) -> Path:
        """Path of the folder, which is made if it does not exist. Raises SettingError when it cannot be made."""
        if self._folder is None or not self._folder.is_dir():
            try:
                self._folder = Path(tempfile.mkdtemp(prefix="agent-"))
            except OSError as error:
                raise SettingError(
                    f"A temporary folder for the agent's program cannot be made: {error}. Set TMPDIR to another folder."
                ) from None
        return self._folder

    def close(self) -> None:
        """Remove the folder and its contents."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None


def resolve_paths(arguments: Sequence[str], here: Path) -> list[str]:
    """Return a command's words; paths of files and folders in `here` are made absolute, also after `--option=`."""
    program, *words = arguments
    return [str(here / program) if "/" in program else program, *(_resolve_word(word, here) for word in words)]


def program_files(arguments: Sequence[str], here: Path) -> list[Path]:
    """Return the files that define a program: the program itself if the command gives its path, and the files with code
    or settings that the command names.

    Other files, such as notes, images or databases, may change while the program runs.
    """
    program, *words = resolve_paths(arguments, here)
    given = [Path(word.partition("=")[2] if word.startswith("-") else word) for word in words]
    named = [Path(program)] if "/" in program else []
    files = [*named, *(file for file in given if file.suffix in CODE_SUFFIXES)]
    return [file for file in files if os.path.isfile(file)]  # False for a text that cannot be the name of a file


def program_environment(variables: Mapping[str, str], here: Path, folder: Path) -> dict[str, str]:
    """Return the environment variables for a program in `folder`.

    These are the user's variables, without those of VIGIL and those that name other folders of the user. Python still
    finds packages that the user has installed in the home folder.
    """
    kept = {
        name: value
        for name, value in variables.items()
        if not name.startswith(_OWN_PREFIXES) and name not in _OTHER_FOLDER_VARIABLES
    }
    for name in _SEARCH_PATH_VARIABLES:
        if name in kept:
            kept[name] = os.pathsep.join(str(here / part) for part in kept[name].split(os.pathsep) if part)
    return {"PYTHONUSERBASE": site.getuserbase(), **kept, **dict.fromkeys(_FOLDER_VARIABLES, str(folder))}


def _resolve_word(word: str, here: Path) -> str:
    option, sign, value = word.partition("=") if word.startswith("-") else ("", "", word)
    exists = bool(value) and not value.startswith("-") and os.path.exists(here / value)
    return f"{option}{sign}{here / value}" if exists else word


def _read(fd: int) -> bytes:
    try:
        return os.read(fd, _CHUNK)
    except OSError:
        return b""


def _write_log(text: str) -> None:
    with contextlib.suppress(OSError, ValueError):  # the episode continues without a log or on a full disk
        sys.stderr.write(text)
        sys.stderr.flush()


def _fileno(pipe: Any) -> int:
    return pipe.fileno()


class FramePacer:
    """Releases each frame a whole number of periods after the reply, however long the action took, so that the time
    until the next frame does not reveal what the reply did."""

    def __init__(
        self,
        seconds: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        """`seconds` is the period; with 0, frames are released at once."""
        self._seconds = seconds
        self._clock = clock
        self._sleep = sleep
        self._began = clock()

    def begin(self) -> None:
        """Count periods from now. Call this when the program has replied or an episode has begun."""
        self._began = self._clock()

    @property
    def left(self) -> float:
        """Time (s) until a whole number of periods, at least one, has passed since `begin`."""
        return max(0.0, self._end() - self._clock())

    def wait(self) -> None:
        """Wait until a whole number of periods, at least one, has passed since `begin`."""
        end = self._end()
        while (left := end - self._clock()) > 0:
            self._sleep(left)

    def _end(self) -> float:
        if not self._seconds:
            return self._began
        return self._began + max(1, math.ceil((self._clock() - self._began) / self._seconds)) * self._seconds
