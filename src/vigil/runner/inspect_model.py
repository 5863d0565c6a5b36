"""A model through Inspect: how it is reached, and one attempt at one reply."""

import json
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

from inspect_ai._util.error import PrerequisiteError
from inspect_ai.event import ModelEvent
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
from rich.text import Text

from vigil.actions import Reply, Usage
from vigil.agents.agent import REPLY_SECONDS
from vigil.agents.model import Message
from vigil.errors import SettingError
from vigil.profile import ImageFormat
from vigil.runner.ask import ModelTrouble, Patience, Send, is_rejection, persistent
from vigil.runner.preflight import check_sight
from vigil.runner.redaction import without_login, without_secrets
from vigil.runner.redirects import stay
from vigil.runner.serving import KEY_HINT, Serving, provider_hint

PREFLIGHT_RETRIES = 2
_TRANSPORT_ERRORS = (OSError, EOFError, json.JSONDecodeError)


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
            model = get_model(
                self.serving.name,
                config=config,
                base_url=self.serving.base_url,
                api_key=self.serving.api_key,
                memoize=False,
                **dict(self.serving.arguments),
            )
            stay(model.api)
            return model
        except Exception as error:
            hint = provider_hint(self.serving.name)
            raise SettingError(f"Model {self.serving.name!r} cannot be used: {_plain(error)}{hint}") from error

    def shown(self, model: Model) -> Model:
        """Returns what Inspect may log of `model`: the same, with its address and settings as the run header has them.

        It is for the log alone; requests go through `model`.
        """
        api = copy(model.api)
        api.base_url = without_login(api.base_url) if api.base_url else None
        config = GenerateConfig(**without_secrets(self.sampling), max_connections=self.max_connections)
        return Model(api, config, without_secrets(dict(self.serving.arguments)))


def _plain(error: Exception) -> str:
    """Returns in one line what an error says; Inspect marks up those that it means for a terminal."""
    text = Text.from_markup(str(error)).plain if isinstance(error, PrerequisiteError) else str(error)
    lines = [" ".join(line.split()) for line in text.strip().removeprefix("ERROR:").splitlines() if line.strip()]
    return " ".join(line if line[-1] in ".:" else f"{line}." for line in lines)


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
    can_retry = model.should_retry(root) or isinstance(root, _TRANSPORT_ERRORS) or status in (408, 409, 425, 429)
    wait_s = getattr(model.api.should_retry(root), "retry_after", None)
    hint = f". {KEY_HINT}." if status == 401 else ""
    return ModelTrouble(f"{type(root).__name__}: {message}"[:1000] + hint, can_retry=can_retry, wait_s=wait_s)


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
