"""The check before a run: do images reach the model, and is its answer to an example observation an action?

Some servers drop images without an error, some send reasoning in forms that are not part of the protocol, and some cut
the answer. A run on such a server would measure the server, not the model. The example is drawn here; it is not from a
pack.
"""

import hashlib
import re

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import encode_frame
from vigil.errors import ModelAPIError
from vigil.protocol.actions import InvalidAction, Reply
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.profile import ImageFormat, Profile
from vigil.protocol.replies import looks_like_other_coordinates, read_reply
from vigil.runner.models.access import KEY_HINT
from vigil.runner.models.ask import Ask, RequestRejected
from vigil.runner.models.context import CONTEXT_ERROR, CONTEXT_OPTIONS, size_hint
from vigil.runner.models.provider_errors import FIND_COORDINATES, hint_for

QUESTION = "What number is written in the picture? Answer with its four digits and nothing else."
FONT_PX = 200
EXAMPLE_INSTRUCTION = "Go to the red box, to within about one and a half metres of it."
SHOWN_CHARS = 300
PASSED = "passed"
_SIGHT_HINT = (
    "Check that the model takes images and that the server passes them on, or skip this check with --no-preflight "
    "(`inspect eval`: -T preflight=false)."
)
_CHECK_NAME_AND_KEY = "Check that it is served there under that name, and check the key in the environment."
_FORCE_HINT = (
    "Fix it, or continue anyway with --force (`inspect eval`: -T force=true): every such reply is then an invalid "
    "action."
)
_UNKNOWN_REASONING = re.compile(
    r"<\|?(?:channel|seed:think|thinking|thought|reasoning|analysis)\b|\[THINK\]", re.IGNORECASE
)
_PARSER_HINT = (
    "Start the server with the reasoning parser of this model (vLLM and SGLang: --reasoning-parser qwen3, deepseek_r1, "
    "kimi_k2 ...; llama.cpp: --reasoning-format deepseek)"
)
_THINKING_HINT = "or turn thinking off with --thinking off (chat template argument enable_thinking=false)"


def number_for(name: str) -> str:
    """Return the four digits that the check asks the model `name` to read."""
    return str(1000 + int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "big") % 9000)


def draw_number(number: str) -> np.ndarray:
    """Return a frame with `number` in the middle, (480, 640, 3) uint8."""
    image = Image.new("RGB", (FRAME_WIDTH, FRAME_HEIGHT), "white")
    middle = (FRAME_WIDTH / 2, FRAME_HEIGHT / 2)
    ImageDraw.Draw(image).text(middle, number, fill="black", font=ImageFont.load_default(FONT_PX), anchor="mm")
    return np.asarray(image)


def draw_example() -> np.ndarray:
    """Return a frame with a wall, a floor and a red box on it, (480, 640, 3) uint8."""
    image = Image.new("RGB", (FRAME_WIDTH, FRAME_HEIGHT), "#d9d4c8")
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, FRAME_HEIGHT // 2, FRAME_WIDTH, FRAME_HEIGHT), fill="#8a6a48")
    draw.rectangle((380, 190, 480, 290), fill="#c01818")
    draw.polygon(((380, 190), (400, 172), (500, 172), (480, 190)), fill="#e04040")
    draw.polygon(((480, 190), (500, 172), (500, 270), (480, 290)), fill="#901010")
    return np.asarray(image)


async def check_model(
    ask: Ask, model: str, profile: Profile, address: str = "", *, force: bool = False
) -> dict[str, str]:
    """Carry out the check and return {part: result}. Raises ModelAPIError when the model fails the check.

    `address` is where the model is served, if known. With `force`, a failure of the example is noted, but does not
    raise.
    """
    await check_sight(ask, model, profile.image_format, address)
    return {"sight": PASSED, "contract": await check_contract(ask, model, profile, force=force)}


