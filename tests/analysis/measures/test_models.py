"""Models and the published rows."""

import json
from pathlib import Path
from typing import Any

import pytest

from vigil.analysis.measures.models import GROUPS, activated_of, agent_of, checkpoint_of, group_of
from vigil.analysis.measures.paper import paper
from vigil.records.record import AgentKind, RunSpec

PAPER = Path(__file__).parents[2] / "golden" / "paper.json"


def spec(agent: str, kind: AgentKind = "model", **facts: Any) -> RunSpec:
    fixed = {"prompt_policy": "p", "prompt_policy_sha256": "", "pack": "p", "pack_sha256": "", "episode_ids": ()}
    return RunSpec(agent=agent, agent_kind=kind, **fixed, **facts)


@pytest.mark.parametrize("model", paper().models, ids=lambda model: model.name)
def test_published_models_group_as_published(model: Any):
    assert group_of(model.name) == model.group
    assert activated_of(model.name) == model.activated


@pytest.mark.parametrize(
    ("agent", "sampling", "name", "thinking"),
    [
        ("vllm/Qwen/Qwen3-VL-32B-Instruct", {}, "Qwen3-VL-32B-Instruct", False),
        ("vllm/Qwen/Qwen3-VL-32B-Thinking", {}, "Qwen3-VL-32B-Thinking", True),
        ("openai/gpt-5.4", {"reasoning_effort": "high"}, "gpt-5.4 (T)", True),
        ("openai/gpt-5.4", {"reasoning_effort": "none"}, "gpt-5.4", False),
        ("openai-api/x/q", {"extra_body": {"chat_template_kwargs": {"enable_thinking": False}}}, "q", False),
    ],
)
def test_names_and_serving_modes(agent: str, sampling: dict[str, Any], name: str, thinking: bool | None):
    found = agent_of(spec(agent, sampling=sampling))
    assert (found.name, found.is_thinking) == (name, thinking)


@pytest.mark.parametrize(
    ("name", "checkpoint"),
    [
        ("Qwen3-VL-32B-Instruct", "Qwen3-VL-32B"),
        ("Qwen3-VL-32B-Thinking-FP8", "Qwen3-VL-32B-FP8"),
        ("Qwen3-VL-32B (T)", "Qwen3-VL-32B"),
        ("qwen3-vl:8b-thinking", "qwen3-vl:8b"),
        ("InstructBLIP-7B", "InstructBLIP-7B"),
        ("Cosmos-Reason1-7B", "Cosmos-Reason1-7B"),
    ],
)
def test_a_checkpoint_is_a_name_without_its_serving_mode(name: str, checkpoint: str):
    assert checkpoint_of(name) == checkpoint


def test_agents_that_are_no_models_have_groups_of_their_own():
    solver = agent_of(spec("solver", "privileged"))
    assert (solver.name, solver.group, solver.is_privileged) == ("solver (privileged)", GROUPS[5], True)
    assert agent_of(spec("random", "scripted")).group == GROUPS[3]
    assert group_of("some-model", "anthropic") == GROUPS[2]


def test_there_are_28_models_in_three_panels():
    found = paper()
    assert len({model.name for model in found.models}) == 28
    assert [
        sum(model.panel == panel for model in found.models) for panel in ("full_panel", "excluded", "supplementary")
    ] == [20, 3, 5]
    assert sum(model.anchor for model in found.models) == 10
    assert len(found.points()) == 28


def test_every_published_row_obeys_b_at_most_w():
    for _, w, b in paper().points():
        assert b <= w
    for name in ("full_panel", "global_cross_section", "prompt_sensitivity"):
        for _, row in paper().rows(name):
            assert all(pair[1] <= pair[0] for pair in row["families"].values())


def test_shipped_rows_are_those_of_the_paper():
    source = json.loads(PAPER.read_text(encoding="utf-8"))["tables"]
    found = paper().tables
    for name in ("full_panel", "global_cross_section", "prompt_sensitivity"):
        for ours, theirs in zip(found[name], source[name]["rows"], strict=True):
            assert (ours["model"], ours["W"], ours["B"]) == (theirs["row_name"], theirs["All"]["W"], theirs["All"]["B"])
            assert ours["families"] == {family: [pair["W"], pair["B"]] for family, pair in theirs["families"].items()}
    plain = {
        "counterfactual": {"B": "B", "Always": "Always", "Rand": "Rand"},
        "belief_lag": {
            "W_plus": "W_plus",
            "lag": "lag",
            "NR_W1": "NR_W1",
            "FS": "FS",
            "zero_progress_pct": "zero_progress_pct",
        },
        "conditional_report": {name: name for name in ("Stop", "P_rep_W0", "P_norep_W1", "n_W0", "n_W1")},
        "extended_panel": {"B": "B", "W": "W", "FR": "FR", "NoRep": "NR", "IL": "IL", "mean_steps": "mean_steps"},
        "proprio_minimal": {name: name for name in ("dW", "dB", "dFR", "dNR")},
    }
    for name, keys in plain.items():
        for ours, theirs in zip(found[name], source[name]["rows"], strict=True):
            assert ours["model"] == theirs["row_name"]
            assert {key: ours[key] for key in keys} == {key: theirs[other] for key, other in keys.items()}
    for ours, theirs in zip(found["open_repeat_robustness"], source["open_repeat_robustness"]["rows"], strict=True):
        assert ours["B"] == [theirs["B"]["mean"], theirs["B"]["half_range"]]
