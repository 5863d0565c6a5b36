"""Checks of what a trainer gets, before the training (`vigil train doctor`).

One group plays an episode through the chosen integration with fixed replies. The texts, frames and reward that the
trainer gets are then compared with the record. If a model's processor is given, the pictures that it makes of the
frames are also decoded and compared with the frames.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image

from vigil.agents.conversation import Conversation, Message
from vigil.agents.frame_encoding import decode_frame, encode_frame
from vigil.env import Env
from vigil.errors import RecordError, SettingError
from vigil.integrations.sources import SampledEpisode
from vigil.integrations.trl import Episodes, VigilReplies, protocol_processor, valid_replies
from vigil.protocol.profile import Profile
from vigil.records.record import EpisodeRecord
from vigil.sim.protocol import Simulator

REPLIES = (
    json.dumps({"skill_name": "navigate", "arguments": {"mode": "turn_left", "magnitude": 45}}),
    "I turn right.",
    json.dumps({"skill_name": "look", "arguments": {"direction": "down", "magnitude": 20}}),
    json.dumps({"skill_name": "report", "arguments": {"status": "fail", "summary": ""}}),
)
"""Replies of each member of the group: two actions, an invalid reply between them, and a report."""
MAX_PICTURE_ERROR = 0.04
"""Maximum mean difference of a decoded picture from its frame, as a share of the range of a pixel. Resizing causes a
small difference."""


@dataclass(frozen=True, slots=True)
class CheckResult:
    """Result of one check."""

    check: str
    is_right: bool
    detail: str


@dataclass(frozen=True, slots=True)
class Seen:
    """What one member of the group saw, in the form that the trainer gets."""

    frames: list[np.ndarray]
    texts: list[str]
    """Text next to each frame; empty if the integration gives only frames."""
    reward: float
    record: EpisodeRecord


def examine_trl(options: dict[str, Any], group: int, processor: Any = None) -> Iterator[CheckResult]:
    """Yield the findings about a group of TRL environments. Raises SettingError or SimulatorError.

    `processor` is the processor of the model to train; with None, tokens and their pictures are not checked.
    """
    episodes = Episodes(**{"limit": 1, **options, "actions": "text"})
    try:
        row, members = episodes.rows()[0], [episodes.environment() for _ in range(group)]
        played = [_played_by(member, row) for member in members]
        first, now, condition = played[0], members[0].episode, episodes.options.condition
        yield from _examine_group(played, now, condition, episodes.options.make_simulator)
        conversation = list(_messages(first, now, condition))
        shown = [message.text for message in conversation if message.role == "user"]
        yield same("texts next to frames", first.texts, shown)
        prompt = row["prompt"][0]["content"][0]["text"]
        yield same("system prompt", [prompt], [conversation[0].text])
        if processor is not None:
            yield from _examine_processor(processor, first, conversation)
    finally:
        episodes.close()


def examine_gymnasium(options: dict[str, Any], group: int) -> Iterator[CheckResult]:
    """Yield the findings about a group of Gymnasium environments. Raises SettingError or SimulatorError."""
    from vigil.integrations.gymnasium import VigilEnv  # noqa: PLC0415 - needs the extra `gymnasium`

    played, env = list[Seen](), VigilEnv(**options)
    try:
        observation, _ = env.reset(seed=0)
        for member in range(group):
            if member:
                observation, _ = env.reset(options={"episode_id": env._now.episode.id})
            frames, reward = list[np.ndarray](), 0.0
            for reply in REPLIES:
                frames.append(observation["frame"])
                observation, reward, *_ = env.step(reply)
            played.append(Seen(frames, [], float(reward), env._env.record()))
        yield from _examine_group(played, env._now, env._options.condition, env._options.make_simulator)
    finally:
        env.close()


def _played_by(member: Any, row: dict[str, Any]) -> Seen:
    assert isinstance(member, VigilReplies)
    contents = [member.reset(**row), *(member.reply(reply) for reply in REPLIES[:-1])]
    valid_replies([[{"role": "assistant", "content": REPLIES[-1]}]], [member])
    record, reward = member.record, member.get_reward()
    if record is None or reward is None:
        raise SettingError(
            "The check cannot continue: the episode did not end after its report, or the simulator failed."
        )
    frames = [np.asarray(content[1]["image"]) for content in contents]
    return Seen(frames, [content[0]["text"] for content in contents], reward, record)


def _examine_group(
    played: Sequence[Seen], now: SampledEpisode, condition: Profile, simulator: Callable[[], Simulator]
) -> Iterator[CheckResult]:
    first, ids = played[0], {seen.record.episode_id for seen in played}
    yield CheckResult("group plays one episode", ids == {now.episode.id}, f"{len(played)} members, {len(ids)} episodes")
    hashes = [[hashlib.sha256(frame.tobytes()).hexdigest() for frame in seen.frames] for seen in played]
    recorded = [[step.frame_sha256 for step in seen.record.steps] for seen in played]
    yield CheckResult(
        "frames are those of the record", hashes == recorded, f"{len(first.frames)} frames for each member"
    )
    yield CheckResult("members see the same frames", all(each == hashes[0] for each in hashes), "")
    yield same("replies", [step.reply.text for step in first.record.steps], list(REPLIES))
    with Env(simulator(), lambda _: now.house, condition) as env:
        fault = ""
        try:
            env.reset(now.episode)
            for step in first.record.steps:
                env.replay(step)
        except RecordError as error:
            fault = str(error)
        detail = fault or f"{len(first.record.steps)} steps"
        yield CheckResult("record repeats on a new simulator", not fault, detail)
    rewards = [seen.reward for seen in played]
    yield CheckResult("rewards are equal", len(set(rewards)) == 1, ", ".join(f"{reward:g}" for reward in rewards))


def _messages(seen: Seen, now: SampledEpisode, condition: Profile) -> Iterator[Message]:
    """Yield the messages of the last request that a run with these frames and replies sends, and the last reply."""
    conversation = Conversation(condition, now.episode.instruction)
    pictures = [encode_frame(frame) for frame in seen.frames]
    for picture, reply in zip(pictures[:-1], REPLIES, strict=False):
        conversation.add(None, reply, picture=picture)
    yield from conversation.messages(pictures[-1], None)
    yield Message("assistant", REPLIES[-1])


def _examine_processor(processor: Any, seen: Seen, conversation: Sequence[Message]) -> Iterator[CheckResult]:
    """Compare the tokens of the rollout with those of a run's request, and the decoded pictures with the frames."""
    plain = [{"role": message.role, "content": _parts(message)} for message in conversation]
    wanted = processor.apply_chat_template(plain)
    changed = protocol_processor(processor)
    calls = [_as_call(message) if message["role"] == "assistant" else message for message in plain[:-1]]
    tools = [{**message, "role": "tool", "name": "reply"} if index > 1 and message["role"] == "user" else message
             for index, message in enumerate(calls)]  # fmt: skip
    yield same("text of the conversation", [changed.apply_chat_template([*tools, plain[-1]])], [wanted])
    batch = changed.apply_chat_template(plain, tokenize=True, return_dict=True, return_tensors="np")
    if "image_grid_thw" not in batch:
        why = "this processor's pictures are not in the layout of Qwen-VL, the only one that is supported"
        yield CheckResult("pictures", False, why)
        return
    decoded = decode_patches(changed.image_processor, batch["pixel_values"], batch["image_grid_thw"])
    yield CheckResult("pictures arrive", len(decoded) == len(seen.frames), f"{len(decoded)} of {len(seen.frames)}")
    errors = np.array([[_distance(picture, frame) for frame in seen.frames] for picture in decoded])
    (height, width), worst = decoded[0].shape[:2], float(errors.diagonal().max())
    nearest = errors.argmin(axis=1).tolist() == list(range(len(decoded))) and worst < MAX_PICTURE_ERROR
    detail = f"{width} x {height} pixels, error at most {worst:.3f}"
    yield CheckResult("pictures are the frames, in order", nearest, detail)


