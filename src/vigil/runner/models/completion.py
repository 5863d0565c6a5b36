"""Use of a model outside of a run: to complete a text (for proposals of tasks), or to calibrate its pointing."""

import asyncio
from collections.abc import Callable, Generator
from contextlib import contextmanager

from vigil.agents.conversation import Message
from vigil.protocol.profile import SystemRole
from vigil.runner.models.access import Endpoint, hiding_other_keys
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.models.pointing import PointingCalibration, calibrate_pointing
from vigil.runner.models.redaction import Secrets, redacted_errors


@contextmanager
def open_completion(endpoint: Endpoint) -> Generator[Callable[[str], str], None, None]:
    """Yield a function that returns the model's answer to a text, or an empty text if the provider rejects it.

    The function raises ModelAPIError when the provider fails after all retries. Raises SettingError when the model
    cannot be used.
    """
    with _asking(endpoint) as (ask, runner):

        async def answer(text: str) -> str:
            try:
                return (await ask([Message("user", text)])).text
            except RequestRejected:
                return ""

        yield lambda text: runner.run(answer(text))


def calibrate_model(endpoint: Endpoint, system_role: SystemRole) -> PointingCalibration:
    """Return the pointing calibration of a model. Raises SettingError and ModelAPIError."""
    with _asking(endpoint) as (ask, runner):
        return runner.run(calibrate_pointing(ask, system_role))


@contextmanager
def _asking(endpoint: Endpoint) -> Generator[tuple[Ask, asyncio.Runner], None, None]:
    """Yield a function that asks the model, and the event loop in which this function runs."""
    # Inspect takes a second or two to import, and only models need it.
    from vigil.runner.models.inspect_model import ModelClient  # noqa: PLC0415 - loads Inspect

    access = endpoint.access
    access.check()
    secrets = Secrets.of(url=access.base_url, key=access.api_key or "")
    with redacted_errors(secrets), hiding_other_keys(access), asyncio.Runner() as runner:
        client = ModelClient(endpoint)
        try:
            yield client.ask, runner
        finally:
            runner.run(client.model.api.aclose())
