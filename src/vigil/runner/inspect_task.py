"""Models run through Inspect: the only module that imports `inspect_ai`.

Inspect brings the providers, the limit on connections, and a log for its viewer. Ours are the messages (a fixed history
contract), the retries (`vigil.runner.ask`), the Env, and the records that decide: `episodes.jsonl`, not Inspect's log.
"""

import asyncio
import gc
import json
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from inspect_ai import Task, task
from inspect_ai import eval as inspect_eval
from inspect_ai._util.error import PrerequisiteError
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.event import ModelEvent
from inspect_ai.log import EvalLog
from inspect_ai.model import (
    ChatMessage,
    ChatMessageAssistant,
    ChatMessageSystem,
    ChatMessageUser,
    Content,
    ContentImage,
    ContentReasoning,
    ContentText,
    GenerateConfig,
    Model,
    ModelOutput,
    ModelUsage,
    get_model,
)
from inspect_ai.model._model import use_model_event_sink
from inspect_ai.scorer import Score, Scorer, Target, grouped, mean, scorer
from inspect_ai.solver import Generate, Solver, TaskState, solver
from rich.markup import escape
from rich.text import Text

from vigil.actions import Reply, Usage
from vigil.agents.agent import REPLY_SECONDS
from vigil.agents.model import Message
from vigil.episode import Episode, Family
from vigil.errors import InputError, ModelAPIError, SettingError, VigilError
from vigil.pack import Pack
from vigil.profile import BASELINE, Coordinates, ImageFormat, Profile, PromptVariant, ReplyPolicy
from vigil.prompt import frame_stub
from vigil.record import EpisodeRecord
from vigil.runner.ask import Ask, ModelTrouble, Patience, Send, is_rejection, persistent
from vigil.runner.live import play_live
from vigil.runner.pool import SimulatorPool, usable_cpus
from vigil.runner.preflight import check_sight
from vigil.runner.serving import Serving, provider_hint, without_login
from vigil.runner.settings import RunSettings, plan_run, profile_of, worker_plan
from vigil.runner.wire import Ticket
from vigil.scoring import settle

PREFLIGHT_RETRIES = 2
_TRANSPORT_ERRORS = (OSError, EOFError, json.JSONDecodeError)
_PREFIX = "" if {"site-packages", "dist-packages"} & set(Path(__file__).parts) else "vigil/"
"""Inspect finds the package of what is registered by itself, except in an editable install whose distribution has
another name than the package."""
PlayOne = Callable[[Ticket, Ask], Awaitable[EpisodeRecord]]
"""Plays one episode with a model and keeps the record. Raises VigilError to stop the run."""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A model with how it is called."""

    serving: Serving
    sampling: dict[str, Any] = field(default_factory=dict)
    """Fields of Inspect's GenerateConfig; only what the user set."""
    max_connections: int = 16
    reply_seconds: int = REPLY_SECONDS
    patience: Patience = field(default_factory=Patience)

    def model(self) -> Model:
        """Returns a client of its own. Raises SettingError when the provider cannot be used."""
        try:
            config = GenerateConfig(
                **self.sampling,
                max_connections=self.max_connections,
                max_retries=0,
                attempt_timeout=self.reply_seconds,
            )
            return get_model(
                self.serving.name,
                config=config,
                base_url=self.serving.base_url,
                api_key=self.serving.api_key,
                memoize=False,
                **dict(self.serving.arguments),
            )
        except Exception as error:
            hint = provider_hint(self.serving.name)
            raise SettingError(f"Model {self.serving.name!r} cannot be used: {_plain(error)}{hint}") from error


def _plain(error: Exception) -> str:
    """Returns in one line what an error says; Inspect marks up those that it means for a terminal."""
    text = Text.from_markup(str(error)).plain if isinstance(error, PrerequisiteError) else str(error)
    lines = [" ".join(line.split()) for line in text.strip().removeprefix("ERROR:").splitlines() if line.strip()]
    return " ".join(line if line[-1] in ".:" else f"{line}." for line in lines)


# --- one attempt at one reply -----------------------------------------------------------------------------------------


