"""The protocol of an agent that plays synchronously, next to the simulator."""

from typing import Protocol, runtime_checkable

from vigil.protocol.actions import Reply
from vigil.protocol.observation import Observation

REPLY_SECONDS = 600
"""Default time limit of one reply of a model or a program, in seconds."""
FRAME_INTERVAL_SECONDS = 1.0
"""A program's next frame comes a whole number of these after its reply, unless a run says otherwise."""


class Agent(Protocol):
    """Plays one episode at a time: `start`, then one reply to each observation."""

    name: str
    """Name for run headers."""

    def start(self, instruction: str) -> None:
        """Forget the episode before and take over the instruction of the next."""

    def act(self, observation: Observation) -> Reply:
        """Return the reply to an observation. Raises InfrastructureError for a failure that is not the agent's."""
        ...


@runtime_checkable
class Resumable(Protocol):
    """An agent that can go on with an episode when the process in which it played is gone."""

    def resume(self, instruction: str) -> None:
        """Take over an episode that is going on, in place of `start`."""


@runtime_checkable
class Closeable(Protocol):
    """An agent that holds something (a process, a connection) to give back."""

    def close(self) -> None:
        """Give back what the agent holds."""
