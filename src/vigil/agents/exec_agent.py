"""`exec:COMMAND`: a program of one's own as an agent, in any language, speaking JSON lines.

The program is started once for each simulator worker and plays one episode after another. It reads from its standard
input one JSON object a line:

    {"type": "start", "protocol": 1, "prompt": "...", "instruction": "..."}
        A new episode begins; forget the one before. `prompt` is the full system prompt that a model would get,
        `instruction` the task alone. Nothing is to be answered.
    {"type": "observation", "frame": {"media_type": "image/png", "width": 640, "height": 480, "data": "<base64>"}}
        The current frame; in the action-feedback profile also "feedback": {"too_far": bool, "path_blocked": bool}
        (not on the first step). Answer with exactly one line on standard output.

An answer is one line: the reply itself, e.g. {"skill_name": "look", "arguments": {"direction": "up", "magnitude": 15}},
or, for a reply that may hold line breaks or prose, {"text": "<the raw reply>"}. Flush after each line. Standard output
is for answers only: write logs to standard error. A line that is no valid reply counts against the agent, as a model's
would; a program that ends, hangs, or writes a line that nobody asked for is a failure of the infrastructure, and its
episode ends as an `error`, to be played again. When its input ends, the program should end.
"""

import codecs
import contextlib
import hashlib
import json
import os
import select
import shlex
import signal
import subprocess
import time
from typing import Any

from vigil.actions import Reply, ReplyCut
from vigil.agents.agent import REPLY_SECONDS
from vigil.agents.picture import encode
from vigil.errors import ModelAPIError, SettingError
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.profile import Profile
from vigil.prompt import system_prompt
from vigil.reasoning import split_reasoning

PREFIX = "exec:"
PROTOCOL = 1
CLOSING_SECONDS = 2.0
MAX_LINE_BYTES = 1024 * 1024
"""A longer line is no answer, whatever it says: it counts as too long, and this much of it is looked at."""
_CHUNK = 1 << 16


