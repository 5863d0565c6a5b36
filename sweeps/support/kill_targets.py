"""Targets of kills: a run, a session of `vigil play`, or the making of a pack; and what must hold of their results."""

import functools
import http.client
import json
import shutil
import socket
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from sweeps.flaky_server import FailurePlan, FlakyServer, comparable_fields, skill_reply
from sweeps.support.process_groups import start
from tests.support.tiny_pack import tiny_pack
from vigil.authoring.drafting.drafts import DraftsFile
from vigil.cli import main as vigil_main
from vigil.records.record import EPISODES_FILE
from vigil.records.record_file import read_records
from vigil.runner import inspect_task  # noqa: F401 - imported before the forks, which are quicker for it
from vigil.web.play import JOURNAL

EPISODES = 8
AGENT = """
import hashlib, json, sys
turn = 0
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "start":
        turn, task = 0, message["instruction"]
        continue
    turn += 1
    number = hashlib.sha256(f"{task} {turn}".encode()).digest()[0]
    look = {"skill_name": "look", "arguments": {"direction": "up", "magnitude": 1 + number % 20}}
    report = {"skill_name": "report", "arguments": {"status": "open", "summary": str(number)}}
    print(json.dumps(report if turn > 6 else look), flush=True)
"""


class KillTarget(ABC):
    """A folder that is worked on, over many starts, until its work is complete."""

    final_code = 0
    """Exit code of the command when all is done."""
    variant = ""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.typical_s = 1.0
        """Seconds that undisturbed work takes."""
        self.is_over = False
        """Return whether the work is done and the command only has to be ended."""
        self._final_data: dict[Path, bytes] = {}

    @abstractmethod
    def command(self) -> Sequence[str]:
        """Return the arguments of the command line."""

    def run_in_fork(self) -> None:
        """Do what the command line does, in a fork of this process."""
        sys.argv = ["vigil", *self.command()]
        vigil_main()

    @abstractmethod
    def logs(self) -> list[Path]:
        """Return the append-only files."""

    def is_finished(self) -> bool:
        """Return whether all commands are done, now that one has ended well."""
        return True

    def final_bytes(self, data: bytes) -> int:
        """Return the length of the part of a log that later starts may not change."""
        return data.rfind(b"\n") + 1

    def drive(self, deadline: float) -> None:  # noqa: B027 - most targets need nobody
        """Act as a person or a client does meanwhile, until a time of the monotonic clock."""

    def check_final_lines(self) -> list[str]:
        """Return faults: complete lines that were there after an earlier kill and are missing or changed."""
        faults = []
        for path in self.logs():
            data = path.read_bytes() if path.exists() else b""
            before = self._final_data.get(path, b"")
            if not data.startswith(before):
                faults.append(f"{path.name}: {len(before)} bytes were whole, and are no longer the file's beginning")
            self._final_data[path] = data[: self.final_bytes(data)]
        return faults

    @abstractmethod
    def check_finished(self) -> list[str]:
        """Return faults of the finished work."""

    def clear(self) -> None:
        """Remove the folder and its side files."""
        for path in self.folder.parent.glob(f"{self.folder.name}*"):
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def check_rows(folder: Path, undisturbed: Path) -> list[str]:
    """Return faults of a run's rows compared with an undisturbed run's; side files of partial rows must not hold a
    complete row."""
    rows, wanted = (read_records(path / EPISODES_FILE) for path in (folder, undisturbed))
    faults = [f"{len(rows)} rows instead of {len(wanted)}"] if len(rows) != len(wanted) else []
    is_, was = ({row.key: comparable_fields(row) for row in each} for each in (rows, wanted))
    faults += [f"{key}: the record differs" for key in was if is_.get(key) != was[key]]
    for side in folder.glob("*.partial-*"):
        if side.read_bytes().endswith(b"\n"):
            faults.append(f"{side.name} holds a whole row")
    return faults


class RunTarget(KillTarget):
    """`vigil run` with one of three agents."""

    def __init__(self, folder: Path, variant: str, options: Sequence[str], undisturbed: Path) -> None:
        super().__init__(folder)
        self.variant = variant
        self._options = options
        self._undisturbed = undisturbed

    def command(self) -> Sequence[str]:
        """Return the arguments of the command line."""
        return ["run", *self._options, "--log-dir", str(self.folder), "--backend", "fake", "--workers", "1"]

    def logs(self) -> list[Path]:
        """Return the append-only files."""
        return [self.folder / EPISODES_FILE]

    def check_finished(self) -> list[str]:
        """Return faults of the finished work."""
        return [*self.check_final_lines(), *check_rows(self.folder, self._undisturbed)]


