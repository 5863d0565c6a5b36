"""Vector of environments in a few processes. Each process steps its share of the environments one after the other.

Return values and resets are those of Gymnasium's `AsyncVectorEnv`. `AsyncVectorEnv` starts a process for each
environment: sixteen processes on two cores delay each other, and no process can reuse a house that another has built.
"""

import multiprocessing
import signal
import subprocess
import weakref
from collections.abc import Callable, Sequence
from concurrent.futures import wait
from copy import deepcopy
from functools import partial
from itertools import pairwise
from multiprocessing.connection import Connection
from typing import Any

import gymnasium
import numpy as np
from gymnasium import Space
from gymnasium.error import ClosedEnvironmentError
from gymnasium.spaces import Text
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import (
    CloudpickleWrapper,
    batch_space,
    create_shared_memory,
    iterate,
    read_from_shared_memory,
    write_to_shared_memory,
)

from vigil.base.processes.child import MakeState, serve
from vigil.base.processes.group import end_workers
from vigil.base.processes.worker import Worker, WorkerSettings
from vigil.errors import SettingError
from vigil.runner.workers.pool import worker_count

ENV_ID = "vigil.integrations.gymnasium:Vigil-v0"
"""Id of the environment, with the module that registers it: a new process must first import this module."""
StepResult = tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]
MakeEnv = Callable[[], gymnasium.Env[Any, Any]]
Infos = dict[Any, dict[str, Any]]
"""Number of an environment among those of one process -> its `info`."""
ADVICE = "Is there enough memory? Close the vector and make another one."


class ContextProcess:
    """Worker process that multiprocessing starts; it can share memory and, if forked, inherits loaded modules."""

    has_started = True

    def __init__(self, context: Any, name: str, make_state: MakeState) -> None:
        self._connection, theirs = context.Pipe()
        arguments = (theirs, self._connection, make_state)
        self._process = context.Process(target=_serve, args=arguments, name=name, daemon=True)
        self._process.start()
        theirs.close()
        self.pid: int | None = self._process.pid
        self.terminate = self._process.terminate
        self.kill = self._process.kill

    def connect(self) -> Connection:
        """Return the pipe's connection for the parent process."""
        return self._connection

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit code. Raises subprocess.TimeoutExpired."""
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired(self._process.name, timeout or 0.0)
        return self._process.exitcode


def _serve(connection: Connection, parents: Connection, make_state: MakeState) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the parent process handles interrupts
    parents.close()
    serve(connection, make_state)


class EnvShard(Worker):
    """A worker process with some of the environments of a vector."""

    def __init__(self, process: ContextProcess, part: slice, make_state: MakeState) -> None:
        """Start the thread that sends requests to `process`.

        The process runs already, because forking is unsafe once threads run. If it ends, it is not replaced, because
        the state of its environments is lost: all requests then fail.
        """
        self.part = part
        """Positions of this process's environments in the vector."""
        settings = WorkerSettings(start=lambda *_: process, advice=ADVICE)
        super().__init__(make_state, f"The process of environments {part.start} to {part.stop - 1}", settings)


def start_shards(
    context: Any, env_fns: Sequence[MakeEnv], bounds: Sequence[int], memory: Any, autoreset_mode: AutoresetMode
) -> list[EnvShard]:
    """Start the processes with multiprocessing's `context`; process i has the environments bounds[i]:bounds[i + 1]."""
    parts = [slice(first, last) for first, last in pairwise(bounds)]
    makers = [
        partial(Environments, list(map(CloudpickleWrapper, env_fns[part])), part.start, memory, autoreset_mode)
        for part in parts
    ]
    processes = [
        ContextProcess(context, f"environments-{part.start}-to-{part.stop - 1}", make)
        for part, make in zip(parts, makers, strict=True)
    ]
    return list(map(EnvShard, processes, parts, makers))