def _parts(message: Message) -> list[dict[str, Any]]:
    text: list[dict[str, Any]] = [{"type": "text", "text": message.text}]
    if message.picture is None:
        return text
    return [*text, {"type": "image", "image": Image.fromarray(decode_frame(message.picture.data))}]


def _as_call(message: dict[str, Any]) -> dict[str, Any]:
    arguments = {"text": message["content"][0]["text"]}
    call = {"type": "function", "function": {"name": "reply", "arguments": arguments}}
    return {"role": "assistant", "content": [], "tool_calls": [call]}


def decode_patches(image_processor: Any, patches: np.ndarray, grids: np.ndarray) -> list[np.ndarray]:
    """Return the pictures (h, w, 3), with values from 0 to 1, that patches in Qwen-VL's layout contain.

    `grids` has (t, rows, columns) of each picture.
    """
    size, merged = image_processor.patch_size, image_processor.merge_size
    mean, std = (np.asarray(each)[:, None, None] for each in (image_processor.image_mean, image_processor.image_std))
    found, start = [], 0
    for t, rows, columns in np.asarray(grids).tolist():
        part = np.asarray(patches)[start : start + t * rows * columns]
        start += len(part)
        blocks = part.reshape(t, rows // merged, columns // merged, merged, merged, 3, -1, size, size)
        picture = blocks.transpose(0, 6, 5, 1, 3, 7, 2, 4, 8).reshape(-1, 3, rows * size, columns * size)[0]
        found.append((picture * std + mean).transpose(1, 2, 0))
    return found


def _distance(picture: np.ndarray, frame: np.ndarray) -> float:
    size = (picture.shape[1], picture.shape[0])
    resized = np.asarray(Image.fromarray(frame).resize(size, Image.Resampling.BICUBIC), np.float64) / 255
    return float(np.abs(picture - resized).mean())


def same(check: str, found: Sequence[str], wanted: Sequence[str]) -> CheckResult:
    """Return the finding whether two lists of texts are equal, with the first difference."""
    if list(found) == list(wanted):
        return CheckResult(check, True, f"{len(found)} equal")
    pairs = [(f, w) for f, w in zip(found, wanted, strict=False) if f != w]
    detail = (
        f"{pairs[0][0][:80]!r} instead of {pairs[0][1][:80]!r}" if pairs else f"{len(found)} instead of {len(wanted)}"
    )
    return CheckResult(check, False, detail)