class _LastCall:
    """Takes Inspect's model events: they hold the provider's answer verbatim, and would hold every frame in memory."""

    def __init__(self) -> None:
        self.event: ModelEvent | None = None

    def on_pending(self, event: ModelEvent) -> None:
        self.event = event

    def on_complete(self, event: ModelEvent) -> None:
        self.event = event

    def message(self) -> dict[str, Any] | None:
        """Returns the message of a chat completion as the server sent it; None for other kinds of answers."""
        call = self.event.call if self.event is not None else None
        choices = call.response.get("choices") if call is not None and call.response else None
        first = choices[0] if isinstance(choices, list) and choices else None
        message = first.get("message") if isinstance(first, dict) else None
        return message if isinstance(message, dict) else None


def sender(model: Model, config: GenerateConfig | None = None) -> Send:
    """Returns the function that sends messages to `model` once; `config` overrides the model's own."""
    config = config or GenerateConfig()

    async def send(messages: Sequence[Message]) -> Reply:
        last_call = _LastCall()
        try:
            with use_model_event_sink(last_call):
                output = await model.generate([_chat_message(message) for message in messages], config=config)
        except Exception as error:
            raise _trouble(model, error) from error
        return _reply(output, last_call.message())

    return send


def _chat_message(message: Message) -> ChatMessage:
    if message.role == "system":
        return ChatMessageSystem(content=message.text)
    if message.role == "assistant":
        return ChatMessageAssistant(content=message.text)
    if message.picture is None:
        return ChatMessageUser(content=message.text)
    content: list[Content] = [ContentText(text=message.text), ContentImage(image=message.picture.data_uri)]
    return ChatMessageUser(content=content)


def _trouble(model: Model, error: Exception) -> ModelTrouble:
    cause = error.__cause__ if type(error).__name__ == "RetryError" else None
    root = cause if isinstance(cause, Exception) else error
    status = getattr(root, "status_code", None)
    message = getattr(root, "provider_message", None) or str(root) or type(root).__name__
    if is_rejection(status, message):
        return ModelTrouble(message, is_rejection=True)
    can_retry = model.should_retry(root) or isinstance(root, _TRANSPORT_ERRORS) or status in (408, 409, 429)
    wait_s = getattr(model.api.should_retry(root), "retry_after", None)
    return ModelTrouble(f"{type(root).__name__}: {message}"[:1000], can_retry=can_retry, wait_s=wait_s)


def _reply(output: ModelOutput, message: dict[str, Any] | None) -> Reply:
    """Returns the reply verbatim: Inspect cuts `<think>` out of any place of a text, the protocol off its start."""
    if output.empty:
        raise ModelTrouble("The provider's answer holds no reply.", can_retry=True)
    is_refused_request = output.stop_reason == "model_length" and output.usage is None
    if output.stop_reason == "content_filter" or is_refused_request:
        raise ModelTrouble(output.completion, is_rejection=True)
    parts = output.message.content
    reasoning = [part.reasoning for part in parts if isinstance(part, ContentReasoning)] if _is_list(parts) else []
    return Reply(
        text=_text(output, message),
        finish_reason=output.stop_reason,
        reasoning_chars=sum(map(len, reasoning)),
        usage=_usage(output.usage),
        seconds=output.time or 0.0,
    )


def _is_list(content: str | list[Content]) -> bool:
    return not isinstance(content, str)


def _text(output: ModelOutput, message: dict[str, Any] | None) -> str:
    if message is not None:
        raw = message.get("content") or message.get("refusal")
        if raw is None or isinstance(raw, str):
            return raw or ""
    return output.completion


def _usage(usage: ModelUsage | None) -> Usage | None:
    if usage is None:
        return None
    cached = (usage.input_tokens_cache_read or 0) + (usage.input_tokens_cache_write or 0)
    return Usage(input_tokens=usage.input_tokens + cached, output_tokens=usage.output_tokens)


async def preflight(endpoint: Endpoint, name: str, image_format: ImageFormat) -> None:
    """Raises ModelAPIError unless pictures reach the model."""
    model = endpoint.model()
    try:
        patience = replace(endpoint.patience, retries=min(endpoint.patience.retries, PREFLIGHT_RETRIES))
        ask = persistent(sender(model), patience)
        await check_sight(ask, name, image_format, without_login(endpoint.serving.base_url or ""))
    finally:
        await model.api.aclose()


