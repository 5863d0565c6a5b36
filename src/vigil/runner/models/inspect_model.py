"""A model through Inspect: how it is reached, and one attempt at one reply."""

import json
import time
from collections.abc import Sequence
from copy import copy
from dataclasses import replace

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
    get_model,
)
from inspect_ai.model._model import use_model_event_sink
from inspect_ai.util import LimitExceededError
from rich.text import Text

from vigil.agents.conversation import Message
from vigil.errors import SettingError
from vigil.protocol.actions import Reply, Usage
from vigil.protocol.profile import Profile
from vigil.runner.models.access import KEY_HINT, Endpoint, ModelAccess
from vigil.runner.models.ask import (
    TRANSIENT_STATUS,
    Ask,
    AttemptFailed,
    Send,
    check_ending,
    is_rejection,
    parse_answer,
    reply_from_answer,
    with_retries,
)
from vigil.runner.models.identity_log import ModelIdentityLog
from vigil.runner.models.network import disable_redirects, proxy_note
from vigil.runner.models.preflight import check_model
from vigil.runner.models.provider_errors import error_message_of, hint_for
from vigil.runner.models.providers import provider_hint
from vigil.runner.models.redaction import without_login, without_secrets
from vigil.runner.models.response_capture import Exchange, capture_exchanges

PREFLIGHT_RETRIES = 2
"""Maximum number of retries of a request in the check before a run."""
_TRANSPORT_ERRORS = (OSError, EOFError, json.JSONDecodeError)
_HTTP_LIBRARIES = frozenset({"httpx", "httpx2", "aiohttp"})
"""Libraries whose exceptions count as failures of transport."""


class ModelClient:
    """Client of a model, which retries failed requests. The end of its `async with` block closes its connections."""

    def __init__(self, endpoint: Endpoint, identity_log: ModelIdentityLog | None = None) -> None:
        """Each answer is added to `identity_log`. Raises SettingError when the provider cannot be used."""
        self.endpoint = endpoint
        self.model = new_model(endpoint)
        self.ask = self.asking(identity_log)

    def asking(self, identity_log: ModelIdentityLog | None) -> Ask:
        """Return a function that asks the model, and adds each answer to `identity_log`."""
        send = sender(self.model, identity_log=identity_log, keep_reasoning=self.endpoint.keep_reasoning)
        return with_retries(send, self.endpoint.retry_policy)

    async def __aenter__(self) -> "ModelClient":
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.model.api.aclose()

    def loggable_model(self) -> Model:
        """Return a copy of the model for Inspect's log, without secrets in its address and settings.

        The copy is only for the log; requests go through `ask`.
        """
        api = copy(self.model.api)
        api.base_url = without_login(api.base_url) if api.base_url else None
        endpoint = self.endpoint
        config = GenerateConfig(**without_secrets(endpoint.sampling), max_connections=endpoint.max_connections)
        return Model(api, config, without_secrets(dict(endpoint.access.arguments)))


def new_model(endpoint: Endpoint) -> Model:
    """Return a new Inspect model for `endpoint`. Raises SettingError when the provider cannot be used."""
    access = endpoint.access
    try:
        config = GenerateConfig(
            **endpoint.sampling,
            max_connections=endpoint.max_connections,
            max_retries=0,
            attempt_timeout=endpoint.reply_seconds,
        )
        model = model_at(access, config)
        disable_redirects(model.api)
        return model
    except Exception as error:
        hint = provider_hint(access.name)
        raise SettingError(f"Model {access.display_name!r} cannot be used: {_plain(error)}{hint}") from error


def model_at(access: ModelAccess, config: GenerateConfig) -> Model:
    """Return a new Inspect model for `access`. The model is not shared with other callers."""
    return get_model(
        access.name,
        config=config,
        base_url=access.base_url,
        api_key=access.api_key,
        memoize=False,
        **dict(access.arguments),
    )


def _plain(error: Exception) -> str:
    """Return an error's message in one line, without the markup of Inspect's errors for a terminal."""
    text = Text.from_markup(str(error)).plain if isinstance(error, PrerequisiteError) else str(error)
    lines = [" ".join(line.split()) for line in text.strip().removeprefix("ERROR:").splitlines() if line.strip()]
    return " ".join(line if line[-1] in ".:" else f"{line}." for line in lines)


class _EventSink:
    """Sink that drops Inspect's model events, because they would keep every frame in memory."""

    def on_pending(self, event: ModelEvent) -> None:
        """Drop the event of a request that begins."""

    def on_complete(self, event: ModelEvent) -> None:
        """Drop the event of a request that has ended."""


