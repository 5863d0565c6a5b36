"""Episodes as tasks of verifiers: a row that names one, and what one that is over was worth."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports]

from vigil.integrations.rewards import reward_parts
from vigil.integrations.verifiers.config import VigilTaskConfig, VigilTasksetConfig
from vigil.integrations.verifiers.sources import source_of
from vigil.scoring.outcomes import Outcome

OUTCOME = "outcome"
"""Under this name a trace holds the verdict on its episode."""
LABELS = ("FR", "NR", "IL", "Other")


class VigilData(vf.TaskData):
    """A row: which episode of which source. Its prompt is the instruction; the model is sent more (`VigilHarness`)."""

    source: str = ""
    house: int | None = None
    """Its place in a stream."""


class VigilTask(vf.Task[VigilData, vf.State, VigilTaskConfig]):
    """An episode. Its hidden goal is not in it: the environment finds the episode by its id."""

    @property
    def key(self) -> str:
        """The episode's id, the same wherever it stands in a selection."""
        return self.data.id or super().key

    @vf.reward
    async def reward(self, trace: vf.Trace) -> dict[str, float]:
        """Return the summands of the reward; 0 for B alone when verifiers ended the episode before its end."""
        outcome = stored_outcome(trace)
        return {"B": 0.0} if outcome is None else reward_parts(outcome, self.config)

    @vf.metric
    async def verdict(self, trace: vf.Trace) -> dict[str, float]:
        """Return what the paper's tables count; nothing when verifiers ended the episode before its end."""
        outcome = stored_outcome(trace)
        if outcome is None:
            return {}
        labels = {label: float(outcome.label == label) for label in LABELS}
        return {"W": float(outcome.W), **labels, "steps": float(outcome.steps), "invalid": float(outcome.invalid)}


class VigilTaskset(vf.Taskset[VigilTask, VigilTasksetConfig]):
    """Episodes of a pack or a stream."""

    def __init__(self, config: VigilTasksetConfig) -> None:
        super().__init__(config)
        self.source = source_of(config)
        self.INFINITE = self.source.is_endless

    def load(self) -> Iterator[VigilTask]:
        """Yield the selected episodes. Raises PackMismatch, SettingError or SimulatorError."""
        name = self.source.name
        for episode, house in self.source.rows():
            data = VigilData(id=episode.id, prompt=episode.instruction, source=name, house=house)
            yield VigilTask(data, self.config.task)


def store_outcome(trace: vf.Trace, outcome: Outcome) -> None:
    """Write the verdict on an episode into its trace."""
    trace.info[OUTCOME] = asdict(outcome)


def stored_outcome(trace: vf.Trace) -> Outcome | None:
    """Return the verdict in a trace; None when the episode was not played to its end."""
    kept: dict[str, Any] | None = trace.info.get(OUTCOME)
    return None if kept is None else Outcome(**kept)
