"""The verifiers environment: episodes in simulator workers, each played by one agent."""

import asyncio
from typing import Any

import verifiers.v1 as vf  # pyright: ignore[reportMissingImports]
from pydantic import ValidationError

from vigil.errors import PackMismatch, SettingError, VigilError
from vigil.integrations.options import check_names, invalid_option
from vigil.integrations.rewards import Verdict, verdict_of
from vigil.integrations.sources import worker_plan
from vigil.integrations.verifiers.config import TASKSET_ID, VigilEnvConfig, VigilTaskConfig, VigilTasksetConfig
from vigil.integrations.verifiers.harness import VigilHarness
from vigil.integrations.verifiers.taskset import VigilData, VigilTaskset
from vigil.runner.models.ask import Ask
from vigil.runner.workers.messages import WorkerPlan
from vigil.runner.workers.players import ModelPlayer
from vigil.runner.workers.pool import SimulatorPool, worker_count

RUN_ID = "verifiers"
_REWARDS = VigilTaskConfig.model_fields.keys() - vf.TaskConfig.model_fields.keys()
_OPTIONS = VigilTasksetConfig.model_fields.keys() - vf.TasksetConfig.model_fields.keys() | _REWARDS


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
        assignment = await source.assignment(str(data.id), data.house)
        record = await ModelPlayer(self._pool, condition, ask, RUN_ID).play(assignment)
        if record.error is not None:
            raise VigilError(f"{record.error.boundary}: {record.error.message}")
        answer = source.answer(str(data.id), data.house)
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
