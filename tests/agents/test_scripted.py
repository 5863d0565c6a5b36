import json

import numpy as np
import pytest

from tests.support.narrowing import accepted, rejected
from vigil.agents.registry import is_known, make_agent
from vigil.agents.scripted import PROSE, REPORT_PROBABILITY, SCRIPTS, scripted_agent
from vigil.errors import SettingError
from vigil.protocol.actions import InteractPixel, Navigate, ParsedReply, Report
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.observation import Observation
from vigil.protocol.profile import Profile
from vigil.protocol.replies import parse_text

SMALLEST_BUDGET = 5


def unseen() -> Observation:
    def draw() -> np.ndarray:
        raise AssertionError("a scripted agent looks at nothing")

    return Observation(draw)


def replies(name: str, count: int, seed: int = 0, instruction: str = "Do it.") -> list[str]:
    agent = scripted_agent(name, seed)
    agent.start(instruction)
    return [agent.act(unseen()).text for _ in range(count)]


@pytest.mark.parametrize("name", sorted(set(SCRIPTS) - {"malformed"}))
def test_every_reply_is_a_valid_action(name: str) -> None:
    for text in replies(name, 300):
        assert isinstance(parse_text(text), ParsedReply), text


@pytest.mark.parametrize("name", ["sweep", "forward", "always_success"])
def test_claims_success_within_the_smallest_budget(name: str) -> None:
    actions = [accepted(parse_text(text)).action for text in replies(name, SMALLEST_BUDGET)]
    assert Report(status="success", summary="Done.") in actions
    assert all(isinstance(action, Navigate) for action in actions[:-1]) or name == "always_success"


@pytest.mark.parametrize(("name", "family"), [("explore", "VS"), ("click_around", "AI"), ("point", "PG")])
def test_a_blind_agent_reports_within_the_budget_of_its_family(name: str, family: Family) -> None:
    actions = [accepted(parse_text(text)).action for text in replies(name, FAMILIES[family].max_steps)]
    assert isinstance(actions[-1], Report)
    assert not isinstance(actions[0], Report)


@pytest.mark.parametrize(
    ("instruction", "intent"),
    [
        ("Please open the cabinet closest to the countertop.", "open_access"),
        ("The fridge has to be closed.", "close_access"),
        ("Turn the floor lamp on.", "activate"),
        ("Could you light the candle in the living room?", "activate"),
        ("Put out the candle.", "deactivate"),
        ("Switch off the laptop.", "deactivate"),
        ("The bowl closest to the countertop has to be picked up.", "pick"),
    ],
)
def test_blind_clicks_carry_the_intent_that_the_words_ask_for(instruction: str, intent: str) -> None:
    actions = [accepted(parse_text(text)).action for text in replies("click_around", 22, instruction=instruction)]
    assert {action.intent for action in actions if isinstance(action, InteractPixel)} == {intent}


def test_sweep_sees_all_around() -> None:
    turns = [accepted(parse_text(text)).action for text in replies("sweep", 4)]
    assert sum(turn.magnitude for turn in turns if isinstance(turn, Navigate)) == 360


def test_always_success_reports_at_once() -> None:
    assert isinstance(accepted(parse_text(replies("always_success", 1)[0])).action, Report)


def test_noop_drops_for_ever() -> None:
    assert [accepted(parse_text(text)).action for text in replies("noop", 50)] == [InteractPixel(intent="drop")] * 50


def test_malformed_is_prose() -> None:
    assert replies("malformed", 2) == [PROSE, PROSE]
    assert rejected(parse_text(PROSE)).kind == "protocol_failure"


def test_random_is_a_function_of_seed_and_instruction() -> None:
    assert replies("random", 40) == replies("random", 40)
    assert replies("random", 40) != replies("random", 40, seed=1)
    assert replies("random", 40) != replies("random", 40, instruction="Do something else.")


def test_random_starts_over_with_each_episode() -> None:
    agent = scripted_agent("random")
    agent.start("Do it.")
    first = [agent.act(unseen()).text for _ in range(9)]
    agent.start("Do it.")
    assert [agent.act(unseen()).text for _ in range(9)] == first


def test_random_reports_one_time_in_twenty_and_uses_everything() -> None:
    actions = [accepted(parse_text(text)).action for text in replies("random", 4000)]
    reports = [action for action in actions if isinstance(action, Report)]
    assert abs(len(reports) / len(actions) - REPORT_PROBABILITY) < 0.015
    assert len({report.status for report in reports}) == 8
    assert len({action.intent for action in actions if isinstance(action, InteractPixel)}) == 8
    assert len({action.mode for action in actions if isinstance(action, Navigate)}) == 4


def test_replies_are_plain_json() -> None:
    assert json.loads(replies("noop", 1)[0]) == {"skill_name": "interact_pixel", "arguments": {"intent": "drop"}}


def test_unknown_agents_are_refused_with_the_known_ones() -> None:
    assert is_known("noop")
    assert not is_known("solvr")
    with pytest.raises(SettingError, match=r"'solvr'.*noop.*exec:COMMAND"):
        make_agent("solvr", Profile())
