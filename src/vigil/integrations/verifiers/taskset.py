"""Episodes as tasks of verifiers: each task has a row that names the episode, and a reward at the episode's end."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports] - an extra
from pydantic import Field, field_validator

from vigil.authoring.streaming.address import is_stream, seed_in
from vigil.errors import VigilError
from vigil.integrations.options import RowOptions
from vigil.integrations.rewards import CONFIDENCE, ListRates, Shaping, Verdict, reward_parts
from vigil.integrations.sources import row_source
from vigil.packs.pack import find_pack
from vigil.protocol.profile import ImageFormat, PromptVariant, SystemRole
from vigil.scoring.outcomes import Outcome

TASKSET_ID = "vigil-verifiers"
"""Id by which the library `verifiers` finds the environment, in the module `vigil_verifiers`."""
OUTCOME, LIST = "outcome", "list"
"""Keys under which a trace stores the verdict on the episode and the verdict on its chores."""
LABELS = ("FR", "NR", "IL", "Other")
"""Labels of outcomes that are reported as metrics."""
REVEAL_OPTION = "--env.taskset.reveal-private-pack true"
"""Option that allows the use of a private pack."""


class VigilTaskConfig(vf.TaskConfig, Shaping):
    """Options that shape the reward in addition to B."""


class VigilTasksetConfig(vf.TasksetConfig, RowOptions):
    """Options that select the episodes, and determine their observations and replies.

    In Python they are fields of the configuration; on the command line of `verifiers` they are `--env.taskset.*`.
    """

    task: VigilTaskConfig = VigilTaskConfig()
    stream_workers: int = Field(1, ge=0, description="number of background processes that make a stream's episodes")
    prompt_variant: PromptVariant = Field(
        "default", description="wording of the system prompt: `default` or `neutral_report`"
    )
    image_format: ImageFormat = Field("png", description="how frames are sent: `png` or `jpeg`")
    system_role: SystemRole = Field(
        "system", description="role of the system prompt: `system`, or `user` for models without that role"
    )
    workers: int | None = Field(None, ge=1, description="number of simulator processes; one for each CPU if unset")

    @field_validator("pack")
    @classmethod
    def _pack(cls, given: str | Path) -> str | Path:
        try:
            if is_stream(given):
                seed_in(str(given))
            else:
                find_pack(given)
        except VigilError as error:
            raise ValueError(str(error)) from None
        return given


class VigilEnvConfig(vf.EnvConfig):
    """Configuration of the environment and of its only agent, the model."""

    agent: vf.AgentConfig = vf.AgentConfig(runtime=vf.SubprocessConfig())
    """Configuration of the agent. Nothing runs in its sandbox; the simulators are processes of the environment."""


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
        self.source = row_source(config, config.stream_workers, REVEAL_OPTION, "What verifiers keeps of its rollouts")
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
