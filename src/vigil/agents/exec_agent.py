"""`exec:COMMAND`: a custom program as an agent, in any language, that exchanges JSON lines.

VIGIL starts the program in a new, empty folder: once for each episode or, if the run says so, once for all episodes of
a simulator worker. The program reads from its standard input one JSON object per line:

    {"type": "start", "protocol": 1, "prompt": "...", "instruction": "..."}
        An episode begins: forget any earlier episode. `prompt` is the system prompt that a model would get;
        `instruction` is only the task. Do not answer.
    {"type": "observation", "frame": {"media_type": "image/png", "width": 640, "height": 480, "data": "<base64>"}}
        The current frame. In the action-feedback profile, each observation after the first also has
        "feedback": {"too_far": bool, "path_blocked": bool}. Answer with exactly one line on standard output.

An answer is the reply itself, e.g. {"skill_name": "look", "arguments": {"direction": "up", "magnitude": 15}}. If the
reply may contain line breaks or prose, the answer is {"text": "<the raw reply>"}. Flush after each line. Standard
output is for answers only: write logs to standard error. A line that is not a valid reply counts against the agent,
like an invalid reply of a model. The next frame comes a whole number of periods after the reply, so that the waiting
time does not show whether an action was carried out.

A program fails if it ends, hangs or writes a line that was not requested. If it had already begun to read a frame of
the episode, the step counts as a protocol failure (`agent_ended`), and the program is started again with the next
frame. If it had not yet seen a frame, the failure is one of the infrastructure: the episode ends as an `error` and is
played again. When its input ends, the program should end. Source: `protocol.md` section 2.3.
"""

import codecs
import hashlib
import json
import os
import shlex
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vigil.agents.agent import FRAME_INTERVAL_SECONDS, REPLY_SECONDS
from vigil.agents.frame_encoding import encode_frame
from vigil.agents.program import FramePacer, Program, ProgramFault, Redact, WorkingFolder, program_files, resolve_paths
from vigil.agents.sandbox import sandboxed
from vigil.errors import ModelAPIError, SettingError
from vigil.protocol.actions import Reply, ReplyCut
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH, Observation
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import system_prompt
from vigil.protocol.reasoning import split_reasoning

EXEC_PREFIX = "exec:"
MAX_STDERR_CHARS = 300
"""Maximum length (characters) of the line of standard error that a message quotes."""
MAX_HASHED_BYTES = 64 * 1024 * 1024
"""Maximum size of a file that is hashed to identify the program; larger files are left out."""
PROTOCOL_VERSION = 1
"""Version of the format of the JSON lines."""


@dataclass(frozen=True, slots=True)
class ProgramSettings:
    """Settings of the program of an `exec:` agent: its time limits, what it must not see, and what is removed from its
    output."""

    reply_seconds: float = REPLY_SECONDS
    frame_interval_seconds: float = FRAME_INTERVAL_SECONDS
    """Interval (s) at which the program gets frames; with 0, a frame is sent as soon as it is ready."""
    hidden: tuple[Path, ...] | None = None
    """Folders that the program must not see, if it runs in a sandbox; None if it runs without one."""
    redact: Redact = lambda text: text
    """Function that removes secrets from the program's standard error and from messages."""


