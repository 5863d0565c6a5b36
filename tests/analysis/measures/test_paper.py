"""The paper's constants, pinned in one place and compared with its tables (`golden/paper.json`)."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.support.published_runs import PUBLISHED
from vigil.base import geometry as pose
from vigil.protocol import actions, goals, observation, profile, prompt
from vigil.protocol.actions import INTENTS, SKILLS, STATUSES
from vigil.protocol.families import FAMILIES
from vigil.scoring import outcomes as scoring

PAPER = Path(__file__).parents[2] / "golden" / "paper.json"

BUDGETS = {
    "PG": ("diagnostic", True, 5, 3),
    "DA": ("diagnostic", True, 12, 4),
    "VS": ("diagnostic", False, 20, 6),
    "SV": ("diagnostic", True, 5, 2),
    "AI": ("compositional", True, 25, 8),
    "SI": ("compositional", False, 35, 10),
    "SM": ("compositional", True, 30, 10),
    "CR": ("compositional", True, 40, 12),
}


@pytest.fixture(scope="module")
def paper() -> Any:
    return json.loads(PAPER.read_text(encoding="utf-8"))


def test_budgets():
    found = {
        family: (spec.tier, spec.visible_at_start, spec.max_steps, spec.max_invalid)
        for family, spec in ((code, FAMILIES[code]) for code in PUBLISHED)
    }
    assert found == BUDGETS


def test_the_mean_of_limit_plus_one_is_the_papers_length_of_invalid_episodes():
    assert sum(spec.max_invalid + 1 for spec in map(FAMILIES.__getitem__, PUBLISHED)) / len(PUBLISHED) == 7.875


def test_vocabulary():
    assert list(SKILLS) == ["navigate", "look", "interact_pixel", "report"]
    assert list(INTENTS) == ["ground", "open_access", "close_access", "activate", "deactivate", "pick", "place", "drop"]
    assert list(STATUSES) == ["success", "fail", "unsafe", "invalid", "on", "off", "open", "closed"]
    assert sorted(scoring.NEGATIVE) == ["fail", "invalid", "unsafe"]


def test_camera_and_distances():
    assert (observation.FRAME_WIDTH, observation.FRAME_HEIGHT) == (640, 480)
    assert pose.EYE_HEIGHT_M == 1.576
    assert (actions.STEP_M, actions.REACH_M, actions.REACH_HEIGHT_M) == (0.25, 1.5, 2.2)
    assert (actions.MAX_STEPS_PER_ACTION, actions.MAX_TURN_DEG) == (40, 360.0)
    assert (actions.HORIZON_UP_DEG, actions.HORIZON_DOWN_DEG) == (-30.0, 60.0)
    assert (goals.NEAR_M, goals.OBSERVABLE_M, goals.OBSERVABLE_PX) == (1.5, 6.0, 40)


def test_names():
    assert profile.BASELINE == "pure_rgb_dialogue_history_baseline"
    assert prompt.POLICY == "native_embodied_public_evidence"
    assert prompt.POLICY in prompt.policy_version(profile.Profile())


def test_families_against_the_paper(paper: Any):
    rows = paper["tables"]["family_specs"]["rows"]
    assert [row["family"] for row in rows] == list(PUBLISHED)
    for row in rows:
        spec = FAMILIES[row["family"]]
        assert (spec.name, spec.tier) == (row["name"], row["layer"].casefold())
        assert spec.visible_at_start is row["target_visible_at_start"]
        assert (spec.max_steps, spec.max_invalid) == (row["step_budget"], row["invalid_action_limit"])
        assert list(spec.skills) == row["expected_skills"]


def test_goal_kinds_against_the_paper(paper: Any):
    kinds = {kind for spec in map(FAMILIES.__getitem__, PUBLISHED) for kind in spec.goal_kinds}
    assert kinds == set(paper["names"]["success_condition_types"])


def test_actions_against_the_paper(paper: Any):
    rows = paper["tables"]["action_specs"]["rows"]
    own = [(skill, argument) for skill, spec in SKILLS.items() for argument in spec]
    assert len(rows) == len(own)
    for row, (skill, argument) in zip(rows, own, strict=True):
        assert (row["skill"], row["argument"], row["type"]) == (skill, argument.name, argument.type)
        assert row["description"] == argument.description
        assert (row["required"] == "C") is argument.unless_drop
        assert tuple(row.get("enum", ())) == argument.values


def test_intents_and_statuses_against_the_paper(paper: Any):
    intents = {row["intent"]: (row["semantics"], row["requires_xy"]) for row in paper["tables"]["intents"]["rows"]}
    assert intents == {intent: (spec.semantics, spec.needs_pixel) for intent, spec in INTENTS.items()}
    statuses = {row["status"]: row["semantics"] for row in paper["tables"]["report_statuses"]["rows"]}
    assert statuses == STATUSES
    aliases = paper["tables"]["intents"]["aliases_named_in_text"]
    assert aliases.items() <= actions.INTENT_ALIASES.items()


def test_prompt_against_the_paper(paper: Any):
    words = paper["prompt"]
    first, second, third, fourth = prompt.policy_text(profile.Profile()).split("\n\n")
    assert first == words["block_1_task"]
    assert second.startswith(words["block_2_action_schema"] + "\n")
    assert third == words["block_3_grounding_rules"]
    assert fourth == words["block_4_output_format"]
    assert words["normalized_coordinates_rule"] == prompt.NORMALIZED_RULE
    assert tuple(words["anti_hallucination_lines"]) == prompt.ANTI_HALLUCINATION_LINES


def test_the_action_block_holds_every_description_of_the_paper(paper: Any):
    block = prompt.policy_text(profile.Profile()).split("\n\n")[1]
    tables = paper["tables"]
    for row in tables["action_specs"]["rows"]:
        assert f"{row['argument']} ({row['type']}, " in block
        assert row["description"] in block
    for row in [*tables["intents"]["rows"], *tables["report_statuses"]["rows"]]:
        assert row["semantics"] in block


def test_names_against_the_paper(paper: Any):
    names = paper["names"]
    assert names["evaluation_profile"]["name"] == profile.BASELINE
    assert names["prompt_policy"]["name"] == prompt.POLICY
    assert names["coordinate_mode"] == "normalized_1000"
    assert set(names["feedback_fields"]) == set(observation.Feedback.model_fields)
    assert set(names["terminal_scores"].values()) < set(scoring.End.__args__)
