from typing import Any

import pytest

from vigil.errors import SettingError
from vigil.runner.models.providers import PROVIDERS, describe_switch, parse_model_name, with_thinking
from vigil.runner.plan import plan_run
from vigil.runner.settings import RunSettings


@pytest.mark.parametrize(
    ("model", "on", "off"),
    [
        ("openai/m", {"reasoning_effort": "medium"}, {"reasoning_effort": "none"}),
        ("anthropic/m", {"reasoning_effort": "medium"}, {"reasoning_effort": "none"}),
        ("google/m", {"reasoning_effort": "medium"}, {"reasoning_effort": "none"}),
        ("ollama/m", {"reasoning_effort": "medium"}, {"reasoning_effort": "none"}),
        ("qwen/m", {"extra_body": {"enable_thinking": True}}, {"extra_body": {"enable_thinking": False}}),
        (
            "doubao/m",
            {"extra_body": {"thinking": {"type": "enabled"}}},
            {"extra_body": {"thinking": {"type": "disabled"}}},
        ),
        (
            "vllm/Qwen/Qwen3.5-27B",
            {"extra_body": {"chat_template_kwargs": {"enable_thinking": True, "thinking": True}}},
            {"extra_body": {"chat_template_kwargs": {"enable_thinking": False, "thinking": False}}},
        ),
    ],
)
def test_thinking_is_set_in_the_providers_own_way(model: str, on: dict[str, Any], off: dict[str, Any]) -> None:
    assert with_thinking({}, "on", parse_model_name(model)) == on
    assert with_thinking({}, "off", parse_model_name(model)) == off
    assert with_thinking({"top_p": 0.5}, "default", parse_model_name(model)) == {"top_p": 0.5}


def test_what_was_set_beside_it_stays() -> None:
    given = {"top_p": 0.5, "extra_body": {"top_k": 4, "chat_template_kwargs": {"add_vision_id": True}}}
    found = with_thinking(given, "off", parse_model_name("vllm/m"))
    template = {"add_vision_id": True, "enable_thinking": False, "thinking": False}
    assert found == {"top_p": 0.5, "extra_body": {"top_k": 4, "chat_template_kwargs": template}}
    assert given["extra_body"]["chat_template_kwargs"] == {"add_vision_id": True}
    high = {"reasoning_effort": "high"}
    assert with_thinking(high, "on", parse_model_name("openai/m")) == high
    assert describe_switch("off", parse_model_name("qwen/m")) == "extra_body.enable_thinking=False"


@pytest.mark.parametrize(
    ("thinking", "sampling", "model", "said"),
    [
        ("on", {"reasoning_effort": "none"}, "openai/m", "--thinking on contradicts --reasoning-effort none"),
        ("off", {"reasoning_effort": "low"}, "qwen/m", "--thinking off contradicts --reasoning-effort low"),
        ("off", {"extra_body": {"enable_thinking": True}}, "qwen/m", "but --extra-body says True"),
        ("off", {}, "lmstudio/m", "how to set this for LM Studio is unknown"),
    ],
)
def test_what_contradicts_is_refused(thinking: Any, sampling: dict[str, Any], model: str, said: str) -> None:
    with pytest.raises(SettingError, match=said):
        with_thinking(sampling, thinking, parse_model_name(model))


def test_a_run_says_how_its_model_was_told_to_think() -> None:
    spec = plan_run(RunSettings(model="doubao/m", thinking="off", temperature=0.0)).spec
    assert spec.thinking == "off"
    assert spec.sampling == {"temperature": 0.0, "extra_body": {"thinking": {"type": "disabled"}}}
    with pytest.raises(SettingError, match="contradicts"):
        plan_run(RunSettings(model="openai/m", thinking="on", reasoning_effort="none"))


def test_switches_are_settings_of_sampling() -> None:
    for one in PROVIDERS.values():
        if one.thinking is not None:
            assert {*one.thinking.on, *one.thinking.off} <= {"reasoning_effort", "extra_body"}
