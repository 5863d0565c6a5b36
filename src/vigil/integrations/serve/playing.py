"""`vigil run --env URL`: a model, program or scripted agent plays through a server. The server records the run."""

import asyncio
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial

from pydantic import ValidationError

from vigil.agents.agent import Agent, Closeable
from vigil.agents.conversation import Conversation
from vigil.agents.exec_agent import ProgramSettings
from vigil.agents.frame_encoding import decode_frame
from vigil.agents.registry import is_exec, make_agent
from vigil.agents.sandbox import check_sandbox
from vigil.base.settings import declared_settings
from vigil.errors import SettingError
from vigil.integrations.serve.client import RemoteEnvironment, RemoteEpisode
from vigil.protocol.observation import Observation
from vigil.protocol.profile import Profile
from vigil.runner.models.access import Endpoint, hiding_other_keys
from vigil.runner.models.ask import Ask
from vigil.runner.models.identity_log import ModelIdentityLog
from vigil.runner.models.redaction import Secrets
from vigil.runner.plan import RUNS_FOLDER, endpoint_of
from vigil.runner.settings import RunSettings
from vigil.runner.workers.messages import EncodedObservation
from vigil.runner.workers.players import ask_for_reply
from vigil.runner.workers.pool import worker_count

_OF_THE_PLAYER = {
    *("env", "env_token", "agent", "model", "base_url", "api_key_env", "workers", "max_connections", "temperature"),
    *("top_p", "max_tokens", "reasoning_effort", "thinking", "model_args", "extra_body", "reply_seconds"),
    *("keep_program", "sandbox", "preflight", "force", "seed"),
}
"""Settings that may be set together with `--env`; the server decides all others."""


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


def play_remotely(settings: RunSettings, on_episode: Callable[[int], None] = lambda _: None) -> int:
    """Play the remaining episodes of the server that the settings name, and return how many were played.

    `on_episode` is called after each episode with the number played so far. Raises InputError or InfrastructureError.
    """
    check_settings_of_player(settings)
    server = RemoteEnvironment(settings.env or "", settings.env_token)
    try:
        profile = Profile.model_validate(server.contract()["profile"])
    except (KeyError, ValidationError):
        raise SettingError(
            f"{server.url} is not a `vigil serve` of this version of VIGIL. Check the address and both versions."
        ) from None
    session = _Session(server, profile, on_episode)
    if settings.model is not None:
        endpoint = endpoint_of(settings)
        with hiding_other_keys(endpoint.access):
            asyncio.run(_play_with_model(settings, endpoint, session))
        return session.count
    workers = worker_count(settings.workers)
    with ThreadPoolExecutor(workers) as pool:
        plays = [pool.submit(_play_with_agent, settings, session) for _ in range(workers)]
    for play in plays:
        play.result()
    return session.count


def check_settings_of_player(settings: RunSettings) -> None:
    """Raise SettingError unless exactly one agent or model is named and no setting is set that the server decides."""
    if (settings.agent is None) == (settings.model is None):
        raise SettingError("A run needs an agent or a model: give exactly one of --agent and --model.")
    if settings.sandbox:
        check_sandbox()
    defaults = {one.name: one.default for one in declared_settings(RunSettings)}
    given = [
        one.display_name
        for one in declared_settings(RunSettings)
        if one.name not in _OF_THE_PLAYER and getattr(settings, one.name) != defaults[one.name]
    ]
    if given:
        raise SettingError(f"{', '.join(given)}: with --env, the server decides this. Leave it out.")


def _play_with_agent(settings: RunSettings, session: _Session) -> None:
    name, profile = settings.agent or "", session.profile
    hidden = (RUNS_FOLDER,) if settings.sandbox else None
    program = ProgramSettings(settings.reply_seconds, 0.0, hidden, Secrets.of_command(name).redact)
    agent = make_agent(name, profile, settings.seed, program)
    try:
        while (episode := session.next()) is not None:
            with session.counting():
                _play(agent, episode, profile)
            if is_exec(name) and not settings.keep_program and isinstance(agent, Closeable):
                agent.close()
    finally:
        if isinstance(agent, Closeable):
            agent.close()


def _play(agent: Agent, episode: RemoteEpisode, profile: Profile) -> None:
    agent.start(episode.instruction)
    seen: EncodedObservation | None = episode.first
    while seen is not None:
        draw = partial(decode_frame, seen.picture.data)
        seen = episode.step(agent.act(Observation(draw, seen.feedback, seen.cues)), profile)


async def _play_with_model(settings: RunSettings, endpoint: Endpoint, session: _Session) -> None:
    # Inspect takes a second or two to import, and only models need it.
    from vigil.runner.models.inspect_model import ModelClient, preflight  # noqa: PLC0415

    log = ModelIdentityLog()
    if settings.preflight:
        await preflight(endpoint, log, settings.model or "", session.profile, force=settings.force)
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