class ExecAgent:
    """An agent that is a separate program (`exec:COMMAND`). VIGIL starts the program, and exchanges lines of JSON with
    it."""

    def __init__(
        self,
        command: str,
        profile: Profile,
        settings: ProgramSettings = ProgramSettings(),
        pacer: FramePacer | None = None,
    ) -> None:
        """Split `command` into words as a shell does. Raises SettingError when it is empty or cannot be split.

        If `pacer` is None, frames are paced by the machine's clock.
        """
        self.name = f"{EXEC_PREFIX}{command}"
        self._arguments = _split(command)
        self._profile = profile
        self._reply_seconds = settings.reply_seconds
        self._redact = settings.redact
        self._hidden = settings.hidden
        self._pacer = pacer or FramePacer(settings.frame_interval_seconds)
        self._working_folder = WorkingFolder()
        self._program: Program | None = None
        self._start_message = b""
        self._has_seen_frame = False
        """Whether the program has begun to read a frame of the episode."""

    def start(self, instruction: str) -> None:
        """Start the program unless it is running, and send it the start message of the episode.

        Raises ModelAPIError when the program fails, and SettingError when it cannot be started.
        """
        self._prepare(instruction, has_seen_frame=False)
        if self._program is not None and not self._program.is_running:
            self._end()
        try:
            self._open(time.monotonic() + self._reply_seconds)
        except ProgramFault as fault:
            raise self._failure(fault) from None
        self._pacer.begin()

    def resume(self, instruction: str) -> None:
        """Continue an episode whose program had seen a frame when it was lost together with VIGIL's process."""
        self._end()
        self._prepare(instruction, has_seen_frame=True)
        self._pacer.begin()

    def act(self, observation: Observation) -> Reply:
        """Return the program's answer. If the program fails after it has seen a frame, return a reply that says how it
        failed.

        Raises ModelAPIError when the program fails before it has seen a frame.
        """
        picture = encode_frame(observation.rgb, self._profile.image_format)
        frame = {"media_type": picture.media_type, "width": FRAME_WIDTH, "height": FRAME_HEIGHT, "data": picture.base64}
        message: dict[str, Any] = {"type": "observation", "frame": frame}
        if observation.feedback is not None:
            message["feedback"] = observation.feedback.model_dump()
        if observation.cues is not None:
            message |= observation.cues.model_dump(exclude_none=True)
        line = _line(message)
        self._pacer.wait()
        started = time.monotonic()
        try:
            line, cut = self._answer(line, started + self._reply_seconds)
            text, how = _without_cut_character(line) if cut else _raw_reply(line), ""
        except ProgramFault as fault:
            self._program = None
            if not self._has_seen_frame:
                raise self._failure(fault) from None
            text, cut, how = fault.partial_output, None, str(fault)
        self._pacer.begin()
        seconds = time.monotonic() - started
        reply = Reply.model_validate({"text": text, "cut": cut, "seconds": seconds, "agent_ended": how})
        return reply.model_copy(update={"reasoning_chars": split_reasoning(reply.text)[1]})

    def close(self) -> None:
        """Close the program's input, wait a short time for its end, and kill it with all processes that it started."""
        self._end()
        self._working_folder.close()

    def _prepare(self, instruction: str, *, has_seen_frame: bool) -> None:
        prompt = system_prompt(instruction, self._profile)
        self._start_message = _line(
            {"type": "start", "protocol": PROTOCOL_VERSION, "prompt": prompt, "instruction": instruction}
        )
        self._has_seen_frame = has_seen_frame

    def _end(self) -> None:
        program, self._program = self._program, None
        if program is not None:
            program.close()

    def _open(self, deadline: float) -> Program:
        """Return the running program, after sending it the start message of the episode. Raises ProgramFault."""
        if self._program is None:
            self._program = self._launch()
        self._program.send(self._start_message, deadline)
        return self._program

    def _launch(self) -> Program:
        try:
            arguments, folder = resolve_paths(self._arguments, Path.cwd()), self._working_folder.folder
            return Program(
                arguments if self._hidden is None else sandboxed(arguments, folder, self._hidden),
                folder,
                self._reply_seconds,
                self._redact,
            )
        except OSError as error:
            what = f"cannot be started: {error.strerror}"
            if self._has_seen_frame:
                raise ProgramFault(what) from None
            raise SettingError(
                f"Agent program {self._redact(self._arguments[0])!r} {what}. Give its path (./agent.sh), or the "
                "program that runs it (exec:bash agent.sh)."
            ) from None

    def _answer(self, message: bytes, deadline: float) -> tuple[bytes, ReplyCut | None]:
        """Return the program's answer to a frame and, if the answer was cut, its full size and hash. Raises
        ProgramFault.

        The method also notes whether the program has begun to read a frame.
        """
        program = self._program or self._open(deadline)
        program.refuse_stray_output()
        if not self._has_seen_frame:
            program.wait_until_read(deadline)
        try:
            program.send(message, deadline)
            answer = program.read_line(deadline)
        except ProgramFault:
            self._has_seen_frame |= program.has_begun_to_read
            raise
        self._has_seen_frame = True
        return answer

    def _failure(self, fault: ProgramFault) -> ModelAPIError:
        self._program = None
        said = f" Its last line of standard error: {fault.stderr_line[:MAX_STDERR_CHARS]}" if fault.stderr_line else ""
        return ModelAPIError(self._redact(f"Agent program {self.name!r} {fault}.{said}"))


def file_hashes(agent: str, here: Path) -> dict[str, str]:
    """Return {file name: SHA-256} of the program of an `exec:` agent and of the code files in its command.

    Relative paths are relative to `here`. Files that cannot be read, or exceed MAX_HASHED_BYTES, are left out.
    """
    found: dict[str, str] = {}
    for file in sorted(program_files(_split(agent.removeprefix(EXEC_PREFIX)), here)):
        if file.stat().st_size <= MAX_HASHED_BYTES and os.access(file, os.R_OK):
            found[file.name] = hashlib.sha256(file.read_bytes()).hexdigest()
    return found


def _line(message: dict[str, Any]) -> bytes:
    return json.dumps(message).encode() + b"\n"


def _split(command: str) -> list[str]:
    try:
        arguments = shlex.split(command)
    except ValueError as error:
        raise SettingError(f"Agent command {command!r} cannot be split into words: {error}.") from None
    if not arguments:
        raise SettingError(f"Agent {EXEC_PREFIX!r} has no command. Write e.g. `exec:python my_agent.py`.")
    return arguments


def _without_cut_character(line: bytes) -> str | bytes:
    """Return a cut line without the incomplete character at its end; a line that is not UTF-8 is returned unchanged."""
    try:
        return codecs.getincrementaldecoder("utf-8")().decode(line)
    except UnicodeDecodeError:
        return line


def _raw_reply(line: bytes) -> str | bytes:
    """Return the reply in a line: the `text` of a wrapped reply, else the line itself."""
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):
        return line
    if isinstance(value, dict) and "skill_name" not in value and isinstance(value.get("text"), str):
        return value["text"]
    return line