class PlayTarget(KillTarget):
    """`vigil play`, with a person who answers by the instruction and the turn alone."""

    final_code = 143
    variant = "play"

    def __init__(self, folder: Path, pack: Path, undisturbed: Path | None) -> None:
        super().__init__(folder)
        self._pack = pack
        self._undisturbed = undisturbed
        self._acknowledged = (0, 0)
        self._port = 0
        self.faults: list[str] = []

    def command(self) -> Sequence[str]:
        """Return the arguments of the command line."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._port = free.getsockname()[1]
        options = ["--pack", str(self._pack), "--log-dir", str(self.folder), "--backend", "fake", "--no-open"]
        return ["play", "--player", "ada", *options, "--port", str(self._port)]

    @property
    def run_in_fork(self) -> Callable[[], None]:  # type: ignore[override]
        """Do what the command line does; the port is chosen before the fork."""
        arguments = self.command()

        def work() -> None:
            sys.argv = ["vigil", *arguments]
            vigil_main()

        return work

    def logs(self) -> list[Path]:
        """Return the append-only files."""
        return [self.folder / EPISODES_FILE, self.folder / JOURNAL]

    def drive(self, deadline: float) -> None:
        """Play on until the deadline, or until all is played."""
        while time.monotonic() < deadline and not self.is_over:
            try:
                self._play(deadline)
            except (OSError, http.client.HTTPException, ValueError):
                time.sleep(0.01)  # it does not listen yet

    def _play(self, deadline: float) -> None:
        state = self._ask("GET", "/state")
        while time.monotonic() < deadline:
            place = (state["done"], state.get("moment", 0))
            if place < self._acknowledged:
                self.faults.append(f"{place} is shown after {self._acknowledged} was acknowledged")
            self._acknowledged = place
            if state["is_on"]:
                moment = state["moment"]
                state = self._ask(
                    "POST", "/reply", {"moment": moment, "text": self._text(state["instruction"], moment)}
                )
            elif state["done"] == state["of"]:
                self.is_over = True
                return
            else:
                state = self._ask("POST", "/next", {})

    def _text(self, instruction: str, moment: int) -> str:
        number = sum(map(ord, instruction)) + 31 * moment
        if moment >= 5:
            return skill_reply("report", status="open", summary=str(number))
        return skill_reply("look", direction="up", magnitude=1 + number % 20)

    def _ask(self, method: str, path: str, body: Any = None) -> dict[str, Any]:
        connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=3)
        try:
            data = None if body is None else json.dumps(body).encode()
            connection.request(method, path, data, {"Content-Type": "application/json"})
            return json.loads(connection.getresponse().read())
        finally:
            connection.close()

    def check_final_lines(self) -> list[str]:
        """Return faults, including those that the simulated person has met."""
        met, self.faults = self.faults, []
        return [*met, *super().check_final_lines()]

    def check_finished(self) -> list[str]:
        """Return faults of the finished work."""
        return [*self.check_final_lines(), *(check_rows(self.folder, self._undisturbed) if self._undisturbed else [])]


class PackTarget(KillTarget):
    """`vigil pack propose` and then `build`, or `make`."""

    def __init__(self, folder: Path, variant: str, undisturbed: Path | None) -> None:
        super().__init__(folder)
        self.variant = variant
        self._undisturbed = undisturbed
        drafts = f"{folder.name}.drafts.jsonl"
        self._drafts = folder.with_name(drafts)

    def command(self) -> Sequence[str]:
        """Return the arguments of the command line that is next."""
        choice = ["--rooms", "bathroom", "--family", "DA", "--family", "SV"]
        if self.variant == "make":
            return ["pack", "make", "--name", "kills", "--seed", "5", "--per-family", "2", "--count", "3", "--out",
                    str(self.folder), *choice]  # fmt: skip
        if not self._is_proposed():
            return ["pack", "propose", "--out", str(self._drafts), "--seeds", "7:10", "--per-house", "2", *choice]
        return ["pack", "build", "--drafts", str(self._drafts), "--name", "kills", "--per-family", "2", "--out",
                str(self.folder), *choice[2:]]  # fmt: skip

    def is_finished(self) -> bool:
        """Return whether all commands are done, now that one has ended well."""
        return (self.folder / "manifest.json").exists()

    def _is_proposed(self) -> bool:
        return self._drafts.exists() and self._drafts.read_bytes().count(b'"line":"done"') >= 6

    def logs(self) -> list[Path]:
        """Return the append-only files."""
        return [self._drafts]

    def final_bytes(self, data: bytes) -> int:
        """Return the end of the last family that was finished in a house; whatever follows is proposed again."""
        end = data.rfind(b"\n") + 1
        lines = data[:end].splitlines(keepends=True)
        while len(lines) > 1 and b'"line":"done"' not in lines[-1]:
            end -= len(lines.pop())
        return end

    def check_finished(self) -> list[str]:
        """Return faults of the finished work."""
        faults = self.check_final_lines()
        if self._undisturbed is None:
            return faults
        is_, was = (_files(path) for path in (self.folder, self._undisturbed))
        faults += [
            f"{name}: missing, added or different" for name in was.keys() | is_.keys() if was.get(name) != is_.get(name)
        ]
        if _draft_lines(self._drafts) != _draft_lines(
            self._undisturbed.with_name(f"{self._undisturbed.name}.drafts.jsonl")
        ):
            faults.append("the drafts differ")
        strays = [path.name for path in self.folder.parent.glob(f".{self.folder.name}*")]
        return [*faults, *(f"{name} is left over" for name in strays)]


def _files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def _draft_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a drafts file without durations."""
    DraftsFile(path).read()
    lines = [json.loads(line) for line in path.read_bytes().splitlines()]
    return [{name: value for name, value in line.items() if name != "seconds"} for line in lines]


