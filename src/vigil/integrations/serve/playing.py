"""`vigil run --env URL`: a model, program or scripted agent plays through a server. The server records the run."""

import asyncio
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial

from pydantic import ValidationError

from vigil.agents.agent import Closeable
from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import decode_frame
from vigil.agents.registry import is_exec, make_agent
from vigil.errors import SettingError
from vigil.integrations.serve.client import RemoteEnvironment, RemoteEpisode
from vigil.protocol.observation import Observation
from vigil.protocol.profile import Profile
from vigil.runner.models.access import Endpoint, hiding_other_keys
from vigil.runner.models.ask import Ask
from vigil.runner.models.identity_log import ModelIdentityLog
from vigil.runner.plan import RemotePlan
from vigil.runner.workers.messages import EncodedObservation
from vigil.runner.workers.players import ask_for_reply
from vigil.runner.workers.pool import worker_count


@dataclass(slots=True)
class _Session:
    """State that the threads or tasks of `play_remotely` share."""

    server: RemoteEnvironment
    profile: Profile
    on_episode: Callable[[int], None]
    count: int = 0
    """Number of episodes that were played to the end."""
    has_failed: bool = False
    """Whether a thread or task failed. The others then finish their episodes and begin no further ones."""
    lock: threading.Lock = field(default_factory=threading.Lock)

    def next(self) -> RemoteEpisode | None:
        """Return the next episode; None if no episode is left or something failed."""
        return None if self.has_failed else self.server.reset()

    @contextmanager
    def counting(self) -> Generator[None, None, None]:
        """Count the episode that the `with` block plays, or set `has_failed` if the block raises an error."""
        try:
            yield
        except BaseException:
            self.has_failed = True
            raise
        with self.lock:
            self.count += 1
            self.on_episode(self.count)


def play_remotely(plan: RemotePlan, on_episode: Callable[[int], None] = lambda _: None) -> int:
    """Play the remaining episodes of the plan's server, and return how many were played.

    `on_episode` is called after each episode with the number played so far. Raises InputError or InfrastructureError.
    """
    server = RemoteEnvironment(plan.url, plan.token)
    try:
        profile = Profile.model_validate(server.contract()["profile"])
    except (KeyError, ValidationError):
        raise SettingError(
            f"{server.url} is not a `vigil serve` of this version of VIGIL. Check the address and both versions."
        ) from None
    session = _Session(server, profile, on_episode)
    if plan.endpoint is not None:
        with hiding_other_keys(plan.endpoint.access):
            asyncio.run(_play_with_model(plan, plan.endpoint, session))
        return session.count
    workers = worker_count(plan.workers)
    with ThreadPoolExecutor(workers) as pool:
        plays = [pool.submit(_play_with_agent, plan, session) for _ in range(workers)]
    for play in plays:
        play.result()
    return session.count


def _play_with_agent(plan: RemotePlan, session: _Session) -> None:
    profile = session.profile
    agent = make_agent(plan.agent, profile, plan.seed, plan.program)
    try:
        while (episode := session.next()) is not None:
            with session.counting():
                agent.start(episode.instruction)
                seen: EncodedObservation | None = episode.first
                while seen is not None:
                    draw = partial(decode_frame, seen.picture.data)
                    seen = episode.step(agent.act(Observation(draw, seen.feedback, seen.cues)), profile)
            if is_exec(plan.agent) and not plan.keep_program and isinstance(agent, Closeable):
                agent.close()
    finally:
        if isinstance(agent, Closeable):
            agent.close()


async def _play_with_model(plan: RemotePlan, endpoint: Endpoint, session: _Session) -> None:
    # Inspect takes a second or two to import, and only models need it.
    from vigil.runner.models.inspect_model import ModelClient, preflight  # noqa: PLC0415

    log = ModelIdentityLog()
    if plan.preflight:
        await preflight(endpoint, log, plan.name, session.profile, force=plan.force)
    async with ModelClient(endpoint, log) as client:

        async def play_all() -> None:
            while (episode := await asyncio.to_thread(session.next)) is not None:
                with session.counting():
                    await _converse(episode, session.profile, client.ask)

        players = (play_all() for _ in range(endpoint.max_connections))
        for result in await asyncio.gather(*players, return_exceptions=True):
            if isinstance(result, BaseException):
                raise result


async def _converse(episode: RemoteEpisode, profile: Profile, ask: Ask) -> None:
    conversation = Conversation(profile, episode.instruction)
    seen: EncodedObservation | None = episode.first
    has_replied = False
    while seen is not None:
        messages = conversation.messages(seen.picture, seen.feedback, seen.cues)
        reply = await ask_for_reply(ask, messages, profile, has_replied=has_replied)
        has_replied = True
        conversation.add(seen.feedback, reply.text, cues=seen.cues, picture=seen.picture)
        seen = await asyncio.to_thread(episode.step, reply, profile)
