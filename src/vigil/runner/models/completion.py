"""Use of a model outside of a run: to complete a text (for proposals of tasks), or to calibrate its pointing.

A calibration shows frames with a marked spot, and finds the coordinate convention that fits the model's answers. The
question asks for pixels, as the prompt of a run does. A model that was trained to answer in a grid of 0 to 1000 may
nevertheless answer in this grid.
"""

import asyncio
import re
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import encode_frame
from vigil.protocol.actions import Coordinates
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import Profile, SystemRole
from vigil.protocol.reasoning import split_reasoning
from vigil.runner.models.access import Endpoint, hiding_other_keys
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.models.redaction import Secrets, redacted_errors

INSTRUCTION = "Point at the centre of the magenta disc."
RADIUS_PX = 12
"""Radius of the disc that marks a spot."""
MAX_MEDIAN_ERROR_PX = 32.0
"""Maximum median error of a convention that fits. At these spots, a wrong convention has an error of 200 px or more."""


class FramePoint(NamedTuple):
    """A point in a frame (pixels), or a point from an answer in any units."""

    x: float
    y: float


SPOTS = (
    *(FramePoint(560, 60), FramePoint(600, 420), FramePoint(320, 400), FramePoint(120, 440)),
    *(FramePoint(500, 240), FramePoint(620, 200), FramePoint(260, 330), FramePoint(400, 450)),
)
"""Spots that are marked. They are not near the top left corner, where the conventions give similar points."""
CONVENTIONS: Mapping[str, FramePoint] = {
    "pixel": FramePoint(1.0, 1.0),
    "normalized_1000": FramePoint(FRAME_WIDTH / 1000, FRAME_HEIGHT / 1000),
    "fractions of 0 to 1": FramePoint(FRAME_WIDTH, FRAME_HEIGHT),
}
"""Convention -> factors for x and y that convert an answer to pixels."""
_NUMBER = r"""["']?{}["']?\s*[:=]\s*(-?\d+(?:\.\d+)?)"""
_X, _Y = (re.compile(_NUMBER.format(axis)) for axis in "xy")


@dataclass(frozen=True, slots=True)
class PointingCalibration:
    """A model's answers to the frames with a marked spot."""

    answers: tuple[FramePoint | None, ...]
    """Point in the answer to each of `SPOTS`; None where the answer does not have a point."""

    @property
    def answered(self) -> int:
        """Number of answers with a point."""
        return sum(answer is not None for answer in self.answers)

    def errors(self, convention: str) -> list[float]:
        """Return the errors (pixels) of the answers that have a point, if they are read in `convention`."""
        scale = CONVENTIONS[convention]
        pairs = [(spot, answer) for spot, answer in zip(SPOTS, self.answers, strict=True) if answer is not None]
        return [float(np.hypot(answer.x * scale.x - spot.x, answer.y * scale.y - spot.y)) for spot, answer in pairs]

    @property
    def medians(self) -> dict[str, float]:
        """Median error (pixels) by convention; empty when no answer had a point."""
        return {name: median(self.errors(name)) for name in CONVENTIONS} if self.answered else {}

    @property
    def best(self) -> str | None:
        """Convention that fits best; None when none fits."""
        medians = self.medians
        name = min(medians, key=medians.__getitem__, default=None)
        return name if name is not None and medians[name] <= MAX_MEDIAN_ERROR_PX else None

    @property
    def coordinates(self) -> Coordinates | None:
        """Coordinate system for runs of the model; None when none fits."""
        return next((mode for mode in ("pixel", "normalized_1000") if mode == self.best), None)


def draw_spot(spot: FramePoint) -> np.ndarray:
    """Return a frame with a wall, a floor and a magenta disc, (480, 640, 3) uint8."""
    image = Image.new("RGB", (FRAME_WIDTH, FRAME_HEIGHT), "#cfd3d6")
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, FRAME_HEIGHT // 2, FRAME_WIDTH, FRAME_HEIGHT), fill="#7a6a58")
    draw.ellipse((spot.x - RADIUS_PX, spot.y - RADIUS_PX, spot.x + RADIUS_PX, spot.y + RADIUS_PX), fill="#ff00d0")
    return np.asarray(image)


def pointing_messages(spot: FramePoint, system_role: SystemRole = "system") -> Sequence[Message]:
    """Return the messages that ask a model for the position of a spot."""
    return Conversation(Profile(system_role=system_role), INSTRUCTION).messages(
        encode_frame(draw_spot(spot), "png"), None
    )


def point_in(text: str) -> FramePoint | None:
    """Return the first x and y in an answer, or None."""
    answer = split_reasoning(text)[0]
    x, y = _X.search(answer), _Y.search(answer)
    return FramePoint(float(x[1]), float(y[1])) if x and y else None


async def calibrate_pointing(ask: Ask, system_role: SystemRole = "system") -> PointingCalibration:
    """Ask a model for all spots and return its answers. Raises ModelAPIError."""
    return PointingCalibration(
        tuple([point_in((await ask(pointing_messages(spot, system_role))).text) for spot in SPOTS])
    )


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
