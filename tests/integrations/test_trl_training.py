"""GRPO steps of TRL's trainer on episodes, with the tiny model of the example. Skipped where TRL is not installed."""

import argparse
import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest

from tests.support.tiny_pack import tiny_pack
from vigil.integrations.trl import Episodes, VigilReplies, protocol_processor

pytest.importorskip("trl", reason="trl is not installed: docs/trl.md says how")

EXAMPLE = Path(__file__).parents[2] / "examples" / "train_tiny_vlm.py"
REPORT = '{"skill_name": "report", "arguments": {"status": "success", "summary": ""}}'
TURN = '{"skill_name": "navigate", "arguments": {"mode": "turn_left", "magnitude": 90}}'

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module")
def example() -> Any:
    spec = importlib.util.spec_from_file_location("train_tiny_vlm", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def episodes(tmp_path_factory: pytest.TempPathFactory) -> Episodes:
    folder = tmp_path_factory.mktemp("training") / "pack"
    tiny_pack(folder, 3)
    return Episodes(pack=str(folder), backend="fake")


@pytest.fixture(scope="module")
def chats(episodes: Episodes) -> list[Any]:
    """Conversations of two turns."""
    found = []
    for row in episodes.rows():
        environment = episodes.environment()
        assert isinstance(environment, VigilReplies)
        system, user = row["prompt"]
        first, second = environment.reset(**row), environment.reply(TURN)
        answers = [{"role": "assistant", "content": [{"type": "text", "text": text}]} for text in (TURN, REPORT)]
        found.append([
            system, {**user, "content": first}, answers[0], {"role": "user", "content": second}, answers[1]
        ])  # fmt: skip
    return found


def test_two_steps_of_grpo_change_the_model(example: Any, episodes: Episodes, chats: list[Any], tmp_path: Path) -> None:
    example.hf.set_seed(0)
    processor = protocol_processor(example.processor_of(chats))
    model = example.model_of(processor)
    for _ in example.supervise(model, processor, chats, 40):
        pass
    given = argparse.Namespace(out=tmp_path, grpo=2, group=2, seed=0)
    trainer = example.trainer_of(model, processor, episodes, given)
    trainer.reward_weights[0] = 1.0  # B is 0 for all, and equal rewards of a group teach nothing
    before = [weight.detach().clone() for weight in model.parameters()]
    trainer.train()
    steps = [found for found in trainer.state.log_history if "rewards/VigilReplies/mean" in found]
    assert [found["step"] for found in steps] == [1, 2]
    assert all(0.0 <= found["rewards/valid_replies/mean"] <= 1.0 for found in steps)
    assert any(found["tools/call_frequency"] > 0 for found in steps)
    assert any(bool((now != then).any()) for now, then in zip(model.parameters(), before, strict=True))


def test_a_conversation_has_the_tokens_of_a_run_s_requests(example: Any, chats: list[Any]) -> None:
    """The changed template writes calls and answers of tools as the model's own template writes turns."""
    plain, changed = example.processor_of(chats), protocol_processor(example.processor_of(chats))
    system, user, answer, following, report = chats[0]
    call = {"type": "function", "function": {"name": "reply", "arguments": {"text": TURN}}}
    played = [
        system,
        user,
        {"role": "assistant", "content": [], "tool_calls": [call]},
        {**following, "role": "tool", "name": "reply"},
        report,
    ]
    assert changed.apply_chat_template(played) == plain.apply_chat_template([system, user, answer, following, report])


@pytest.mark.parametrize(
    ("text", "is_call"),
    [(TURN, True), ("I turn.", True), (REPORT, False), (json.dumps({"thought": "done", **json.loads(REPORT)}), False)],
)
def test_every_reply_but_a_report_is_a_call(example: Any, chats: list[Any], text: str, is_call: bool) -> None:
    tokenizer = protocol_processor(example.processor_of(chats)).tokenizer
    parsed = tokenizer.parse_response(f"{text}<|im_end|>", prefix="<|im_start|>assistant\n")
    if is_call:
        assert parsed["tool_calls"][0]["function"] == {"name": "reply", "arguments": {"text": text}}
    else:
        assert (parsed["content"], parsed.get("tool_calls")) == (text, None)
