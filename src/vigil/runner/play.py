"""One episode, played by an agent next to the simulator."""

import traceback
from collections.abc import Callable

from vigil.agents.agent import Agent
from vigil.env import Env
from vigil.episode import Episode
from vigil.errors import InfrastructureError, InputError
from vigil.observation import Observation

Watcher = Callable[[Observation], None]
"""Called with each observation that the agent has answered."""


def play(episode: Episode, env: Env, agent: Agent, watch: Watcher = lambda _: None) -> None:
    """Plays `episode` to its end in `env`, which then has the record.

    The agent sees observations and the instruction, nothing else. Its failures end the episode as `error`. Raises
    InputError for what makes no sense.
    """
    observation = env.reset(episode)
    try:
        if observation is not None:
            agent.start(episode.instruction)
        while observation is not None:
            reply = agent.act(observation)
            watch(observation)
            observation = env.step(reply)
    except InputError:
        raise
    except InfrastructureError as error:
        env.fail("agent", str(error))
    except Exception:  # noqa: BLE001 - a fault in the agent's or simulator's program is no result of the agent's
        env.fail("worker", traceback.format_exc(limit=-8))