class Environments(SyncVectorEnv):
    """A share of the environments, stepped and reset by Gymnasium's single-process vector."""

    def __init__(self, env_fns: Sequence[MakeEnv], first: int, memory: Any, autoreset_mode: AutoresetMode) -> None:
        """Make the environments. The first of them has the number `first` in the vector and in the shared memory."""
        super().__init__(env_fns, copy=False, autoreset_mode=autoreset_mode)
        self.action_space = batch_space(Text(1), self.num_envs)
        """Placeholder that passes on actions without conversion, because the vector has already split them."""
        self._first, self._memory = first, memory

    def check_spaces(self, observations: Space[Any], actions: Space[Any]) -> None:
        """Raise SettingError if the spaces of these environments differ from those of the vector."""
        for ours, wanted in ((self.single_observation_space, observations), (self.single_action_space, actions)):
            if ours != wanted:
                raise SettingError(
                    f"Environment {self._first} has the space {ours}, but environment 0 has {wanted}. All "
                    "environments of a vector need the same spaces."
                )

    def reset_some(self, seeds: list[int | None], options: dict[str, Any] | None, mask: np.ndarray | None) -> Infos:
        """Reset all environments, or those in the mask, and return their infos."""
        if mask is not None and not mask.any():
            return {}
        chosen = options if mask is None else {**(options or {}), "reset_mask": mask}
        seen, infos = super().reset(seed=seeds, options=chosen)
        self._write(seen)
        return infos

    def step_all(self, actions: list[Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray, Infos]:
        """Take an action in each environment; return rewards, terminations, truncations and infos."""
        seen, rewards, terminated, truncated, infos = super().step(actions)
        self._write(seen)
        return rewards, terminated, truncated, infos

    def call_each(self, name: str, arguments: tuple[Any, ...], named: dict[str, Any]) -> tuple[Any, ...]:
        """Return, for each environment, the result of its method `name`, or the value of its attribute `name`."""
        return super().call(name, *arguments, **named)

    def _write(self, seen: Any) -> None:
        for number, each in enumerate(iterate(self.observation_space, seen)):
            write_to_shared_memory(self.single_observation_space, self._first + number, each, self._memory)

    def _add_info(self, vector_infos: Infos, env_info: dict[str, Any], env_num: int) -> Infos:  # type: ignore[override]
        """Keep the infos of the environments separate; the vector joins them."""
        vector_infos.setdefault(env_num, {}).update(env_info)
        return vector_infos


class SharedProcessVectorEnv(VectorEnv[Any, Any, np.ndarray]):
    """Vector of environments, spread as evenly as possible over `processes` processes."""

    def __init__(
        self,
        env_fns: Sequence[MakeEnv],
        *,
        processes: int | None = None,
        context: str | None = None,
        copy: bool = True,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    ) -> None:
        """Start the processes, by default one per core. `context` is the start method of `multiprocessing`.

        Without `copy`, each observation overwrites the arrays of the previous observation. Raises any error that occurs
        when an environment is made.
        """
        if not env_fns or (processes is not None and processes < 1):
            raise SettingError(
                f"SharedProcessVectorEnv with {len(env_fns)} environments and processes={processes}: both must be at "
                "least 1, or processes may be None for one process per core."
            )
        mode = AutoresetMode(autoreset_mode)
        self.num_envs, self.copy, self.autoreset_mode = len(env_fns), copy, mode
        self._describe(env_fns[0])
        started = multiprocessing.get_context(context)
        memory = create_shared_memory(self.single_observation_space, self.num_envs, ctx=started)
        self._observations = read_from_shared_memory(self.single_observation_space, memory, self.num_envs)
        bounds = np.linspace(0, self.num_envs, 1 + min(worker_count(processes), self.num_envs)).astype(int).tolist()
        self._shards = start_shards(started, env_fns, bounds, memory, mode)
        self._end = weakref.finalize(self, end_workers, self._shards)
        spaces = (self.single_observation_space, self.single_action_space)
        try:
            self._call_all(Environments.check_spaces, [spaces] * len(self._shards))
        except BaseException:
            self.close()
            raise

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Reset all environments, or those in `options["reset_mask"]`; with seed S, environment i gets seed S + i."""
        seeds = seed if isinstance(seed, list) else [seed if seed is None else seed + i for i in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise SettingError(
                f"reset() of {self.num_envs} environments got {len(seeds)} seeds; give one seed for each."
            )
        given = dict(options or {})
        mask = self._mask(given.pop("reset_mask", None))
        shard_options = None if options is None else given
        asked = [
            (seeds[shard.part], shard_options, None if mask is None else mask[shard.part]) for shard in self._shards
        ]
        infos = self._joined(self._call_all(Environments.reset_some, asked))
        return self._seen(), infos

    def step(self, actions: Any) -> StepResult:
        """Take one action in each environment.

        In the default mode, an environment whose episode has ended is reset instead.
        """
        each = list(iterate(self.action_space, actions))
        answers = self._call_all(Environments.step_all, [(each[shard.part],) for shard in self._shards])
        infos = self._joined([answer[-1] for answer in answers])
        rewards, terminated, truncated = (np.concatenate([answer[i] for answer in answers]) for i in range(3))
        return self._seen(), rewards, terminated, truncated, infos

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return, for each environment, the result of its method `name`, or the value of its attribute `name`."""
        answers = self._call_all(Environments.call_each, [(name, args, kwargs)] * len(self._shards))
        return tuple(each for answer in answers for each in answer)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of each environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of each environment.

        A list or tuple has one value for each environment; any other value is set in all environments.
        """
        each = list(values) if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise SettingError(
                f"set_attr() of {self.num_envs} environments got {len(each)} values; give one value for each."
            )
        self._call_all(Environments.set_attr, [(name, each[shard.part]) for shard in self._shards])

    def render(self) -> tuple[Any, ...]:
        """Return the current frame of each environment; None for an environment without a render mode."""
        return self.call("render")

    def close_extras(self, **kwargs: Any) -> None:
        """Close the environments and end the processes."""
        del kwargs
        self._end()

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override] - read only here
        """Random generator of each environment."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override] - read only here
        """Seed of each environment."""
        return self.get_attr("np_random_seed")

    def _describe(self, make: MakeEnv) -> None:
        """Make one environment, read its spaces (equal for all environments) and close it.

        Forked processes inherit the modules and data that the environment loaded.
        """
        env = make()
        self.metadata = {**env.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = env.render_mode
        self.single_observation_space, self.single_action_space = env.observation_space, env.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        env.close()

    def _call_all(self, method: Callable[..., Any], arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
        """Call a method in every process, wait for all answers and return them. Raises the first error among them."""
        if self.closed:
            raise ClosedEnvironmentError(f"{method.__name__}(): the vector of environments has been closed.")
        answers = [shard.submit(method, *each) for shard, each in zip(self._shards, arguments, strict=True)]
        wait(answers)
        return [answer.result() for answer in answers]

    def _mask(self, given: Any) -> np.ndarray | None:
        if given is None:
            return None
        mask = np.asarray(given)
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise SettingError(f"reset_mask is {given!r}: give {self.num_envs} booleans, at least one of them true.")
        return mask

    def _joined(self, found: Sequence[Infos]) -> dict[str, Any]:
        """Return the infos of all processes, as Gymnasium joins them."""
        infos: dict[str, Any] = {}
        for shard, of_shard in zip(self._shards, found, strict=True):
            for number, info in of_shard.items():
                infos = self._add_info(infos, info, shard.part.start + number)
        return infos

    def _seen(self) -> Any:
        return deepcopy(self._observations) if self.copy else self._observations


def make_vector(
    num_envs: int = 1,
    *,
    processes: int | None = None,
    context: str | None = None,
    copy: bool = True,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    **options: Any,
) -> SharedProcessVectorEnv:
    """Return the vector that `gymnasium.make_vec("Vigil-v0", ...)` makes; `options` are those of `gymnasium.make`."""
    make = partial(gymnasium.make, ENV_ID, **options)
    return SharedProcessVectorEnv(
        [make] * num_envs, processes=processes, context=context, copy=copy, autoreset_mode=autoreset_mode
    )
