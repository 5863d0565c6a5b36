"""One episode, played by an agent next to the simulator."""

import traceback
from collections.abc import Callable, Sequence

from vigil.agents.agent import Agent, Resumable
from vigil.env import Env
from vigil.errors import InfrastructureError, InputError
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.observation import Observation
from vigil.runner.workers.messages import Fork


def begin(
    env: Env, episode: Episode, fork: Fork | None, on_past: Callable[[Observation], None] = lambda _: None
) -> Observation | None:
    """Return the first observation of an episode that may continue another play; None if the simulator failed.

    `on_past` is called with each observation of the continued play before the returned one. Raises InputError, also
    when the play cannot be repeated exactly.
    """
    steps = () if fork is None else fork.steps
    observation = env.reset(episode, len(steps))
    for step in steps:
        if observation is not None:
            on_past(observation)
            observation = env.replay(step)
    return observation


def play(
    episode: Episode,
    env: Env,
    agent: Agent,
    *,
    fork: Fork | None = None,
    earlier: Sequence[Reply] | None = None,
    on_first_frame: Callable[[], None] = lambda: None,
    on_reply: Callable[[Observation, Reply], object] = lambda _observation, _reply: None,
) -> None:
    """Play `episode` to its end in `env`, which then has the record.

    The replies of `fork`, the play that the episode continues, are carried out first, then `earlier`: the agent's
    replies from a lost process (None: it has not begun). `on_first_frame` is called before the first frame is shown,
    `on_reply` before a reply is carried out. The agent sees only observations and the instruction. Failures of its
    program end the episode as `error`. Raises InputError.
    """
    observation = begin(env, episode, fork)
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
                on_first_frame()
        while observation is not None:
            reply = agent.act(observation)
            on_reply(observation, reply)
            observation = env.step(reply)
    except InputError:
        raise
    except InfrastructureError as error:
        env.fail("agent", str(error))
    except Exception:  # noqa: BLE001 - a fault in a program is not a result of the agent
        env.fail("worker", traceback.format_exc(limit=-8))
