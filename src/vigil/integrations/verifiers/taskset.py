"""Episodes as tasks of verifiers: each task has a row that names the episode, and a reward at the episode's end."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports]

from vigil.integrations.rewards import CONFIDENCE, ListRates, Verdict, reward_parts
from vigil.integrations.sources import source_of
from vigil.integrations.verifiers.config import VigilTaskConfig, VigilTasksetConfig
from vigil.packs.private import check_revealed
from vigil.scoring.outcomes import Outcome

OUTCOME, LIST = "outcome", "list"
"""Keys under which a trace stores the verdict on the episode and the verdict on its chores."""
LABELS = ("FR", "NR", "IL", "Other")
"""Labels of outcomes that are reported as metrics."""
REVEAL_OPTION = "--env.taskset.reveal-private-pack true"
"""Option that allows the use of a private pack."""


class VigilData(vf.TaskData):
    """A row that names an episode of a source.

    Its prompt is only the instruction; `VigilHarness` sends the model the full prompt.
    """

    id: str | None = None
    """Id of the episode; declared here because TaskData before verifiers 0.4, which prime-rl uses, has no id."""
    source: str = ""
    house: int | None = None
    """Index of the episode's house in a stream; None for a pack."""


class VigilTask(vf.Task[VigilData, vf.State, VigilTaskConfig]):
    """Task of playing an episode.

    It does not contain the hidden goal; the environment finds the episode by the task's id.
    """

    @property
    def key(self) -> str:
        """Id of the episode, which does not depend on the episode's position in a selection."""
        return self.data.id or super().key

    @vf.reward
    async def reward(self, trace: vf.Trace) -> dict[str, float]:
        """Return the terms of the reward by name. If verifiers stopped the episode early, the only term is B = 0."""
        verdict = stored_verdict(trace)
        return {"B": 0.0} if verdict is None else reward_parts(verdict, self.config)

    @vf.metric
    async def verdict(self, trace: vf.Trace) -> dict[str, float]:
        """Return W, the label, steps and invalid replies as metrics; empty if verifiers stopped the episode early."""
        verdict = stored_verdict(trace)
        if verdict is None:
            return {}
        outcome = verdict.outcome
        labels = {label: float(outcome.label == label) for label in LABELS}
        of_list = verdict.of_list
        truth = {} if of_list is None or of_list.T is None else {"T": of_list.T}
        done = outcome.W if of_list is None else of_list.W
        return {"W": float(done), **truth, **labels, "steps": float(outcome.steps), "invalid": float(outcome.invalid)}


class VigilTaskset(vf.Taskset[VigilTask, VigilTasksetConfig]):
    """Taskset with the episodes of a pack or a stream."""

    def __init__(self, config: VigilTasksetConfig) -> None:
        super().__init__(config)
        self.source = source_of(config, config.stream_workers, config.limit)
        check_revealed(
            self.source.public_name,
            self.source.is_private,
            "What verifiers keeps of its rollouts",
            reveals=config.reveal_private_pack,
            by=REVEAL_OPTION,
        )
        self.INFINITE = self.source.is_endless

    def load(self) -> Iterator[VigilTask]:
        """Yield the selected episodes. Raises PackMismatch, SettingError or SimulatorError."""
        name = self.source.name
        for episode, house in self.source.rows():
            data = VigilData(id=episode.id, prompt=episode.instruction, source=name, house=house)
            yield VigilTask(data, self.config.task)


def store_verdict(trace: vf.Trace, verdict: Verdict) -> None:
    """Write the verdict on an episode into its trace."""
    trace.info |= {OUTCOME: asdict(verdict.outcome), CONFIDENCE: verdict.confidence}
    if verdict.of_list is not None:
        trace.info[LIST] = asdict(verdict.of_list)


def stored_verdict(trace: vf.Trace) -> Verdict | None:
    """Return the verdict in a trace; None if the episode was not finished."""
    kept: dict[str, Any] | None = trace.info.get(OUTCOME)
    if kept is None:
        return None
    of_list = trace.info.get(LIST)
    return Verdict(Outcome(**kept), None if of_list is None else ListRates(**of_list), trace.info[CONFIDENCE])