# --- a run inside an Inspect evaluation -------------------------------------------------------------------------------


def evaluate(endpoint: Endpoint, tickets: Sequence[Ticket], play_one: PlayOne, log_dir: Path) -> None:
    """Plays all `tickets`. Raises what `play_one` raises, or KeyboardInterrupt when it was interrupted."""
    model = endpoint.model()
    ask = persistent(sender(model), endpoint.patience)
    stop: list[VigilError] = []
    tidy = _Tidy(model, play_one, len(tickets))
    with _rare_collections():
        logs = inspect_eval(
            _task(tickets, _agent(tickets, tidy.play_one, lambda: ask, stop)),
            model=model,
            log_dir=str(log_dir),
            display="none",
            score_display=False,
            max_samples=endpoint.max_connections,
            fail_on_error=False,
            log_images=False,
            log_realtime=False,
            log_model_api=False,
            ctl_server=False,
            acp_server=False,
        )
    if stop:
        raise stop[0]
    _check(logs)


@contextmanager
def _rare_collections() -> Iterator[None]:
    """Lets the collector of cycles run rarely: it took a quarter of this process, mostly over what was imported."""
    gc.collect()
    gc.freeze()
    usual = gc.get_threshold()
    gc.set_threshold(50_000, 20, 50)
    try:
        yield
    finally:
        gc.set_threshold(*usual)
        gc.unfreeze()


class _Tidy:
    """Closes the model's connections when the last episode is over, while the event loop still runs."""

    def __init__(self, model: Model, play_one: PlayOne, episodes: int) -> None:
        self._model = model
        self._play_one = play_one
        self._left = episodes
        self._alive = 0

    async def play_one(self, ticket: Ticket, ask: Ask) -> EpisodeRecord:
        self._left -= 1
        self._alive += 1
        try:
            return await self._play_one(ticket, ask)
        except VigilError:
            self._left = 0
            raise
        finally:
            self._alive -= 1
            if self._left == 0 and self._alive == 0:
                await self._model.api.aclose()


def _check(logs: list[EvalLog]) -> None:
    if not logs or any(log.status == "cancelled" for log in logs):
        raise KeyboardInterrupt  # Inspect has taken the signal, and gives back nothing
    for log in logs:
        faults = [sample.error.message for sample in log.samples or [] if sample.error is not None]
        if log.status != "success" or faults:
            what = log.error.message if log.error is not None else "; ".join(faults[:3])
            raise ModelAPIError(f"Inspect's evaluation ended as {log.status!r}: {what}. See {log.location}.")


def _task(tickets: Sequence[Ticket], agent: Solver, **more: Any) -> Task:
    samples = [
        Sample(
            id=_sample_id(ticket),
            input=ticket.episode.instruction,
            metadata={"family": ticket.episode.family, "episode": ticket.episode.model_dump(mode="json")},
        )
        for ticket in tickets
    ]
    return Task(dataset=MemoryDataset(samples, name="vigil"), solver=agent, scorer=vigil_score(), name="vigil", **more)


def _sample_id(ticket: Ticket) -> str:
    return ticket.episode.id if ticket.epoch == 1 else f"{ticket.episode.id}@{ticket.epoch}"


def _agent(
    tickets: Sequence[Ticket], play_one: PlayOne, ask_of: Callable[[], Ask], stop: list[VigilError] | None = None
) -> Solver:
    """Returns Inspect's solver; what stops the run is put into `stop`, or raised for Inspect to tell without one."""
    by_id = {_sample_id(ticket): ticket for ticket in tickets}

    @solver(name="vigil_agent")
    def vigil_agent() -> Solver:
        async def solve(state: TaskState, generate: Generate) -> TaskState:
            if stop:
                return state
            ticket = by_id[str(state.sample_id)]
            if state.epoch > 1:
                ticket = Ticket(ticket.episode, state.epoch, ticket.attempt)
            try:
                record = await play_one(ticket, ask_of())
            except VigilError as error:
                if stop is None:
                    raise
                stop.append(error)
                return state
            state.metadata["record"] = record.model_dump(mode="json")
            state.messages = _dialogue(record)
            state.completed = True
            return state

        return solve

    return vigil_agent()


