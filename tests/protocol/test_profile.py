"""Profiles by name, and the published table of coordinate modes."""

import pytest
from pydantic import ValidationError

from vigil.protocol.profile import (
    ACTION_FEEDBACK,
    BASELINE,
    ITEMISED_REPORT,
    JPEG_QUALITY,
    Profile,
    coordinates_for,
    known_coordinates,
)
from vigil.protocol.profiles.rows import PROFILE_NAMES, PROFILES


def test_the_default_profile_is_the_papers():
    profile = Profile()
    assert profile.name == BASELINE == "pure_rgb_dialogue_history_baseline"
    assert not profile.has_feedback
    assert (profile.history_turns, profile.history_reply_chars) == (20, 4000)
    assert (profile.prompt_variant, profile.coordinates, profile.reply_policy) == ("default", "pixel", "strict")
    assert profile.image_format == "png"
    assert JPEG_QUALITY == 90


@pytest.mark.parametrize(
    "setting",
    [
        {"prompt_variant": "neutral_report"},
        {"coordinates": "normalized_1000"},
        {"reply_policy": "lenient"},
        {"image_format": "jpeg"},
        {"system_role": "user"},
        {"history_turns": 0},
        {"history_reply_chars": 1},
    ],
)
def test_each_published_setting_is_taken_and_changes_nothing_else(setting: dict):
    assert Profile.model_validate(setting).model_dump() == Profile().model_dump() | setting


@pytest.mark.parametrize(
    "setting",
    [
        {"prompt_variant": "terse"},
        {"coordinates": "percent"},
        {"reply_policy": "loose"},
        {"image_format": "webp"},
        {"history_turns": -1},
        {"history_reply_chars": 0},
        {"depth": True},
    ],
)
def test_any_other_setting_is_refused(setting: dict):
    with pytest.raises(ValidationError, match=next(iter(setting))):
        Profile.model_validate(setting)


@pytest.mark.parametrize("setting", ["prompt_variant", "image_format"])
def test_the_settings_of_a_run_cannot_be_changed_later(setting: str):
    with pytest.raises(ValidationError, match="frozen"):
        setattr(Profile(), setting, "neutral_report")


@pytest.mark.parametrize("setting", ["prompt_variant", "image_format"])
def test_the_defaults_are_settings_themselves(setting: str):
    default = Profile().model_dump()[setting]
    assert getattr(Profile.model_validate({setting: default}), setting) == default


def test_only_the_intervention_has_feedback():
    assert not Profile(name=BASELINE).has_feedback
    assert Profile(name=ACTION_FEEDBACK).has_feedback
    assert ACTION_FEEDBACK == "pure_rgb_dialogue_history_action_feedback"


def test_only_the_itemised_report_has_claims_and_it_is_without_feedback():
    assert [name for name in PROFILE_NAMES if Profile(name=PROFILE_NAMES[name]).has_claims] == [
        "itemised_report",
        "pure_rgb_dialogue_history_itemised_report",
    ]
    assert not Profile(name=ITEMISED_REPORT).has_feedback


def test_an_unknown_profile_is_refused():
    with pytest.raises(ValidationError):
        Profile.model_validate({"name": "depth_and_pose"})


@pytest.mark.parametrize(
    ("model", "mode"),
    [
        ("openai/gpt-5.4", "pixel"),
        ("anthropic/claude-sonnet-4-20250514", "pixel"),
        ("vllm/Qwen/Qwen2.5-VL-7B-Instruct", "pixel"),
        ("vllm/Qwen/Qwen3-VL-32B-Instruct", "normalized_1000"),
        ("vllm/Qwen/Qwen3.5-27B", "normalized_1000"),
        ("google/gemini-3.1-pro-preview", "normalized_1000"),
        ("vllm/OpenGVLab/InternVL3_5-38B", "normalized_1000"),
        ("openai-api/ark/doubao-seed-1.8", "normalized_1000"),
        ("openai-api/ark/doubao-vision", "normalized_1000"),
        ("ByteDance/Seed1.5-VL", "normalized_1000"),
        ("seed-1.6", "normalized_1000"),
        ("vllm/Qwen/Qwen2-VL-7B-Instruct", "normalized_1000"),
        ("qwen2vl-72b", "normalized_1000"),
        ("Qwen/Qwen2.5-VL-7B-Instruct", "pixel"),
        ("qwen2_5-vl", "pixel"),
        ("deepseek-ai/deepseek-vl2", "normalized_1000"),
        ("zai-org/GLM-5V", "normalized_1000"),
        ("XiaomiMiMo/MiMo-Embodied-7B", "pixel"),
        ("MiMo-Embodied on Qwen3", "pixel"),
        ("qwen2.5vl served by Gemini", "pixel"),
        ("BAAI/RoboBrain2.5-8B", "normalized_1000"),
        ("Alibaba-DAMO/RynnBrain-8B", "normalized_1000"),
        ("zai-org/GLM-4.5V", "normalized_1000"),
        ("zai-org/GLM-4.6", "pixel"),
    ],
)
def test_coordinates_follow_the_published_table(model: str, mode: str):
    assert coordinates_for(model) == mode


@pytest.mark.parametrize(
    ("model", "mode"),
    [
        ("openai/gpt-5.4", "pixel"),
        ("anthropic/claude-sonnet-4-20250514", "pixel"),
        ("qwen/qwen3-vl-plus", "normalized_1000"),
        ("vllm/moonshotai/Kimi-VL-A3B-Instruct", None),
        ("local/gpt-oss", None),
    ],
)
def test_a_model_that_the_table_does_not_name_is_told_from_one_that_it_does(model: str, mode: str | None):
    assert known_coordinates(model) == mode


def test_profiles_are_named_in_short_and_in_full():
    assert PROFILE_NAMES["baseline"] == PROFILE_NAMES[BASELINE] == BASELINE
    assert PROFILE_NAMES["action_feedback"] == PROFILE_NAMES[ACTION_FEEDBACK] == ACTION_FEEDBACK
    assert set(PROFILE_NAMES.values()) == PROFILES.keys()
    with pytest.raises(ValidationError, match="'pure_rgb' is not the name of a profile"):
        Profile(name="pure_rgb")