def sender(
    model: Model,
    config: GenerateConfig | None = None,
    identity_log: ModelIdentityLog | None = None,
    *,
    keep_reasoning: bool = False,
) -> Send:
    """Return a function that sends messages to `model` once; `config` overrides the model's own config.

    The function adds each answer to `identity_log`. It returns the text that the server sent if this was captured, and
    otherwise the library's text; `reply_source` says which. It raises AttemptFailed.
    """
    config = config or GenerateConfig()
    identity_log = identity_log or ModelIdentityLog()

    async def send(messages: Sequence[Message]) -> Reply:
        with capture_exchanges(model.api) as exchanges:
            try:
                with use_model_event_sink(_EventSink()):
                    output = await model.generate([_chat_message(message) for message in messages], config=config)
            except LimitExceededError:
                raise
            except Exception as error:
                if not _is_answered(exchanges):
                    raise _attempt_failure(model, error, exchanges) from error
                output = None
        if output is not None and not _is_answered(exchanges):
            reply = _library_reply(output, keep_reasoning=keep_reasoning)
            identity_log.note(reply, output.model, without_login(model.api.base_url or ""))
            return reply
        last = exchanges[-1]
        answer = parse_answer(last.wire, bytes(last.body))
        seconds = output.time if output and output.time else time.monotonic() - last.started
        reply = reply_from_answer(answer, seconds, keep_reasoning=keep_reasoning)
        identity_log.note(reply, answer.model, last.address)
        return reply

    return send


def _is_answered(exchanges: Sequence[Exchange]) -> bool:
    """Return whether the server answered without an error. Its answer then counts even if a library failed on it."""
    return bool(exchanges) and exchanges[-1].status in range(200, 300)


def _chat_message(message: Message) -> ChatMessage:
    if message.role == "system":
        return ChatMessageSystem(content=message.text)
    if message.role == "assistant":
        return ChatMessageAssistant(content=message.text)
    if message.picture is None:
        return ChatMessageUser(content=message.text)
    content: list[Content] = [ContentText(text=message.text), ContentImage(image=message.picture.data_uri)]
    if message.question is not None:
        content.append(ContentText(text=message.question))
    return ChatMessageUser(content=content)


def _attempt_failure(model: Model, error: Exception, exchanges: Sequence[Exchange]) -> AttemptFailed:
    cause = error.__cause__ if type(error).__name__ == "RetryError" else None
    root = cause if isinstance(cause, Exception) else error
    last = exchanges[-1] if exchanges else None
    status = last.status if last is not None and last.status else getattr(root, "status_code", None)
    if last is not None and last.status and last.body:
        said, message = f"HTTP {status}", error_message_of(bytes(last.body))
    else:
        said = type(root).__name__
        message = getattr(root, "provider_message", None) or _with_causes(root) or said
    if is_rejection(status, message):
        return AttemptFailed(message, is_rejection=True)
    library = type(root).__module__.partition(".")[0]
    is_transport = isinstance(root, _TRANSPORT_ERRORS) or library in _HTTP_LIBRARIES
    is_passing = status in TRANSIENT_STATUS or (isinstance(status, int) and 300 <= status < 400)
    can_retry = (model.should_retry(root) or is_transport or is_passing) and hint_for(message) is None
    wait_s = getattr(model.api.should_retry(root), "retry_after", None)
    hint = f". {KEY_HINT}." if status == 401 else ""
    proxy = proxy_note(model.api.base_url or "") if status is None else ""
    hint = f"{hint} ({proxy})" if proxy else hint
    return AttemptFailed(f"{said}: {message}"[:1000] + hint, can_retry=can_retry, wait_s=wait_s)


def _with_causes(error: BaseException) -> str:
    """Return the messages of an error and its causes, because a connection error alone says little."""
    said: list[str] = []
    cause: BaseException | None = error
    while cause is not None and len(said) < 5:
        said += [text] if (text := str(cause)) and not any(text in before for before in said) else []
        cause = cause.__cause__ or cause.__context__
    return ": ".join(text.rstrip(".") for text in said)


def _library_reply(output: ModelOutput, *, keep_reasoning: bool) -> Reply:
    """Return the reply from Inspect's output. Raises AttemptFailed."""
    if output.empty:
        raise AttemptFailed("The provider's answer does not have a reply.", can_retry=True)
    is_refused_request = output.stop_reason == "model_length" and output.usage is None
    if is_refused_request:
        raise AttemptFailed(output.completion, is_rejection=True)
    usage, used = output.usage, None
    if usage is not None:
        cached = (usage.input_tokens_cache_read or 0) + (usage.input_tokens_cache_write or 0)
        used = Usage(input_tokens=usage.input_tokens + cached, output_tokens=usage.output_tokens)
    tool_call = next((call.function for call in output.message.tool_calls or ()), None)
    check_ending(output.stop_reason, output.completion, tool_call)
    parts = output.message.content
    reasoning = [] if isinstance(parts, str) else [part for part in parts if isinstance(part, ContentReasoning)]
    return Reply(
        text=output.completion,
        reply_source="library",
        finish_reason=output.stop_reason,
        tool_call=tool_call,
        reasoning_chars=sum(len(part.reasoning) for part in reasoning),
        reasoning="".join(part.reasoning for part in reasoning) if keep_reasoning else "",
        usage=used,
        seconds=output.time or 0.0,
    )


async def preflight(
    endpoint: Endpoint, identity_log: ModelIdentityLog, name: str, profile: Profile, *, force: bool = False
) -> None:
    """Carry out the check before a run (`vigil.runner.models.preflight`), and log its results.

    Raises ModelAPIError when the model fails the check.
    """
    retries = min(endpoint.retry_policy.retries, PREFLIGHT_RETRIES)
    endpoint = replace(endpoint, retry_policy=replace(endpoint.retry_policy, retries=retries))
    async with ModelClient(endpoint, identity_log) as client:
        address = without_login(endpoint.access.base_url or "")
        identity_log.check = await check_model(client.ask, name, profile, address, force=force)