async def check_sight(ask: Ask, model: str, image_format: ImageFormat, address: str = "") -> None:
    """Raise ModelAPIError unless the model reads the number in an image; the message names `address` if it is known."""
    number = number_for(model)
    try:
        reply = await ask([Message("user", QUESTION, encode_frame(draw_number(number), image_format))])
    except RequestRejected as error:
        raise ModelAPIError(f"Model {model!r} was sent an image of a number. {error}. {_SIGHT_HINT}") from error
    except ModelAPIError as error:
        where = f" at {address}" if address else ""
        hint = "" if hint_for(str(error)) else f" {_CHECK_NAME_AND_KEY} {KEY_HINT}."
        raise ModelAPIError(
            f"Model {model!r}{where} did not answer the check before the run: {str(error).rstrip('.')}.{hint} "
            "Then repeat the command."
        ) from error
    if number not in re.findall(r"\d+", reply.text.replace(",", "").replace(" ", "")):
        cause = f"images do not seem to reach the model, or it cannot read numbers in them. {_SIGHT_HINT}"
        invalid = read_reply(reply).invalid
        if invalid is not None and (invalid.reason == "truncated" or (invalid.reason == "empty" and invalid.detail)):
            cause = f"{invalid.detail}. {advice(invalid, reply)}"
        raise ModelAPIError(
            f"Model {model!r} was sent an image of the number {number} and answered {reply.text[:200]!r}: {cause}"
        )


async def check_contract(ask: Ask, model: str, profile: Profile, *, force: bool = False) -> str:
    """Return `PASSED` if the first or second answer to an example observation is an action.

    Otherwise raise ModelAPIError, or with `force` return how the second answer failed.
    """
    reply, invalid = await _try_example(ask, model, profile)
    if invalid is not None:
        reply, invalid = await _try_example(ask, model, profile)
    if invalid is None:
        return PASSED
    what, half = f"{invalid.reason} {invalid.detail}".strip(), SHOWN_CHARS // 2
    if force:
        return f"failed: {what}"
    excerpt = reply.text if len(reply.text) <= SHOWN_CHARS else f"{reply.text[:half]} ... {reply.text[-half:]}"
    raise ModelAPIError(
        f"Model {model!r} was asked for an action in an example observation, but its answer is not an action ({what}; "
        f"finish reason {reply.finish_reason}, {reply.reasoning_chars} characters of reasoning): "
        f"{excerpt!r}. {advice(invalid, reply)} {_FORCE_HINT}"
    )


async def _try_example(ask: Ask, model: str, profile: Profile) -> tuple[Reply, InvalidAction | None]:
    """Return the reply to the example, and why it is not an action (None if it is an action). Raises ModelAPIError."""
    picture = encode_frame(draw_example(), profile.image_format)
    messages = Conversation(profile, EXAMPLE_INSTRUCTION).messages(picture, None)
    try:
        reply = await ask(messages)
    except RequestRejected as error:
        hint = f" {size_hint(messages, profile)}" if CONTEXT_ERROR.search(str(error)) else ""
        raise ModelAPIError(f"Model {model!r} was asked about an example observation. {error}.{hint}") from error
    return reply, read_reply(reply, profile).invalid


def advice(invalid: InvalidAction, reply: Reply) -> str:
    """Return a sentence that says what may help against an invalid reply."""
    if invalid.reason == "truncated":
        usage = reply.usage
        after = f" after {usage.output_tokens:,} tokens, {usage.input_tokens:,} of input before it" if usage else ""
        return (
            f"The token limit cut it{after}: give a larger --max-tokens, a larger context to the server "
            f"({CONTEXT_OPTIONS}), {_THINKING_HINT}."
        )
    if invalid.reason == "unclosed_reasoning" or (invalid.reason == "empty" and reply.reasoning_chars):
        return f"{_PARSER_HINT}, {_THINKING_HINT}."
    if _UNKNOWN_REASONING.search(reply.text):
        return (
            f"It seems to begin with reasoning in a form that is not part of the protocol. {_PARSER_HINT}, "
            f"{_THINKING_HINT}."
        )
    if reply.tool_call is not None and invalid.reason == "empty":
        return (
            "The server sent a tool call instead of text, although no tools are offered: start it without its tool "
            "parser (vLLM: without --enable-auto-tool-choice and --tool-call-parser)."
        )
    if looks_like_other_coordinates(invalid):
        return f"It uses other coordinates than it was asked for. {FIND_COORDINATES}"
    if invalid.kind == "malformed_action":
        return "It is one JSON object, but not an action of the schema. `vigil prompt` shows the model's prompt."
    if invalid.would_parse_leniently:
        return (
            "Without the text or code fence around it, it would be an action: --reply-policy lenient accepts it, as a "
            "separate variant of the run."
        )
    return (
        "Check that the server's chat template passes on the system prompt (`vigil prompt` shows it), and that the "
        "model follows instructions."
    )
