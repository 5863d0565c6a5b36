"""Nothing hidden reaches a model: an episode full of words and numbers that occur nowhere else is played against a real
server, all that goes out is captured, and none of them is in it.
"""

import base64
import json
import re
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.chat_server import LOOK, REPORT, ChatAnswer, ChatRequest, serving
from tests.support.inspect_marks import INSPECT
from tests.support.tiny_pack import loose_pack, tiny_episode, tiny_house
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.episode import Provenance
from vigil.protocol.profile import ACTION_FEEDBACK, BASELINE
from vigil.records.record import EpisodeRecord
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings

pytestmark = INSPECT
TARGET, CHILD = "Fridge|zyxcanary|417", "Mug|qwvcanary|418"
MAX_STEPS, MAX_INVALID = 83, 61
START = Pose(position=Vec3(2.51713, 0.0, 1.03731), rotation=7.1373, horizon=29.7317)
HIDDEN_WORDS = [
    "zyxcanary",
    "qwvcanary",
    "canary",
    "plumcanaryhouse",
    "AI",
    "is_open",
    "object_state",
    "expected",
    "budget",
    "max_steps",
    "reveal_nothing",
    "secretauthor",
    "box_distance",
    "Fridge|",
    "Mug|",
]


def replies(asked: ChatRequest) -> ChatAnswer:
    script = [
        LOOK,
        "prose that is no action",
        '{"skill_name": "interact_pixel", "arguments": {"intent": "open", "x": 320, "y": 200}}',
        '{"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 1}}',
        '{"skill_name": "navigate", "arguments": {"mode": "turn_right", "magnitude": 45}}',
    ]
    return ChatAnswer(REPORT if asked.turn > 20 else script[asked.turn % len(script)])


def numbers_of(value: object) -> Iterator[float]:
    """Yield every number in a record's hidden parts."""
    if isinstance(value, dict):
        for item in value.values():
            yield from numbers_of(item)
    elif isinstance(value, list):
        for item in value:
            yield from numbers_of(item)
    elif isinstance(value, float):
        yield value


def hidden_numbers(record: EpisodeRecord) -> set[str]:
    """Return the numbers of all worlds and effects as texts, except those with few digits, which are common."""
    facts = record.model_dump(mode="json")
    hidden = [
        facts["initial"],
        *(step["world"] for step in facts["steps"]),
        *(step["effect"] for step in facts["steps"]),
    ]
    found = {f"{number:.{digits}f}" for number in numbers_of(hidden) for digits in (3, 4)}
    return {text for text in found if len(text.rstrip("0").partition(".")[2]) >= 3} | {str(MAX_STEPS), str(MAX_INVALID)}


def text_in(raw: bytes) -> str:
    """Return a request without the bytes of its pictures, but with all text chunks of their files."""
    pictures = re.findall(rb"base64,([A-Za-z0-9+/=]+)", raw)
    plain = re.sub(rb"base64,[A-Za-z0-9+/=]+", b"base64,", raw).decode()
    return plain + "".join(text_of_png(base64.b64decode(picture)) for picture in pictures)


def text_of_png(data: bytes) -> str:
    """Return everything that a PNG file holds except its pixels."""
    assert data.startswith(b"\x89PNG")
    found, place = "", 8
    while place < len(data):
        size, kind = int.from_bytes(data[place : place + 4], "big"), data[place + 4 : place + 8]
        if kind not in (b"IHDR", b"IDAT", b"IEND"):
            found += f"{kind!r} {data[place + 8 : place + 8 + size]!r}"
        place += size + 12
    return found


@pytest.mark.parametrize("profile", [BASELINE, ACTION_FEEDBACK])
def test_nothing_hidden_goes_out(tmp_path: Path, profile: str) -> None:
    house = tiny_house("plumcanaryhouse", Fridge=TARGET, Mug=CHILD)
    episode = tiny_episode(
        0,
        "AI",
        house,
        id="canary-episode-zyx",
        start=START,
        instruction="Open the tall white thing.",
        goal={"kind": "object_state", "object_id": TARGET, "state": "is_open", "value": True},
        bindings={"target": TARGET, "witness": CHILD},
        max_steps=MAX_STEPS,
        max_invalid=MAX_INVALID,
        provenance=Provenance(author="secretauthor", template="reveal_nothing", solution_steps=7),
    )
    loose_pack(tmp_path / "pack", [episode], [house])
    with serving(replies) as server:
        wanted = RunSettings(
            pack=tmp_path / "pack",
            model="openai/loopback",
            base_url=server.url,
            log_dir=tmp_path / "canaryrun",
            backend="fake",
            workers=1,
            profile=profile,
        )
        record = run_pack(wanted).records[0]
    assert (record.end, len(record.steps), len(server.raw)) == ("report", 21, 2 + 21)
    numbers = hidden_numbers(record)
    assert len(numbers) > 50
    assert f"{START.position.x:.3f}" in numbers
    for raw in server.raw:
        sent = text_in(raw)
        assert episode.instruction in sent or raw in server.raw[:2]  # the check before the run
        for word in HIDDEN_WORDS:
            assert re.search(rf"(?<![A-Za-z]){re.escape(word)}(?![A-Za-z])", sent) is None, word
        assert "canary" not in sent
        for number in re.findall(r"(?<![\d.])\d+(?:\.\d+)?(?![\d.])", without_ports(sent)):
            assert number not in numbers, number


def without_ports(sent: str) -> str:
    """Return a request without the numbers in its headers (port, length, request id)."""
    head, _, body = sent.partition("\n\n")
    kept = [
        line
        for line in head.splitlines()
        if not re.match(r"(?i)host:|content-length:|x-irid:|user-agent:|x-stainless", line)
    ]
    return "\n".join(kept) + json.dumps(body)


def test_the_search_would_find_what_it_looks_for() -> None:
    text = zlib.crc32(b"tEXt" + b"Comment\0canary").to_bytes(4, "big")
    chunk = (14).to_bytes(4, "big") + b"tEXt" + b"Comment\0canary" + text
    raw = (
        b'POST /\nHost: x:83\n\n{"url": "data:image/png;base64,'
        + base64.b64encode(b"\x89PNG\r\n\x1a\n" + chunk)
        + b'"}'
    )
    assert "canary" in text_in(raw)
    assert "83" not in without_ports(text_in(raw))
