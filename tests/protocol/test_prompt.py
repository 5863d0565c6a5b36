"""The prompt: golden files for all four renderings, stubs and the bounded history."""

import hashlib
import json
from itertools import product
from pathlib import Path
from typing import get_args

import pytest

from vigil.protocol.actions import Coordinates
from vigil.protocol.claims import CLAIM_LINE, CLAIM_TABLE
from vigil.protocol.observation import Feedback
from vigil.protocol.profile import ITEMISED_REPORT, Profile, PromptVariant
from vigil.protocol.prompt import (
    ANTI_HALLUCINATION_LINES,
    INSTRUCTION_SLOT,
    NORMALIZED_RULE,
    Turn,
    frame_stub,
    is_truncated_in_history,
    past_turn,
    policy_sha256,
    policy_text,
    policy_version,
    recent_turns,
    rendered_sha256,
    system_prompt,
)

GOLDEN = Path(__file__).parents[1] / "golden"
RENDERINGS = list(product(get_args(PromptVariant), get_args(Coordinates)))


@pytest.mark.parametrize(("variant", "coordinates"), RENDERINGS)
def test_golden_renderings(variant: PromptVariant, coordinates: Coordinates):
    golden = (GOLDEN / f"prompt-{variant}-{coordinates}.txt").read_text(encoding="utf-8")
    assert policy_text(Profile(prompt_variant=variant, coordinates=coordinates)) + "\n" == golden


def test_hashes_are_those_of_the_texts_and_tell_renderings_apart():
    profiles = [Profile(prompt_variant=variant, coordinates=coordinates) for variant, coordinates in RENDERINGS]
    assert len({policy_sha256(profile) for profile in profiles}) == len(profiles)
    assert len({policy_version(profile) for profile in profiles}) == len(profiles)
    text = policy_text(Profile())
    assert policy_sha256(Profile()) == hashlib.sha256(text.encode()).hexdigest()
    filled = text.replace(INSTRUCTION_SLOT, "Open the café's fridge.")
    assert rendered_sha256("Open the café's fridge.", Profile()) == hashlib.sha256(filled.encode()).hexdigest()


def test_the_neutral_variant_lacks_two_lines_and_nothing_else():
    default, neutral = policy_text(Profile()), policy_text(Profile(prompt_variant="neutral_report"))
    kept = [line for line in default.split("\n") if line not in ANTI_HALLUCINATION_LINES]
    assert neutral.split("\n") == kept
    assert len(default.split("\n")) == len(kept) + 2


def test_normalized_coordinates_add_the_first_bullet_of_block_3_and_nothing_else():
    pixel, normalized = policy_text(Profile()), policy_text(Profile(coordinates="normalized_1000"))
    heading = "## Grounding Rules\n"
    assert normalized == pixel.replace(heading, f"{heading}- {NORMALIZED_RULE}\n")


def test_feedback_leaves_the_prompt_alone():
    baseline = Profile()
    intervention = Profile(name="pure_rgb_dialogue_history_action_feedback")
    assert system_prompt("x", baseline) == system_prompt("x", intervention)


def test_the_itemised_report_adds_one_argument_and_one_table_and_nothing_else():
    profile = Profile(name=ITEMISED_REPORT)
    text = policy_text(profile)
    assert text + "\n" == (GOLDEN / "prompt-itemised_report-pixel.txt").read_text(encoding="utf-8")
    added = [CLAIM_LINE, *CLAIM_TABLE]
    assert [line for line in text.split("\n") if line not in added] == policy_text(Profile()).split("\n")
    assert text.count("\n") == policy_text(Profile()).count("\n") + len(added)
    assert "/itemised_report[" in policy_version(profile)


def test_four_blocks_joined_by_one_blank_line():
    blocks = policy_text(Profile()).split("\n\n")
    assert [block.split("\n")[0] for block in blocks[1:]] == [
        "## Allowed actions",
        "## Grounding Rules",
        "## Output format",
    ]
    assert blocks[0].endswith(f"Task: {INSTRUCTION_SLOT}")


def test_an_instruction_is_taken_as_it_is():
    odd = f"Say {INSTRUCTION_SLOT} {{x}} \\1"
    assert f"Task: {odd}\n" in system_prompt(odd, Profile())


@pytest.mark.parametrize(
    ("role", "feedback", "text"),
    [
        ("current", None, '{"frame": {"role": "current", "width": 640, "height": 480}}'),
        ("past", None, '{"frame": {"role": "past"}}'),
        (
            "current",
            Feedback(too_far=True, path_blocked=False),
            '{"frame": {"role": "current", "width": 640, "height": 480}, '
            '"feedback": {"too_far": true, "path_blocked": false}}',
        ),
        (
            "past",
            Feedback(too_far=False, path_blocked=True),
            '{"frame": {"role": "past"}, "feedback": {"too_far": false, "path_blocked": true}}',
        ),
    ],
)
def test_stubs(role, feedback, text):
    assert frame_stub(role, feedback) == text
    assert json.loads(text)["frame"]["role"] == role


def test_history_keeps_the_last_twenty_turns_and_4000_characters():
    profile = Profile()
    turns = [Turn("stub", str(index)) for index in range(33)]
    assert [turn.reply for turn in recent_turns(turns, profile)] == [str(index) for index in range(13, 33)]
    assert recent_turns(turns[:3], profile) == turns[:3]
    assert recent_turns(turns, Profile(history_turns=0)) == []
    long = "x" * 4001
    assert past_turn(None, long, profile) == Turn('{"frame": {"role": "past"}}', "x" * 4000)
    assert [is_truncated_in_history("x" * size, profile) for size in (4000, 4001)] == [False, True]


def test_reasoning_stays_out_of_the_history():
    profile = Profile()
    assert past_turn(None, f"<think>{'y' * 9000}</think>{{}}", profile).reply == "{}"