def _dialogue(record: EpisodeRecord) -> list[ChatMessage]:
    """Returns the episode as Inspect's viewer shows it."""
    messages: list[ChatMessage] = []
    for step in record.steps:
        messages.append(ChatMessageUser(content=frame_stub("past", None)))
        messages.append(ChatMessageAssistant(content=step.reply.text))
    return messages


@scorer(name=f"{_PREFIX}vigil_score", metrics={"*": [grouped(mean(), "family")]})
def vigil_score() -> Scorer:
    """Scores a sample from its record alone, so that `inspect score` can do so again."""

    async def score(state: TaskState, target: Target) -> Score | None:
        if "record" not in state.metadata:
            return None
        record = EpisodeRecord.model_validate(state.metadata["record"])
        if record.end == "error":
            return None
        outcome = settle(Episode.model_validate(state.metadata["episode"]), record)
        value = {"W": float(outcome.W), "W_strict": float(outcome.W_strict), "B": float(outcome.B)}
        value |= {label: float(outcome.label == label) for label in ("FR", "NR", "IL", "Other")}
        return Score(value=dict(value), answer=outcome.reported, explanation=outcome.subtype)

    return score


@task(name=f"{_PREFIX}vigil")
def vigil(
    pack: str = "starter",
    family: Family | None = None,
    profile: str = BASELINE,
    prompt_variant: PromptVariant = "default",
    coordinates: Coordinates | None = None,
    reply_policy: ReplyPolicy = "strict",
    image_format: ImageFormat = "png",
    backend: str = "mujoco",
    workers: int | None = None,
    preflight: bool = True,
) -> Task:
    """A pack as an Inspect task: `inspect eval vigil/vigil --model provider/model -T pack=starter`.

    Inspect's log decides here, with its own epochs, retries and resuming; `vigil run` keeps `episodes.jsonl` instead.
    """
    settings = RunSettings(
        pack=pack,
        model="inspect/model",
        families=(family,) if family else (),
        profile=profile,
        prompt_variant=prompt_variant,
        coordinates=coordinates,
        reply_policy=reply_policy,
        image_format=image_format,
        backend=backend,
        workers=workers,
        preflight=preflight,
    )
    try:
        _, episodes, spec = plan_run(settings)
    except InputError as error:
        raise PrerequisiteError(f"ERROR: {escape(str(error))}") from None  # which Inspect prints without a traceback
    tickets = [Ticket(episode) for episode in episodes]
    metadata = {"pack_sha256": spec.pack_sha256, "prompt_policy_sha256": spec.prompt_policy_sha256}
    return _task(tickets, _agent(tickets, _Guest(settings).play_one, _active_ask), metadata=metadata)


class _Guest:
    """Plays inside an evaluation that Inspect itself has started: simulators are made when first needed.

    Before a model's first episode a call proves that pictures reach it, as `vigil run` does.
    """

    def __init__(self, settings: RunSettings) -> None:
        self._settings = settings
        self._pools: dict[Profile, SimulatorPool] = {}
        self._seeing: set[str] = set()
        self._one_at_a_time = asyncio.Lock()

    async def play_one(self, ticket: Ticket, ask: Ask) -> EpisodeRecord:
        settings = replace(self._settings, model=str(get_model()))
        profile = profile_of(settings)
        await self._prove_sight(get_model())
        if profile not in self._pools:
            plan = worker_plan(settings, Pack.load(settings.pack), profile, run_id="inspect")
            self._pools[profile] = SimulatorPool(plan, settings.workers or usable_cpus())
        record = await play_live(self._pools[profile].live(ticket), profile, ask, "inspect")
        if record.error is not None:
            raise RuntimeError(f"{record.error.boundary}: {record.error.message}")
        return record

    async def _prove_sight(self, model: Model) -> None:
        async with self._one_at_a_time:
            if self._settings.preflight and str(model) not in self._seeing:
                send = sender(model, GenerateConfig(max_retries=0))  # Inspect's own number has no end
                ask = persistent(send, Patience(retries=PREFLIGHT_RETRIES))
                address = without_login(model.api.base_url or "")
                await check_sight(ask, str(model), self._settings.image_format, address)
                self._seeing.add(str(model))


def _active_ask() -> Ask:
    return persistent(sender(get_model()), Patience())
