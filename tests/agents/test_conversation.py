import json

import numpy as np

from vigil.agents.conversation import Conversation
from vigil.agents.frame_encoding import decode_frame, encode_frame
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import ACTION_FEEDBACK, HISTORY_TURNS, Profile
from vigil.protocol.prompt import system_prompt

PICTURE = encode_frame(np.zeros((480, 640, 3), np.uint8))
TASK = "Find the mug."


def test_the_first_message_is_the_prompt_and_the_last_the_frame() -> None:
    messages = Conversation(Profile(), TASK).messages(PICTURE, None)
    assert [message.role for message in messages] == ["system", "user"]
    assert messages[0].text == system_prompt(TASK, Profile())
    assert json.loads(messages[1].text) == {"frame": {"role": "current", "width": 640, "height": 480}}
    assert messages[1].picture is PICTURE


def test_history_holds_the_last_turns_without_pictures() -> None:
    conversation = Conversation(Profile(), TASK)
    for turn in range(25):
        conversation.add(None, f"reply {turn}")
    messages = conversation.messages(PICTURE, None)
    past = messages[1:-1]
    assert len(past) == 2 * HISTORY_TURNS
    assert [message.role for message in past] == ["user", "assistant"] * HISTORY_TURNS
    assert [message.text for message in past[1::2]] == [f"reply {turn}" for turn in range(5, 25)]
    assert {message.text for message in past[::2]} == {'{"frame": {"role": "past"}}'}
    assert [message.picture for message in past] == [None] * len(past)


def test_long_replies_are_cut_and_reasoning_is_left_out() -> None:
    conversation = Conversation(Profile(), TASK)
    conversation.add(None, "<think>" + "secret " * 1000 + "</think>" + "y" * 5000)
    reply = conversation.messages(PICTURE, None)[2].text
    assert reply == "y" * 4000


def test_past_stubs_keep_the_feedback_they_were_shown_with() -> None:
    conversation = Conversation(Profile(name=ACTION_FEEDBACK), TASK)
    conversation.add(None, "a")
    conversation.add(Feedback(too_far=True, path_blocked=False), "b")
    stubs = [
        json.loads(message.text)
        for message in conversation.messages(PICTURE, Feedback(too_far=False, path_blocked=True))
        if message.role == "user"
    ]
    assert [stub.get("feedback") for stub in stubs] == [
        None,
        {"too_far": True, "path_blocked": False},
        {"too_far": False, "path_blocked": True},
    ]


def test_pictures_are_lossless_as_png_and_repeatable() -> None:
    rgb = np.random.default_rng(0).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    png, jpeg = encode_frame(rgb), encode_frame(rgb, "jpeg")
    assert (decode_frame(png.data) == rgb).all()
    assert encode_frame(rgb).data == png.data
    assert (png.media_type, jpeg.media_type) == ("image/png", "image/jpeg")
    assert png.data_uri.startswith("data:image/png;base64,iVBOR")
    assert jpeg.data[:2] == b"\xff\xd8"


def test_without_a_system_role_the_prompt_begins_the_first_message_of_the_user():
    plain, merged = (Conversation(Profile(system_role=role), TASK) for role in ("system", "user"))
    for reply in ("one", "two"):
        for conversation in (plain, merged):
            conversation.add(None, reply)
        (system, first, *rest), (only, *others) = (one.messages(PICTURE, None) for one in (plain, merged))
        assert (only.role, only.text) == ("user", f"{system.text}\n\n{first.text}")
        assert others == rest
        assert [message.role for message in (only, *others)] == [*["user", "assistant"] * (len(rest) // 2), "user"]


def test_without_a_system_role_the_first_request_is_one_message_with_the_frame():
    (only,) = Conversation(Profile(system_role="user"), TASK).messages(PICTURE, None)
    assert (only.role, only.picture) == ("user", PICTURE)
