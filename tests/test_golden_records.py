"""Golden records: lines that an earlier version wrote are read, settled and played again with the same result.

They guard the format (`record.SCHEMA_VERSION`), the scoring and the simulator's answers. When a change is meant to
alter what a record holds, write them anew with `python -m tests.test_golden_records`, look at
the difference, and raise SCHEMA_VERSION if a reader of the old lines would misunderstand the new ones.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from tests.support.tiny_pack import FRIDGE, tiny_episode, tiny_house
from vigil.assets.database import AssetDatabase
from vigil.base.json_lines import dump_line
from vigil.env import Env
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.profile import Profile
from vigil.records.record import SCHEMA_VERSION, EpisodeRecord
from vigil.records.record_file import read_records
from vigil.runner.workers.resimulation import ComparisonSettings, resimulate
from vigil.scoring.outcomes import Outcome, score
from vigil.sim import make_simulator

GOLDEN = Path(__file__).parent / "golden" / "records" / "episodes.jsonl"


def skill(name: str, **arguments: object) -> str:
    return json.dumps({"thought": "…", "skill_name": name, "arguments": arguments}, ensure_ascii=False)


def turn(mode: str, magnitude: float) -> str:
    return skill("navigate", mode=mode, magnitude=magnitude)


TO_THE_FRIDGE = (turn("turn_right", 60), turn("forward", 3.5), turn("turn_left", 21.5))
STORIES: dict[str, tuple[str, ...]] = {
    "AI": (
        "I will open the fridge.",
        "```json\n" + turn("forward", 1) + "\n```",
        skill("interact_pixel", intent="open_access", x=640, y=10),
        *TO_THE_FRIDGE,
        skill("interact_pixel", intent="open", x=320, y=240),
        skill("report", status="success", summary="It is open ✓"),
    ),
    "SV": (skill("look", direction="up", magnitude=20), skill("report", status="Open", summary="")),
    "PG": tuple(skill("interact_pixel", intent="ground", x=20 * step, y=30) for step in range(5)),
    "DA": (turn("forward", 40), skill("report", status="done", summary="near", certainty=1)),
}
EXPECTED = {
    "AI": {
        "end": "report",
        "W": True,
        "W_strict": True,
        "B": True,
        "label": "B",
        "first_goal_step": 7,
        "lag": 1,
        "protocol_failures": 2,
        "malformed_actions": 1,
        "would_parse_leniently": 1,
        "progress_at_report": 1.0,
    },
    "SV": {"end": "report", "W": True, "B": False, "label": "FR", "subtype": "sv_wrong_label", "expected": "closed"},
    "PG": {"end": "fail_no_report", "W": False, "B": False, "label": "NR", "category": "missed_execution", "steps": 5},
    "DA": {"end": "report", "W": True, "B": False, "label": "FR", "subtype": "false_negative", "raw_status": "done"},
}


def episode_of(family: str) -> Episode:
    return tiny_episode(1, family)  # type: ignore[arg-type]


def clock() -> Iterator[datetime]:
    moment = datetime(2026, 1, 1, tzinfo=UTC)
    while True:
        moment += timedelta(seconds=1)
        yield moment


def env() -> Env:
    ticks = clock()
    simulator = make_simulator("fake", assets=AssetDatabase.default())
    return Env(simulator, lambda _: tiny_house(), Profile(), clock=lambda: next(ticks))


def played(family: str) -> EpisodeRecord:
    world = env()
    observation = world.reset(episode_of(family))
    for text in STORIES[family]:
        assert observation is not None
        observation = world.step(Reply(text=text))
    assert world.end is not None
    return world.record(run_id="golden")


@pytest.fixture(scope="module")
def records() -> dict[str, EpisodeRecord]:
    return {record.episode_id.split("-")[1]: record for record in read_records(GOLDEN)}


def outcome_of(records: dict[str, EpisodeRecord], family: str) -> Outcome:
    outcome = score(episode_of(family), records[family])
    assert outcome is not None
    return outcome


def test_the_golden_lines_are_written_as_they_were_read(records):
    assert {record.schema_version for record in records.values()} == {SCHEMA_VERSION}
    assert b"".join(map(dump_line, records.values())) == GOLDEN.read_bytes()


@pytest.mark.parametrize("family", STORIES)
def test_a_golden_record_settles_as_it_did(records, family):
    outcome = outcome_of(records, family)
    assert {name: getattr(outcome, name) for name in EXPECTED[family]} == EXPECTED[family]


@pytest.mark.parametrize("family", STORIES)
def test_a_golden_record_plays_again_to_the_same_states(records, family):
    assert resimulate(episode_of(family), records[family], env(), ComparisonSettings()) == []
    assert FRIDGE in records["AI"].steps[-1].world.objects


def test_equal_states_with_another_verdict_are_a_difference(records, monkeypatch):
    recorded = records["AI"]

    def near_a_limit(episode, record):
        outcome = score(episode, record)
        return replace(outcome, W=not outcome.W) if record is recorded else outcome

    monkeypatch.setattr("vigil.runner.workers.resimulation.score", near_a_limit)
    (found,) = resimulate(episode_of("AI"), recorded, env(), ComparisonSettings())
    assert (found.fact, found.step) == ("verdict.W", len(recorded.steps))


if __name__ == "__main__":
    GOLDEN.write_bytes(b"".join(dump_line(played(family)) for family in STORIES))
