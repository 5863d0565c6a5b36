"""Profiles by name, and the published table of coordinate modes."""

import pytest
from pydantic import ValidationError

from vigil.profile import ACTION_FEEDBACK, BASELINE, Profile, coordinates_for


def test_the_default_profile_is_the_papers():
    profile = Profile()
    assert profile.name == BASELINE == "pure_rgb_dialogue_history_baseline"
    assert not profile.has_feedback
    assert (profile.history_turns, profile.history_reply_chars) == (20, 4000)
    assert (profile.prompt_variant, profile.coordinates, profile.reply_policy) == ("default", "pixel", "strict")
    assert profile.image_format == "png"


def test_only_the_intervention_has_feedback():
    assert not Profile(name=BASELINE).has_feedback
    assert Profile(name=ACTION_FEEDBACK).has_feedback
    assert ACTION_FEEDBACK == "pure_rgb_dialogue_history_action_feedback"


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
    ],
)
def test_coordinates_follow_the_published_table(model: str, mode: str):
    assert coordinates_for(model) == mode
