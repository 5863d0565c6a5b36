"""The protocol of an agent that plays synchronously, in the simulator's process."""

from typing import Protocol, runtime_checkable

from vigil.protocol.actions import Reply
from vigil.protocol.observation import Observation

REPLY_SECONDS = 600
"""Default time limit (s) for one reply of a model or of an agent's program."""
FRAME_INTERVAL_SECONDS = 1.0
"""Default interval (s) at which an agent's program gets frames: each is sent a whole number of intervals after the last
reply."""


class Agent(Protocol):
    """An agent that plays one episode at a time: `start`, then one reply to each observation."""

    name: str
    """Name of the agent in run headers."""

    def start(self, instruction: str) -> None:
        """Begin an episode with this instruction, and forget any earlier episode."""

    def act(self, observation: Observation) -> Reply:
        """Return the reply to an observation. Raises InfrastructureError for a failure that the agent did not cause."""
        ...


@runtime_checkable
class Resumable(Protocol):
    """An agent that can continue an episode in a new process, after the process that began the episode was lost."""

    def resume(self, instruction: str) -> None:
        """Continue an episode that was begun in another process. VIGIL calls this instead of `start`."""


@runtime_checkable
class Closeable(Protocol):
    """An agent that holds a resource, such as a process or a connection."""

    def close(self) -> None:
        """Release the agent's resources."""
