"""The verifiers environment: episodes in simulator workers, each played by one agent.

The agent's harness sends the messages of `vigil run` through a server that records them.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, cast

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports] - an extra
from openai import AsyncOpenAI
from pydantic import ValidationError

from vigil.agents.agent import REPLY_SECONDS
from vigil.errors import PackMismatch, SettingError, VigilError
from vigil.integrations.chat_client import chat_sender
from vigil.integrations.options import check_names, invalid_option
from vigil.integrations.rewards import Verdict, verdict_of
from vigil.integrations.sources import worker_plan
from vigil.integrations.verifiers.taskset import (
    TASKSET_ID,
    VigilData,
    VigilEnvConfig,
    VigilTaskConfig,
    VigilTaskset,
    VigilTasksetConfig,
    store_verdict,
)
from vigil.runner.models.ask import Ask, with_retries
from vigil.runner.retries import RetryPolicy
from vigil.runner.workers.messages import WorkerPlan
from vigil.runner.workers.players import ModelPlayer
from vigil.runner.workers.pool import SimulatorPool, worker_count

RUN_ID = "verifiers"
PlayTask = Callable[[VigilData, Ask], Awaitable[Verdict]]
"""Function that plays an episode with a model. Raises VigilError if the episode could not be finished."""
_REWARDS = VigilTaskConfig.model_fields.keys() - vf.TaskConfig.model_fields.keys()
_OPTIONS = VigilTasksetConfig.model_fields.keys() - vf.TasksetConfig.model_fields.keys() | _REWARDS


class VigilHarness(vf.Harness[vf.HarnessConfig]):
    """Harness that plays in this process. Each turn sends a request with the prompt, the text history and the frame."""

    EXECUTES_CODE = False
    NEEDS_CONTAINER = False
    play: PlayTask | None = None
    """Function that plays an episode; set by the environment, which owns the simulators."""

    async def launch(
        self,
        ctx: vf.ModelContext,
        trace: vf.Trace,
        runtime: vf.Runtime,
        endpoint: str,
        secret: str,
        mcp_urls: dict[str, str],
        data: vf.TaskData,
    ) -> vf.ProgramResult:
        """Play the episode that `data` names, and store the verdict in the trace.

        Raises HarnessError if the episode could not be finished.
        """
        if self.play is None:
            raise vf.HarnessError("VIGIL's episodes need VIGIL's environment: leave out --env.id.")
        if data.system_prompt is not None:
            raise vf.HarnessError(
                "VIGIL's system prompt is part of its protocol: leave out --env.taskset.system-prompt, and do not "
                "limit the agent's network."
            )
        async with AsyncOpenAI(base_url=endpoint, api_key=secret, max_retries=0, timeout=REPLY_SECONDS) as client:
            ask = with_retries(chat_sender(client, ctx.model), RetryPolicy())
            try:
                store_verdict(trace, await self.play(cast(VigilData, data), ask))
            except VigilError as error:
                raise vf.HarnessError(str(error)) from error
        return vf.ProgramResult(exit_code=0, stdout="", stderr="")


class VigilVerifiersEnv(vf.Env[VigilEnvConfig]):
    """Environment that plays any number of episodes at once.

    Its simulators run only inside `async with env.serving():`.
    """

    taskset: VigilTaskset
    _pool: SimulatorPool | None = None

    async def start(self) -> None:
        """Start the simulator workers. Raises PackMismatch."""
        plan = await asyncio.to_thread(self.worker_plan)
        self._pool = SimulatorPool(plan, worker_count(self.taskset.config.workers))

    async def stop(self) -> None:
        """End the simulator workers."""
        pool, self._pool = self._pool, None
        if pool is not None:
            await asyncio.to_thread(pool.close)
        self.taskset.source.close()

    async def setup(self, agents: vf.Agents) -> None:
        """Connect the agent's harness to the simulators. Raises SettingError if the harness is not a VigilHarness."""
        harness = agents.agent.harness
        if not isinstance(harness, VigilHarness):
            raise SettingError("VIGIL's episodes need VIGIL's harness: leave out --env.agent.harness.id.")
        harness.play = self._play

    async def run(self, task: vf.Task, agents: vf.Agents) -> None:
        """Play one episode."""
        await agents.agent.run(task)

    def worker_plan(self) -> WorkerPlan:
        """Return the settings of the simulator workers (a worker plan). Raises PackMismatch."""
        return worker_plan(self.taskset.source, self.taskset.config, RUN_ID)

    async def _play(self, data: VigilData, ask: Ask) -> Verdict:
        source, condition = self.taskset.source, self.taskset.config.condition
        if data.source != source.name:
            raise PackMismatch(
                f"Episode {data.id!r} is from {data.source!r}, but this machine plays {source.name!r}. Use the "
                "same pack on both machines, or for a stream the same version of VIGIL."
            )
        if self._pool is None:
            raise SettingError("The simulators are not running: play inside `async with env.serving():`.")
        assignment, answer = await source.assignment(str(data.id), data.house)
        record = await ModelPlayer(self._pool, condition, ask, RUN_ID).play(assignment)
        if record.error is not None:
            raise VigilError(f"{record.error.boundary}: {record.error.message}")
        return verdict_of(record, assignment.episode, condition, answer)


def load_environment(**options: Any) -> VigilVerifiersEnv:
    """Return the environment with these options; docs/verifiers.md lists them. Raises SettingError or PackMismatch."""
    check_names(options, sorted(_OPTIONS), "The environment")
    rewards = {name: options.pop(name) for name in _REWARDS & options.keys()}
    try:
        config = VigilEnvConfig.model_validate({"taskset": {"id": TASKSET_ID, "task": rewards, **options}})
    except ValidationError as error:
        raise invalid_option(error, "The environment") from None
    return VigilVerifiersEnv(config)