class ExecAgent:
    """A running program that answers observations."""

    def __init__(self, command: str, profile: Profile, reply_seconds: float = REPLY_SECONDS) -> None:
        """`command` is split as a shell would, but no shell is used. Raises SettingError when it is not one."""
        self.name = f"{PREFIX}{command}"
        self._arguments = _split(command)
        self._profile = profile
        self._reply_seconds = reply_seconds
        self._program: subprocess.Popen[bytes] | None = None
        self._pending = bytearray()

    def start(self, instruction: str) -> None:
        """Starts the program unless it runs, and tells it that an episode begins."""
        if self._program is None or self._program.poll() is not None:
            self.close()
            self._program = self._launch()
        prompt = system_prompt(instruction, self._profile)
        self._send({"type": "start", "protocol": PROTOCOL, "prompt": prompt, "instruction": instruction})

    def act(self, observation: Observation) -> Reply:
        """Returns the program's answer. Raises ModelAPIError when it ends, hangs or talks out of turn."""
        started = time.monotonic()
        picture = encode(observation.rgb, self._profile.image_format)
        frame = {"media_type": picture.media_type, "width": FRAME_WIDTH, "height": FRAME_HEIGHT, "data": picture.base64}
        message: dict[str, Any] = {"type": "observation", "frame": frame}
        if observation.feedback is not None:
            message["feedback"] = observation.feedback.model_dump()
        self._refuse_stray_output()
        self._send(message)
        line, cut = self._read_line(started + self._reply_seconds)
        fields = {
            "text": _whole_characters(line) if cut else _raw_reply(line),
            "cut": cut,
            "seconds": time.monotonic() - started,
        }
        reply = Reply.model_validate(fields)
        return reply.model_copy(update={"reasoning_chars": split_reasoning(reply.text)[1]})

    def close(self) -> None:
        """Closes the program's input, and kills it with all that it started when it does not end by itself."""
        self._end(patience_s=CLOSING_SECONDS)

    def _end(self, patience_s: float) -> None:
        program, self._program = self._program, None
        self._pending.clear()
        if program is None:
            return
        with contextlib.suppress(OSError):
            program.stdin.close() if program.stdin else None
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(timeout=patience_s)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGKILL)
        program.wait()
        if program.stdout:
            program.stdout.close()

    def _launch(self) -> subprocess.Popen[bytes]:
        try:
            program = subprocess.Popen(
                self._arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, start_new_session=True
            )
        except OSError as error:
            raise SettingError(
                f"Agent program {self._arguments[0]!r} cannot be started: {error.strerror}. Give its path "
                "(./agent.sh), or the program that runs it (exec:bash agent.sh)."
            ) from None
        for pipe in (program.stdin, program.stdout):
            os.set_blocking(_fileno(pipe), False)
        return program

    def _send(self, message: dict[str, Any]) -> None:
        data = memoryview(json.dumps(message).encode() + b"\n")
        deadline = time.monotonic() + self._reply_seconds
        fd = _fileno(self._running().stdin)
        while data:
            self._wait([], [fd], deadline, "does not read its input")
            try:
                data = data[os.write(fd, data[:_CHUNK]) :]
            except BlockingIOError:
                continue
            except BrokenPipeError:
                raise self._ended() from None

    def _read_line(self, deadline: float) -> tuple[bytes, ReplyCut | None]:
        """Returns the next line of output, cut to MAX_LINE_BYTES, and what it was if it was longer."""
        size, digest = 0, hashlib.sha256()
        kept = bytearray()
        while True:
            line, end, rest = self._pending.partition(b"\n")
            size += len(line)
            digest.update(line)
            kept += line[: MAX_LINE_BYTES - len(kept)]
            self._pending = rest
            if end:
                break
            self._wait([_fileno(self._running().stdout)], [], deadline, "does not answer")
            if not self._read_chunk():
                raise self._ended()
        cut = ReplyCut(text_bytes=size, answer_bytes=size, sha256=digest.hexdigest()) if size > len(kept) else None
        return bytes(kept), cut

    def _read_chunk(self) -> bytes:
        chunk = os.read(_fileno(self._running().stdout), _CHUNK)
        self._pending += chunk
        return chunk

    def _refuse_stray_output(self) -> None:
        ready, _, _ = select.select([_fileno(self._running().stdout)], [], [], 0)
        if ready and not self._read_chunk():
            raise self._ended()
        if self._pending:
            shown = bytes(self._pending[:200]).decode(errors="backslashreplace")
            raise self._failed(f"wrote {shown!r} when nothing was asked (standard output is for answers only)")

    def _wait(self, readers: list[int], writers: list[int], deadline: float, fault: str) -> None:
        left = deadline - time.monotonic()
        if left <= 0 or not any(select.select(readers, writers, [], left)):
            raise self._failed(f"{fault} for {self._reply_seconds:g} s")

    def _running(self) -> subprocess.Popen[bytes]:
        if self._program is None:
            raise ModelAPIError(f"Agent program {self.name!r} is not running: `start` comes before `act`.")
        return self._program

    def _ended(self) -> ModelAPIError:
        """Returns the failure of a program that has closed its pipe; its exit code follows in a moment."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._running().wait(timeout=CLOSING_SECONDS)
        return self._failed("ended without an answer")

    def _failed(self, what: str) -> ModelAPIError:
        program = self._running()
        code = program.poll()
        self._end(patience_s=0.0)
        exit_code = "" if code is None else f" (exit code {code})"
        return ModelAPIError(f"Agent program {self.name!r} {what}{exit_code}.")


def _split(command: str) -> list[str]:
    try:
        arguments = shlex.split(command)
    except ValueError as error:
        raise SettingError(f"Agent command {command!r} cannot be split into words: {error}.") from None
    if not arguments:
        raise SettingError(f"Agent {PREFIX!r} names no command. Write e.g. `exec:python my_agent.py`.")
    return arguments


def _fileno(pipe: Any) -> int:
    return pipe.fileno()


def _whole_characters(line: bytes) -> str | bytes:
    """Returns a line that was cut without the piece of a character at its end; as it is when it is no UTF-8."""
    try:
        return codecs.getincrementaldecoder("utf-8")().decode(line)
    except UnicodeDecodeError:
        return line


def _raw_reply(line: bytes) -> str | bytes:
    """Returns the reply in a line: the `text` of a wrapped one, else the line itself."""
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):
        return line
    if isinstance(value, dict) and "skill_name" not in value and isinstance(value.get("text"), str):
        return value["text"]
    return line
