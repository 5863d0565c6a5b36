"""Completion of one text by a model, for work that is no episode (proposals), through the same client and retries."""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from vigil.agents.model import Message
from vigil.runner.ask import Patience, persistent
from vigil.runner.serving import serving


@contextmanager
def completing(model: str, base_url: str | None, patience: Patience | None = None) -> Iterator[Callable[[str], str]]:
    """Yields the function that answers a text. It raises ModelAPIError when the provider fails for good.

    Raises SettingError when the model cannot be used.
    """
    # Inspect takes a second or two to import, and nothing but a model needs it.
    from vigil.runner.inspect_model import Endpoint, sender  # noqa: PLC0415

    client = Endpoint(serving(model, base_url, {})).model()
    ask = persistent(sender(client), patience or Patience())
    with asyncio.Runner() as runner:

        async def answer(text: str) -> str:
            return (await ask([Message("user", text)])).text

        try:
            yield lambda text: runner.run(answer(text))
        finally:
            runner.run(client.api.aclose())
