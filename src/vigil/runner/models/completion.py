"""Completion of one text by a model, for other work than episodes (proposals), with the same client and retries."""

import asyncio
from collections.abc import Callable, Generator
from contextlib import contextmanager

from vigil.agents.conversation import Message
from vigil.runner.models.access import hiding_other_keys, model_access
from vigil.runner.models.ask import RequestRejected, RetryPolicy, with_retries
from vigil.runner.models.redaction import Secrets, redacted_errors


@contextmanager
def open_completion(
    model: str, base_url: str | None, retry_policy: RetryPolicy | None = None, *, api_key_env: str | None = None
) -> Generator[Callable[[str], str], None, None]:
    """Yield a function that returns the model's answer to a text; it is empty when the provider rejects the text.

    The function raises ModelAPIError when the provider fails after all retries. `api_key_env` names the variable with
    the key for an address that is not the provider's. Raises SettingError when the model cannot be used.
    """
    # Inspect takes a second or two to import, and only models need it.
    from vigil.runner.models.inspect_model import Endpoint, sender  # noqa: PLC0415

    found = model_access(model, base_url, {}, api_key_env)
    found.check()
    secrets = Secrets.of(url=found.base_url, key=found.api_key or "")
    with redacted_errors(secrets), hiding_other_keys(found), asyncio.Runner() as runner:
        client = Endpoint(found).model()
        ask = with_retries(sender(client), retry_policy or RetryPolicy())

        async def answer(text: str) -> str:
            try:
                return (await ask([Message("user", text)])).text
            except RequestRejected:
                return ""

        try:
            yield lambda text: runner.run(answer(text))
        finally:
            runner.run(client.api.aclose())