class TargetFactory(ABC):
    """Makes targets of one kind, each in a new folder, with the undisturbed work to compare them with."""

    def __init__(self, place: Path) -> None:
        self.place = place
        self.seconds: dict[str, float] = {}
        """Duration of undisturbed work, by variant."""

    def __enter__(self) -> "TargetFactory":
        return self

    def __exit__(self, *_: object) -> None:  # noqa: B027 - most kinds hold nothing
        """Free the resources of the kind."""

    @abstractmethod
    def make(self, case: int) -> KillTarget:
        """Return a target without any work done."""

    def undisturbed(self, target: KillTarget) -> Path:
        """Let a target be worked on without kills and return its folder."""
        began = time.monotonic()
        while True:
            begun = start(target.run_in_fork, "undisturbed", target.folder)
            target.drive(time.monotonic() + 600)
            if target.is_over:
                begun.signal(15)
            code = begun.wait(600)
            if code != target.final_code:
                raise RuntimeError(f"undisturbed, {target.variant} ends with {code}: {begun.output_tail()}")
            if target.is_finished():
                break
        self.seconds[target.variant] = time.monotonic() - began
        return target.folder

    def target(self, case: int) -> KillTarget:
        """Return a new target."""
        target = self.make(case)
        target.typical_s = self.seconds[target.variant]
        return target


class RunTargets(TargetFactory):
    """Runs of a tiny pack: scripted, a program, and a model on loopback, in turn."""

    def __init__(self, place: Path) -> None:
        super().__init__(place)
        self._pack = tiny_pack(place / "tiny", EPISODES).folder
        self._server = FlakyServer(FailurePlan(0.0, ()))
        agent = place / "agent.py"
        agent.write_text(AGENT)
        common = ["--pack", str(self._pack)]
        self._options = {
            "scripted": [*common, "--agent", "random"],
            "exec": [*common, "--agent", f"exec:{sys.executable} {agent}", "--frame-interval-seconds", "0"],
            "model": [*common, "--model", "openai/loopback", "--base-url", self._server.url, "--no-preflight"],
        }

    def __exit__(self, *_: object) -> None:
        """End the model's server."""
        self._server.close()

    def make(self, case: int) -> KillTarget:
        """Return a target without any work done."""
        variant = list(self._options)[case % len(self._options)]
        return RunTarget(self.place / f"run-{case}", variant, self._options[variant], self._undisturbed_folder(variant))

    @functools.cache  # noqa: B019 - one kind lives as long as the sweep
    def _undisturbed_folder(self, variant: str) -> Path:
        folder = self.place / f"calm-{variant}"
        return self.undisturbed(RunTarget(folder, variant, self._options[variant], folder))


class PlayTargets(TargetFactory):
    """Sessions over a tiny pack."""

    def __init__(self, place: Path) -> None:
        super().__init__(place)
        self._pack = tiny_pack(place / "tiny", EPISODES).folder
        self._undisturbed_folder = self.undisturbed(PlayTarget(place / "calm", self._pack, None))

    def make(self, case: int) -> KillTarget:
        """Return a target without any work done."""
        return PlayTarget(self.place / f"play-{case}", self._pack, self._undisturbed_folder)


class PackTargets(TargetFactory):
    """Packs of small bathrooms, made in one go or in two."""

    def make(self, case: int) -> KillTarget:
        """Return a target without any work done."""
        variant = ("propose", "make")[case % 2]
        return PackTarget(self.place / f"pack-{case}", variant, self._undisturbed_folder(variant))

    @functools.cache  # noqa: B019 - one kind lives as long as the sweep
    def _undisturbed_folder(self, variant: str) -> Path:
        return self.undisturbed(PackTarget(self.place / f"calm-{variant}", variant, None))


KINDS: dict[str, type[TargetFactory]] = {"run": RunTargets, "play": PlayTargets, "pack": PackTargets}
