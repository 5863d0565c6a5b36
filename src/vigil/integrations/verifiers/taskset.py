"""Episodes as tasks of verifiers: a row that names one, and what one that is over was worth."""

from collections.abc import Iterator
from dataclasses import asdict
from functools import cached_property
from typing import Any

import verifiers.v1 as vf

from vigil.episode import families_named
from vigil.integrations.rewards import reward_parts
from vigil.integrations.verifiers.config import VigilTaskConfig, VigilTasksetConfig
from vigil.pack import Pack, Selection
from vigil.scoring import Outcome

OUTCOME = "outcome"
"""Under this name a trace holds the verdict on its episode."""
LABELS = ("FR", "NR", "IL", "Other")


class VigilData(vf.TaskData):
    """A row: which episode of which pack. Its prompt is the instruction; the model is sent more (`VigilHarness`)."""

    pack_sha256: str = ""


class VigilTask(vf.Task[VigilData, vf.State, VigilTaskConfig]):
    """An episode. Its hidden goal is not in it: the environment finds the episode by its id."""

    @property
    def key(self) -> str:
        """The episode's id, the same wherever it stands in a selection."""
        return self.data.id or super().key

    @vf.reward
    async def reward(self, trace: vf.Trace) -> dict[str, float]:
        """Returns the summands of the reward; 0 for B alone when verifiers ended the episode before its end."""
        outcome = outcome_in(trace)
        return {"B": 0.0} if outcome is None else reward_parts(outcome, self.config)

    @vf.metric
    async def verdict(self, trace: vf.Trace) -> dict[str, float]:
        """Returns what the paper's tables count; nothing when verifiers ended the episode before its end."""
        outcome = outcome_in(trace)
        if outcome is None:
            return {}
        labels = {label: float(outcome.label == label) for label in LABELS}
        return {"W": float(outcome.W), **labels, "steps": float(outcome.steps), "invalid": float(outcome.invalid)}


class VigilTaskset(vf.Taskset[VigilTask, VigilTasksetConfig]):
    """Episodes of a pack."""

    def load(self) -> Iterator[VigilTask]:
        """Yields the selected episodes in the order of the pack. Raises PackMismatch or SettingError."""
        config = self.config
        for episode in self.pack.select(Selection(families_named(config.family), (), config.limit)):
            data = VigilData(id=episode.id, prompt=episode.instruction, pack_sha256=self.pack.sha256)
            yield VigilTask(data, config.task)

    @cached_property
    def pack(self) -> Pack:
        """The pack, loaded when it is first needed. Raises PackMismatch."""
        return Pack.load(self.config.pack)


def keep_outcome(trace: vf.Trace, outcome: Outcome) -> None:
    """Writes the verdict on an episode into its trace."""
    trace.info[OUTCOME] = asdict(outcome)


def outcome_in(trace: vf.Trace) -> Outcome | None:
    """Returns the verdict in a trace; None when the episode was not played to its end."""
    kept: dict[str, Any] | None = trace.info.get(OUTCOME)
    return None if kept is None else Outcome(**kept)
