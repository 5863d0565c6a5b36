"""A model server that often fails: a run against it must end with the records of a run against a faultless one.

    python -m sweeps.flaky_server                    every mode of `sweeps.support.flaky_modes`, 30 % of the answers
    python -m sweeps.flaky_server --share 0.3 --modes status_429,html_200 --rounds 5

The model is a deterministic function of the conversation, so that any difference between the records, other than
times and tokens, is a fault of the client's. Each round plays a tiny pack with another seed of failures; exit code 1
when an episode ended as an error, a record differed, or a mode was not met.
"""

import argparse
import hashlib
import json
import socket
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sweeps.support.flaky_modes import FLAWLESS, MODES, BadAnswer, response
from tests.support.tiny_pack import tiny_pack
from vigil.records.record import EpisodeRecord
from vigil.runner.run import RunResult, run_pack
from vigil.runner.settings import RunSettings

MAX_FAILURES_IN_A_ROW = 4
"""Number of failures after which a request is answered correctly; the client gives up after eight."""
REPLY_SECONDS = 2
TURNS = 6


@dataclass(frozen=True)
class FailurePlan:
    """The choice of answers that fail and of their modes: drawn from a seed, each mode equally often."""

    share: float
    modes: Sequence[str]
    seed: int = 0

    def fails(self, asked: str, attempt: int) -> bool:
        """Whether attempt number `attempt` (from 0) to answer a request fails."""
        return attempt < MAX_FAILURES_IN_A_ROW and _number(f"{self.seed} {asked} {attempt}") < self.share


@dataclass
class FlakyServer:
    """A server of chat completions on loopback that fails by chance."""

    plan: FailurePlan
    mode_counts: Counter[str] = field(default_factory=Counter)
    """Number of uses of each mode."""
    answers: int = 0
    last_mode: dict[str, list[str]] = field(default_factory=dict)
    """Modes that were used on each conversation."""

    def __post_init__(self) -> None:
        self._lock = threading.Lock()
        self._attempts: Counter[str] = Counter()
        self._is_over = False
        self._listener = self._listen(0)
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    @property
    def url(self) -> str:
        """The base URL for a client."""
        return f"http://127.0.0.1:{self.port}/v1"

    def close(self) -> None:
        """Stop listening."""
        with self._lock:
            self._is_over = True
            self._shut()

    def _listen(self, port: int) -> socket.socket:
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(("127.0.0.1", port))
        listener.listen(64)
        return listener

    def _shut(self) -> None:
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _vanish(self, seconds: float) -> None:
        with self._lock:
            if self._is_over:
                return
            self._shut()
            time.sleep(seconds)
            self._listener = self._listen(self.port)

    def _accept(self) -> None:
        while not self._is_over:
            with self._lock:
                listener = self._listener
            try:
                connection, _ = listener.accept()
            except OSError:
                continue  # it has vanished for a moment, or for good
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with connection, suppress(OSError), connection.makefile("rb") as stream:
            while (body := _read_request(stream)) is not None and self._answer(connection, body):
                pass

    def _answer(self, connection: socket.socket, body: dict[str, Any]) -> bool:
        """Answer one request, correctly or not; return whether the connection stays open."""
        asked = conversation(body["messages"])
        with self._lock:
            attempt = self._attempts[asked]
            self._attempts[asked] += 1
            self.answers += 1
            mode = self._draw() if self.plan.fails(asked, attempt) else None
            if mode is not None:
                self.mode_counts[mode] += 1
                self.last_mode.setdefault(_turn_key(body["messages"]), []).append(mode)
                if mode in FLAWLESS:
                    self._attempts[asked] = 0
        answer = completion(body["messages"])
        if mode is None:
            connection.sendall(response(json.dumps(answer).encode()))
            return True
        return MODES[mode](BadAnswer(connection, answer, REPLY_SECONDS, self._vanish))

    def _draw(self) -> str:
        """Return the next mode: all modes in a random order, then all again in another."""
        used = sum(self.mode_counts.values())
        turn, place = divmod(used, len(self.plan.modes))
        order = sorted(self.plan.modes, key=lambda name: _number(f"{self.plan.seed} {turn} {name}"))
        return order[place]


def _read_request(stream: Any) -> dict[str, Any] | None:
    """Return the body of the next request; None when the client has closed."""
    if not stream.readline():
        return None
    length = 0
    while (line := stream.readline().strip()) != b"":
        name, _, value = line.partition(b":")
        if name.lower() == b"content-length":
            length = int(value)
    body = stream.read(length)
    return json.loads(body) if len(body) == length > 0 else None


