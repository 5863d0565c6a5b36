"""Privileged agents for tests of the simulator workers: they crash, hang or raise inside the worker.

Their names are `fault:FOLDER`. Each leaves a marker in the folder and fails only the first time, or every time if its
fault ends in an exclamation mark.
"""

import os
import time
from dataclasses import dataclass
from pathlib import Path

from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.observation import Observation
from vigil.sim.protocol import Simulator

REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'


@dataclass
class FaultyAgent:
    name: str
    episode: Episode

    def start(self, instruction: str) -> None:
        """Do nothing: the agent has no state."""

    def act(self, observation: Observation) -> Reply:
        fault, _, folder = self.name.partition(":")
        mark = Path(folder) / f"{self.episode.id}.{fault.rstrip('!')}"
        if fault.endswith("!") or not mark.exists():
            mark.write_text(str(os.getpid()))
            self._fail(fault.rstrip("!"))
        return Reply(text=REPORT)

    def _fail(self, fault: str) -> None:
        if not self.episode.id.endswith("0"):
            return
        if fault == "exit":
            os._exit(9)
        if fault == "hang":
            time.sleep(60)
        if fault == "raise":
            raise ZeroDivisionError("a fault of the program's")


def make(name: str, episode: Episode, simulator: Simulator) -> FaultyAgent:
    return FaultyAgent(name, episode)
