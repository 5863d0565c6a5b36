"""Conversations under profiles that keep frames or declare criteria."""

from itertools import pairwise

from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import EncodedFrame
from vigil.protocol.observation import Cues
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import CRITERIA_REQUEST, PROFILE_NAMES

TASK = "Open the fridge."


def picture(number: int) -> EncodedFrame:
    return EncodedFrame(bytes([number]), "png")


def played(short: str, turns: int) -> tuple[Conversation, list[list]]:
    """Return a conversation after some turns, and the messages of each."""
    conversation = Conversation(Profile(name=PROFILE_NAMES[short]), TASK)
    sent = []
    for number in range(turns):
        sent.append(conversation.messages(picture(number), None))
        conversation.add(None, f"reply {number}", picture=picture(number))
    return conversation, sent


def test_the_last_frames_stay_with_their_turns() -> None:
    conversation, _ = played("image_history_2", 25)
    messages = conversation.messages(picture(99), None)
    shown = [message.picture.data[0] for message in messages if message.picture is not None]
    assert shown == [23, 24, 99]
    assert messages[-3].picture == picture(24)
    assert messages[-2].text == "reply 24"
    assert len(messages) == 1 + 2 * 20 + 1


def test_without_a_history_of_frames_only_the_current_one_is_sent() -> None:
    conversation, _ = played("baseline", 3)
    assert [message.picture for message in conversation.messages(picture(9), None)][:-1] == [None] * 7


def test_a_conversation_that_only_grows_is_a_prefix_of_every_later_one() -> None:
    _, sent = played("image_history_all", 30)
    for earlier, later in pairwise(sent):
        assert later[: len(earlier)] == earlier
        assert [message.role for message in later[len(earlier) :]] == ["assistant", "user"]
    assert sent[2][-1].text == '{"frame": {"number": 3, "width": 640, "height": 480}}'
    assert sum(message.picture is not None for message in sent[-1]) == 30


def test_declared_criteria_stay_when_the_history_is_full() -> None:
    conversation = Conversation(Profile(name=PROFILE_NAMES["declare_criteria"]), TASK)
    system, request = conversation.opening_request()
    assert (system.role, request.text) == ("system", CRITERIA_REQUEST)
    conversation.declare("<think>hm</think>The fridge stands open." + "x" * 5000)
    for number in range(30):
        conversation.add(None, f"reply {number}")
    messages = conversation.messages(picture(0), None)
    assert (messages[1].text, messages[2].role) == (CRITERIA_REQUEST, "assistant")
    assert messages[2].text.startswith("The fridge stands open.x")
    assert len(messages[2].text) == 4000
    assert messages[4].text == "reply 10"


def test_cues_stay_with_the_frame_that_they_came_with() -> None:
    conversation = Conversation(Profile(name=PROFILE_NAMES["remaining_steps"]), TASK)
    conversation.add(None, "{}", cues=Cues(remaining_steps=5))
    messages = conversation.messages(picture(0), None, Cues(remaining_steps=4, request="Look."))
    assert messages[1].text == '{"frame": {"role": "past"}, "remaining_steps": 5}'
    expected = '{"frame": {"role": "current", "width": 640, "height": 480}, "remaining_steps": 4, "request": "Look."}'
    assert messages[-1].text == expected
