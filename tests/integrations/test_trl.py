"""The environments and rows for TRL, as its trainers use them, without TRL."""

import inspect
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tests.support.narrowing import present
from tests.support.tiny_pack import tiny_pack
from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import decode_frame, encode_frame
from vigil.errors import PackMismatch, SettingError
from vigil.integrations.trl import Environment, Episodes, VigilReplies, VigilSkills, valid_replies
from vigil.integrations.trl.environments import EPISODE_OVER

FORWARD = json.dumps({"skill_name": "navigate", "arguments": {"mode": "forward", "magnitude": 3}})
REPORT = json.dumps({"skill_name": "report", "arguments": {"status": "success", "summary": ""}})
REACHED = 1
"""Number of the row whose goal holds after `FORWARD`."""


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("trl") / "pack"
    tiny_pack(folder)
    return str(folder)


@pytest.fixture
def episodes(pack: str) -> Iterator[Episodes]:
    made = Episodes(pack=pack, backend="fake")
    yield made
    made.close()


def tools_of(environment: Environment) -> set[str]:
    """Return the names that TRL takes for tools."""
    names = {name for name, _ in inspect.getmembers(type(environment), predicate=inspect.isfunction)}
    return {name for name in names - {"reset", "get_reward"} if not name.startswith("_")}


def said(text: str) -> list[dict[str, Any]]:
    return [{"role": "assistant", "content": text}]


def test_the_tools_are_the_four_skills_or_the_reply(pack: str, episodes: Episodes) -> None:
    assert tools_of(episodes.environment()) == {"reply"}
    assert tools_of(Episodes(pack=pack, actions="tools").environment()) == {
        "navigate", "look", "interact_pixel", "report",
    }  # fmt: skip


def test_what_the_trainer_shows_is_what_a_run_sends(episodes: Episodes) -> None:
    row, environment = episodes.rows()[REACHED], episodes.environment()
    assert isinstance(environment, VigilReplies)
    first = environment.reset(**row)
    second = environment.reply(FORWARD)
    conversation = Conversation(episodes.options.condition, environment.episode.episode.instruction)
    pictures = [encode_frame(np.asarray(content[1]["image"])) for content in (first, second)]
    conversation.add(None, FORWARD, picture=pictures[0])
    system, past, answer, current = conversation.messages(pictures[1], None)
    assert row["prompt"][0]["content"][0]["text"] == system.text
    assert (first[0]["text"], answer.text, second[0]["text"]) == (past.text, FORWARD, current.text)
    assert not np.array_equal(decode_frame(present(past.picture).data), decode_frame(present(current.picture).data))


def test_a_report_that_no_tool_takes_ends_the_episode(episodes: Episodes) -> None:
    environment = episodes.environment()
    assert isinstance(environment, VigilReplies)
    environment.reset(**episodes.rows()[REACHED])
    environment.reply("I walk.")
    environment.reply(FORWARD)
    assert environment.get_reward() == 0.0
    assert valid_replies([said(REPORT)], [environment]) == [pytest.approx(2 / 3)]
    assert environment.get_reward() == 1.0
    assert present(environment.record).end == "report"
    assert environment.reply(FORWARD) == [{"type": "text", "text": EPISODE_OVER}]
    assert valid_replies([said(FORWARD)], [environment]) == [pytest.approx(2 / 3)]


def test_an_episode_that_the_trainer_cuts_off_earns_nothing(pack: str) -> None:
    episodes = Episodes(pack=pack, backend="fake", world_reward=0.5)
    environment = episodes.environment()
    assert isinstance(environment, VigilReplies)
    assert environment.get_reward() == 0.0
    environment.reset(**episodes.rows()[REACHED])
    environment.reply(FORWARD)
    calls = [{"role": "assistant", "content": "", "tool_calls": [{}]}]
    assert valid_replies([calls], [environment]) == [1.0]
    assert environment.get_reward() == 0.0
    assert environment.record is None


def test_the_members_of_a_group_play_the_episode_of_their_row(episodes: Episodes) -> None:
    row, group = episodes.rows()[2], [episodes.environment() for _ in range(3)]
    frames = [np.asarray(member.reset(**row)[1]["image"]) for member in group]
    assert {member.episode.episode.id for member in group} == {row["episode_id"]}
    assert all(np.array_equal(frames[0], frame) for frame in frames)


def test_the_four_skills_are_actions_of_the_protocol(pack: str) -> None:
    episodes = Episodes(pack=pack, backend="fake", actions="tools")
    environment = episodes.environment()
    assert isinstance(environment, VigilSkills)
    environment.reset(**episodes.rows()[REACHED])
    environment.look("down", 10)
    environment.interact_pixel("drop")
    environment.interact_pixel("ground", 320, 240)
    environment.navigate("sideways", 1)  # pyright: ignore[reportArgumentType] - a model may say it
    environment.navigate("forward", 3)
    environment.report("success", "")
    valid = [step.invalid is None for step in environment.steps]
    assert valid == [True, True, True, False, True, True]
    assert environment.get_reward() == 1.0


def test_rows_have_no_goal_and_name_their_pack(pack: str, episodes: Episodes) -> None:
    row = episodes.rows()[REACHED]
    assert set(row) == {"prompt", "episode_id", "house", "source"}
    with pytest.raises(PackMismatch, match="Make the data set and the environments from the same `Episodes`"):
        episodes.environment().reset(**{**row, "source": "other@1"})
    with pytest.raises(SettingError, match="nothing"):
        episodes.environment().reset(**{**row, "episode_id": "nothing"})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"profile": "baseline"}, "profile 'baseline' does not exist.*image_history_all"),
        ({"action": "tools"}, "no option 'action'.*actions"),
        ({"actions": "tool"}, "actions: Input should be 'text' or 'tools'"),
        ({"calibration_weight": 2.0}, "calibration_weight: Input should be less than or equal to 1"),
    ],
)
def test_wrong_options_are_named(options: dict[str, Any], message: str, pack: str) -> None:
    with pytest.raises(SettingError, match=message):
        Episodes(**{"pack": pack, **options})


def test_an_endless_stream_asks_for_an_end() -> None:
    with pytest.raises(SettingError, match="endless: give `limit`, or `houses` with an end"):
        Episodes(pack="stream:7").rows()
