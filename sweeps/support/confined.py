"""Confined calls: a function in a forked process with bounded memory and time, and its result."""

import json
import math
import os
import resource
import select
import signal
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from vigil.errors import VigilError

MEMORY_BYTES = 3 * 2**30
"""More than the process had when it began."""
CPU_SECONDS = 60
WALL_SECONDS = 300.0
MAX_ANSWER_BYTES = 1 << 20

OutcomeKind = Literal["done", "refused", "exception", "memory", "hang", "died"]


@dataclass(frozen=True, slots=True)
class CallOutcome:
    """The end of a confined call: `done` with its answer, `refused` with a VigilError's message, or a failure."""

    kind: OutcomeKind
    text: str


def run_confined(call: Callable[[], str], wall_s: float = WALL_SECONDS) -> CallOutcome:
    """Return the result of a call in a separate process, which ends with all processes that it started."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        _run_child(call, writer, wall_s)
    os.close(writer)
    try:
        answer = _read(reader, wall_s)
    finally:
        os.close(reader)
        _kill_group(child)
        status = os.waitpid(child, 0)[1]
    if answer is None:
        return CallOutcome("hang", f"no answer within {wall_s:g} s")
    if not answer:
        return CallOutcome(
            "died", f"ended by signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else f"status {status}"
        )
    kind, text = json.loads(answer)
    return CallOutcome(kind, text)


def _run_child(call: Callable[[], str], writer: int, wall_s: float) -> None:
    """Do the call and never return; the process ends itself later if its parent is gone."""
    try:
        os.setsid()
        signal.alarm(2 * math.ceil(wall_s))
        with open("/proc/self/statm") as statm:
            had = int(statm.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (had + MEMORY_BYTES, had + MEMORY_BYTES))
        signal.signal(signal.SIGXCPU, _too_long)
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 10))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
        os.write(writer, json.dumps(_outcome(call))[:MAX_ANSWER_BYTES].encode())
    finally:
        os._exit(0)


def _too_long(*_: object) -> None:
    raise TimeoutError(f"more than {CPU_SECONDS} s of processor time")


def _outcome(call: Callable[[], str]) -> tuple[OutcomeKind, str]:
    try:
        return "done", call()
    except VigilError as error:
        return "refused", f"{type(error).__name__}: {error}"[:20_000]
    except MemoryError:
        return "memory", _last_lines()
    except TimeoutError:
        return "hang", _last_lines()
    except SystemExit as end:
        return "exception", f"SystemExit {end.code}"
    except BaseException:  # noqa: BLE001 - whatever comes is what is looked for
        return "exception", _last_lines()


def _last_lines() -> str:
    sys.setrecursionlimit(10_000)
    return traceback.format_exc(limit=-6)[-3000:]


def _read(reader: int, wall_s: float) -> bytes | None:
    """Return everything that the child writes until it ends; None when that takes too long."""
    answer = b""
    while select.select([reader], [], [], wall_s)[0]:
        part = os.read(reader, 1 << 16)
        if not part:
            return answer
        answer += part
        if answer.endswith(b"]"):
            return answer
    return None


def _kill_group(child: int) -> None:
    for kill in (os.killpg, os.kill):
        try:
            kill(child, signal.SIGKILL)
        except ProcessLookupError:  # it has ended, or has not made its group yet
            continue
