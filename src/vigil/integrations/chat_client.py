"""Client for a model behind an OpenAI-compatible API, without Inspect.

This client is for frameworks that put a server between an environment and the model. It sends the same messages as
`vigil run`, and the same code decides what counts as a reply and what is retried.
"""

import time
from collections.abc import Sequence
from typing import Any

from openai import APIConnectionError, APIStatusError, AsyncOpenAI

from vigil.agents.conversation import Message
from vigil.protocol.actions import Reply
from vigil.runner.models.ask import TRANSIENT_STATUS, AttemptFailed, Send, is_rejection, parse_answer, reply_from_answer
from vigil.runner.models.provider_errors import error_message_of


def chat_message(message: Message) -> dict[str, Any]:
    """Return a message in the format of the chat completions API."""
    if message.picture is None:
        return {"role": message.role, "content": message.text}
    picture = {"type": "image_url", "image_url": {"url": message.picture.data_uri, "detail": "auto"}}
    return {"role": message.role, "content": [{"type": "text", "text": message.text}, picture]}


def chat_sender(client: AsyncOpenAI, model: str) -> Send:
    """Return a function that sends messages to `model` in one request. The retries of `client` must be turned off.

    The returned function raises AttemptFailed when the request fails.
    """

    async def send(messages: Sequence[Message]) -> Reply:
        started = time.monotonic()
        chat: list[Any] = [chat_message(message) for message in messages]
        try:
            answered = await client.chat.completions.with_raw_response.create(model=model, messages=chat)
        except APIStatusError as error:
            status, message = error.status_code, error_message_of(error.response.content) or error.message
            if is_rejection(status, message):
                raise AttemptFailed(message, is_rejection=True) from error
            can_retry = status in TRANSIENT_STATUS or status >= 500
            raise AttemptFailed(f"HTTP {status}: {message}"[:1000], can_retry=can_retry) from error
        except APIConnectionError as error:
            raise AttemptFailed(f"{error} {error.__cause__ or ''}".strip(), can_retry=True) from error
        answer = parse_answer("chat", answered.http_response.content)
        return reply_from_answer(answer, time.monotonic() - started)

    return send