def completion(messages: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the model's answer: a function of the conversation alone; after a few turns at most it is a report."""
    number = _number(conversation(messages))
    turn = (len(messages) - 2) // 2 + 1
    texts = (
        skill_reply("look", direction="down", magnitude=1 + int(1000 * number) % 20),
        skill_reply("navigate", mode="turn_left", magnitude=5 + int(1000 * number) % 85),
        skill_reply("navigate", mode="forward", magnitude=5 + int(1000 * number) % 60),
        "prose",
    )
    status = ("success", "fail", "open", "closed")[int(number * 4)]
    report = skill_reply("report", status=status, summary=f"{number:.6f}")
    text = report if turn >= TURNS or number < 0.05 else texts[int(number * 997) % 4 % (4 if turn < 3 else 3)]
    return {
        "id": "chatcmpl-1",
        "object": "chat.completion",
        "created": 1,
        "model": "loopback",
        "choices": [{"index": 0, "message": {"role": "assistant", "content": text}, "finish_reason": "stop"}],
        "usage": {"prompt_tokens": 100, "completion_tokens": 10, "total_tokens": 110},
    }


def skill_reply(name: str, **arguments: Any) -> str:
    """Return a valid reply."""
    return json.dumps({"skill_name": name, "arguments": arguments})


def conversation(messages: Sequence[dict[str, Any]]) -> str:
    """Return the hash of all messages and pictures of the conversation."""
    return hashlib.sha256(json.dumps(messages, sort_keys=True).encode()).hexdigest()


def _turn_key(messages: Sequence[dict[str, Any]]) -> str:
    """Return the episode, identified by its prompt, and the turn of a request."""
    content = messages[0]["content"]
    prompt = content if isinstance(content, str) else content[0]["text"]
    return f"{hashlib.sha256(prompt.encode()).hexdigest()[:12]} {(len(messages) - 2) // 2 + 1}"


def _number(text: str) -> float:
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:6], "big") / 2**48


@contextmanager
def flaky(plan: FailurePlan) -> Iterator[FlakyServer]:
    """Yield a server that runs for the length of the block."""
    server = FlakyServer(plan)
    try:
        yield server
    finally:
        server.close()


@dataclass(frozen=True)
class RoundResult:
    """Result of one run against a flaky server."""

    episodes: int
    answers: int
    mode_counts: Counter[str]
    faults: tuple[str, ...]


def play(pack: Path, folder: Path, server: FlakyServer) -> RunResult:
    """Return the run of a pack's episodes against a server, with short waits."""
    wanted = RunSettings(
        pack=pack, model="openai/loopback", base_url=server.url, log_dir=folder, backend="fake", workers=1,
        max_connections=8, first_wait_s=0.01, longest_wait_s=0.1, reply_seconds=REPLY_SECONDS, preflight=False,
    )  # fmt: skip
    return run_pack(wanted)


def compare(pack: Path, reference: RunResult, plan: FailurePlan, folder: Path) -> RoundResult:
    """Play against a flaky server and compare the records with those of the undisturbed run."""
    with flaky(plan) as server:
        rough = play(pack, folder, server)
    faults = [fault for pair in zip(reference.records, rough.records, strict=True) for fault in _faults(*pair, server)]
    met = sum(server.mode_counts.values())
    unmet = [] if met < len(plan.modes) else [mode for mode in plan.modes if not server.mode_counts[mode]]
    return RoundResult(
        len(rough.records), server.answers, server.mode_counts, (*faults, *(f"{mode}: not met" for mode in unmet))
    )


def _faults(reference: EpisodeRecord, rough: EpisodeRecord, server: FlakyServer) -> Iterator[str]:
    was, is_ = comparable_fields(reference), comparable_fields(rough)
    if was == is_:
        return
    turn = next((n for n, pair in enumerate(zip(was["steps"], is_["steps"], strict=False), 1) if pair[0] != pair[1]), 0)
    turn = turn or len(is_["steps"]) + 1
    modes = [modes[-1] for place, modes in server.last_mode.items() if place == f"{rough.prompt_sha256[:12]} {turn}"]
    if not modes:
        modes = sorted({modes[-1] for place, modes in server.last_mode.items() if place.endswith(f" {turn}")})
    what = rough.error.message if rough.error else f"step {turn} differs"
    yield f"{' or '.join(modes)}: {rough.episode_id}: {what}"


def comparable_fields(record: EpisodeRecord) -> dict[str, Any]:
    """Return a record without fields that may differ: run, times, and tokens, which an odd answer may not count."""
    fields = record.model_dump(mode="json")
    for name in ("run_id", "run_sha256", "started", "ended", "attempt"):
        fields.pop(name)
    for step in fields["steps"]:
        for name in ("seconds", "usage"):
            step["reply"].pop(name)
    return fields


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the sweep and return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m sweeps.flaky_server", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--share", type=float, default=0.3, help="of the answers that fail (default: 0.3)")
    parser.add_argument("--modes", default="all", help=f"all, or some of: {', '.join(MODES)}")
    parser.add_argument("--rounds", type=int, default=3, help="runs, each with another seed (default: 3)")
    parser.add_argument("--episodes", type=int, default=40, help="in each run (default: 40)")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    modes = tuple(MODES) if given.modes == "all" else tuple(given.modes.split(","))
    unknown = [mode for mode in modes if mode not in MODES]
    if unknown:
        parser.error(f"unknown modes: {', '.join(unknown)}")
    met: Counter[str] = Counter()
    faults: list[str] = []
    episodes = answers = 0
    with tempfile.TemporaryDirectory() as place:
        pack = tiny_pack(Path(place) / "tiny", given.episodes)
        with flaky(FailurePlan(0.0, modes)) as server:
            reference = play(pack.folder, Path(place) / "calm", server)
        for number in range(given.rounds):
            plan = FailurePlan(given.share, modes, given.seed + number)
            done = compare(pack.folder, reference, plan, Path(place) / f"rough-{number}")
            met += done.mode_counts
            faults += done.faults
            episodes, answers = episodes + done.episodes, answers + done.answers
            print(f"round {number}: {done.answers} answers, {sum(done.mode_counts.values())} failed", flush=True)
            for fault in done.faults:
                print(f"  {fault}")
    failed = sum(met.values())
    print(
        f"{episodes} episodes, {answers} answers, {failed} of them ({100 * failed / max(1, answers):.0f} %) faulty in "
        f"{len(met)} modes: {len(faults)} faults"
    )
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
