"""Worker process of a vector: it owns a share of the environments and carries out requests on them."""

import pickle
import signal
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

import gymnasium
import numpy as np
from gymnasium import Space
from gymnasium.spaces import Text
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import CloudpickleWrapper, batch_space, iterate, write_to_shared_memory

from vigil.errors import SettingError, SimulatorError

MakeEnv = Callable[[], gymnasium.Env[Any, Any]]
Infos = dict[Any, dict[str, Any]]
"""`info` of environments, by their numbers in the share."""
END_TIMEOUT_S = 60.0
"""Longest time (s) that a process may take to end; it finishes building a house first, which takes seconds."""


class EnvShard:
    """Handle of a worker process with some of the environments, in the process that steps them all."""

    def __init__(
        self, context: Any, env_fns: list[MakeEnv], first: int, memory: Any, autoreset_mode: AutoresetMode
    ) -> None:
        self.part = slice(first, first + len(env_fns))
        """Positions of its environments among all."""
        self._asked = 0
        self._pipe, other = context.Pipe()
        wrapped = [CloudpickleWrapper(make) for make in env_fns]
        self._process = context.Process(
            target=_serve,
            args=(other, self._pipe, wrapped, first, memory, autoreset_mode),
            name=f"environments-{first}-to-{self.part.stop - 1}",
            daemon=True,
        )
        self._process.start()
        other.close()

    def ask(self, command: str, arguments: tuple[Any, ...]) -> None:
        """Let the process call a method of `_Environments`. Raises SimulatorError if it has ended."""
        self._asked += 1
        try:
            self._pipe.send((self._asked, command, arguments))
        except OSError:
            raise self._ended_error() from None

    def answer(self) -> Any:
        """Return the result of the last call, or its error. Raises SimulatorError if the process has ended."""
        number, answer = 0, None
        while number != self._asked:  # an interrupt may have left an earlier answer unread
            try:
                number, answer = self._pipe.recv()
            except (EOFError, OSError):
                raise self._ended_error() from None
        return answer

    def request_stop(self) -> None:
        """Ask the process to end after its current request."""
        with suppress(OSError):  # it has already ended
            self._pipe.send(None)

    def end(self) -> None:
        """Wait for the process to end; kill it after END_TIMEOUT_S."""
        self._process.join(END_TIMEOUT_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._pipe.close()

    def _ended_error(self) -> SimulatorError:
        self._process.join(1.0)
        return SimulatorError(
            f"The process of environments {self.part.start} to {self.part.stop - 1} has ended (exit code "
            f"{self._process.exitcode}). Is there enough memory? Close the vector and make another one."
        )


class _Environments(SyncVectorEnv):
    """A share of the environments, stepped and reset by Gymnasium's single-process vector."""

    def __init__(self, env_fns: list[MakeEnv], first: int, memory: Any, autoreset_mode: AutoresetMode) -> None:
        super().__init__(env_fns, copy=False, autoreset_mode=autoreset_mode)
        self.action_space = batch_space(Text(1), self.num_envs)
        """Placeholder whose batches are split without conversion: the vector has already split the actions."""
        self._first, self._memory = first, memory

    def check_spaces(self, observations: Space[Any], actions: Space[Any]) -> None:
        """Raise SettingError if the spaces of these environments differ from those of the vector."""
        for ours, wanted in ((self.single_observation_space, observations), (self.single_action_space, actions)):
            if ours != wanted:
                raise SettingError(f"Environment {self._first} has the space {ours}, the first one {wanted}.")

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
        """Return, for each environment, the result of its method of that name, or the value of its attribute."""
        return super().call(name, *arguments, **named)

    def _write(self, seen: Any) -> None:
        for number, each in enumerate(iterate(self.observation_space, seen)):
            write_to_shared_memory(self.single_observation_space, self._first + number, each, self._memory)

    def _add_info(self, vector_infos: Infos, env_info: dict[str, Any], env_num: int) -> Infos:  # type: ignore[override]
        """Keep the infos of the environments separate; the vector joins them."""
        vector_infos.setdefault(env_num, {}).update(env_info)
        return vector_infos


def _serve(
    pipe: Connection,
    parents: Connection,
    env_fns: list[MakeEnv],
    first: int,
    memory: Any,
    autoreset_mode: AutoresetMode,
) -> None:
    """Carry out requests until asked to stop or until the parent process has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the parent process handles interrupts
    parents.close()
    made: list[_Environments] = []

    def done(command: str, arguments: tuple[Any, ...]) -> Any:
        if not made:  # made at the first request, so that an error becomes an answer
            made.append(_Environments(env_fns, first, memory, autoreset_mode))
        return getattr(made[0], command)(*arguments)

    try:
        while (asked := pipe.recv()) is not None:
            number, command, arguments = asked
            pipe.send_bytes(_answer(number, partial(done, command, arguments)))
    except (EOFError, BrokenPipeError):
        return
    finally:
        for environments in made:
            environments.close()


def _answer(number: int, do: Callable[[], Any]) -> Any:
    """Return, as bytes, the result of a call, or its error with the traceback."""
    try:
        return ForkingPickler.dumps((number, do()))
    except Exception as error:  # noqa: BLE001 - raised again by the vector
        error.add_note(f"In the environments' process:\n{traceback.format_exc()}")
        return ForkingPickler.dumps((number, _sendable(error)))


def _sendable(error: Exception) -> Exception:
    """Return an error, or, if it cannot be pickled, one with the same text."""
    try:
        return pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - errors of any library may fail in any way
        said = SimulatorError(f"{type(error).__name__}: {error}")
        said.__notes__ = error.__notes__
        return said
