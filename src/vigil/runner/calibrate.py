"""Pointing calibration of a model, with the same client, keys and retries as in a run."""

import asyncio

from vigil.runner.models.access import hiding_other_keys
from vigil.runner.models.ask import RetryPolicy, with_retries
from vigil.runner.models.pointing import PointingCalibration, calibrate
from vigil.runner.models.redaction import redacted_errors
from vigil.runner.settings import RunSettings, access_of, sampling_of, secrets_of


def calibrate_model(settings: RunSettings) -> PointingCalibration:
    """Return the pointing calibration of the model of `settings`. Raises SettingError and ModelAPIError."""
    # Inspect takes a second or two to import, and only models need it.
    from vigil.runner.models.inspect_model import Endpoint, sender  # noqa: PLC0415

    found = access_of(settings)
    found.check()
    retry_policy = RetryPolicy(settings.retries, settings.first_wait_s, settings.longest_wait_s)
    endpoint = Endpoint(found, sampling_of(settings), reply_seconds=settings.reply_seconds, retry_policy=retry_policy)

    async def main() -> PointingCalibration:
        model = endpoint.model()
        try:
            return await calibrate(with_retries(sender(model), retry_policy), settings.system_role)
        finally:
            await model.api.aclose()

    with redacted_errors(secrets_of(settings)), hiding_other_keys(found):
        return asyncio.run(main())
