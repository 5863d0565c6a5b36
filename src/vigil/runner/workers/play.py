"""One episode, played by an agent next to the simulator."""

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from vigil.agents.agent import Agent, Resumable
from vigil.env import Env
from vigil.errors import InfrastructureError, InputError
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.observation import Observation


@dataclass(frozen=True, slots=True)
class EpisodeObserver:
    """Callbacks that report on an episode while it is played."""

    on_first_frame: Callable[[], None] = lambda: None
    """Called before the agent is shown the first frame."""
    on_reply: Callable[[Observation, Reply], object] = lambda _observation, _reply: None
    """Called with each observation and the agent's reply to it, before the reply is carried out."""


def play(
    episode: Episode,
    env: Env,
    agent: Agent,
    observer: EpisodeObserver = EpisodeObserver(),
    earlier: Sequence[Reply] | None = None,
) -> None:
    """Play `episode` to its end in `env`, which then has the record.

    The agent sees only observations and the instruction. If the agent's program fails, the episode ends as `error`. If
    the agent's earlier process was lost, `earlier` has the replies that it gave: they are carried out first, and the
    agent continues after them. Raises InputError.
    """
    observation = env.reset(episode)
    try:
        for reply in earlier or ():
            if observation is not None:
                _ = observation.rgb  # so that the record says again that this frame was looked at
                observation = env.step(reply)
        if observation is not None:
            if earlier is not None and isinstance(agent, Resumable):
                agent.resume(episode.instruction)
            else:
                agent.start(episode.instruction)
            if earlier is None:
                observer.on_first_frame()
        while observation is not None:
            reply = agent.act(observation)
            observer.on_reply(observation, reply)
            observation = env.step(reply)
    except InputError:
        raise
    except InfrastructureError as error:
        env.fail("agent", str(error))
    except Exception:  # noqa: BLE001 - a fault in a program is not a result of the agent
        env.fail("worker", traceback.format_exc(limit=-8))
