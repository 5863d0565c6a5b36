"""Worker processes of a vector: each owns a share of the environments and carries out requests on them."""

import signal
import subprocess
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from multiprocessing.connection import Connection
from typing import Any

import gymnasium
import numpy as np
from gymnasium import Space
from gymnasium.spaces import Text
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import CloudpickleWrapper, batch_space, iterate, write_to_shared_memory

from vigil.base.processes.child import MakeState, serve
from vigil.base.processes.worker import Worker, WorkerSettings
from vigil.errors import SettingError

MakeEnv = Callable[[], gymnasium.Env[Any, Any]]
Infos = dict[Any, dict[str, Any]]
"""Number of an environment among those of one process -> its `info`."""
ADVICE = "Is there enough memory? Close the vector and make another one."


class EnvShard(Worker):
    """A worker process with some of the environments of a vector."""

    def __init__(self, process: "ContextProcess", part: slice, make_state: MakeState) -> None:
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
