"""One call before a run that proves that pictures reach the model: it must read a number off a generated picture.

Some servers drop images without a word; a run against such a server would measure a blind model.
"""

import hashlib
import re

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.agents.model import Message
from vigil.agents.picture import encode
from vigil.errors import ModelAPIError
from vigil.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.profile import ImageFormat
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.models.serving import KEY_HINT

QUESTION = "What number is written in the picture? Answer with its four digits and nothing else."
FONT_PX = 200


def number_for(name: str) -> str:
    """Returns the four digits that `name` (of a model) is asked to read."""
    return str(1000 + int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "big") % 9000)


def draw_number(number: str) -> np.ndarray:
    """Returns a frame with `number` in the middle, (480, 640, 3) uint8."""
    image = Image.new("RGB", (FRAME_WIDTH, FRAME_HEIGHT), "white")
    middle = (FRAME_WIDTH / 2, FRAME_HEIGHT / 2)
    ImageDraw.Draw(image).text(middle, number, fill="black", font=ImageFont.load_default(FONT_PX), anchor="mm")
    return np.asarray(image)


_WHAT_TO_DO = (
    "Check that the model takes images and that the server passes them on, or skip this check with --no-preflight "
    "(`inspect eval`: -T preflight=false)."
)


async def check_sight(ask: Ask, model: str, image_format: ImageFormat, address: str = "") -> None:
    """Raises ModelAPIError unless the model, served at `address` if that is known, reads the number in a picture."""
    number = number_for(model)
    try:
        reply = await ask([Message("user", QUESTION, encode(draw_number(number), image_format))])
    except RequestRejected as error:
        raise ModelAPIError(f"Model {model!r} was shown a picture of a number. {error}. {_WHAT_TO_DO}") from error
    except ModelAPIError as error:
        where = f" at {address}" if address else ""
        raise ModelAPIError(
            f"Model {model!r}{where} did not answer the call before the run: {error}. Check that it is served there "
            f"under that name, and the key in the environment. {KEY_HINT}. Then give the same command again."
        ) from error
    if number not in re.findall(r"\d+", reply.text.replace(",", "").replace(" ", "")):
        raise ModelAPIError(
            f"Model {model!r} was shown a picture of the number {number} and answered {reply.text[:200]!r}: pictures "
            f"do not seem to reach it, or it cannot read. {_WHAT_TO_DO}"
        )
