"""Env under profiles that vary how an episode is closed and what is shown: `protocol.md` section 11."""

import numpy as np
import pytest

from tests.support.bare_house import bare_house
from tests.support.builders import episode, thing
from tests.support.scripted_simulator import ScriptedSimulator
from tests.test_env import DONE, PROSE, WALK, reply
from vigil.env import Env
from vigil.errors import RecordError
from vigil.protocol.actions import Reply, Report
from vigil.protocol.observation import Cues, Observation
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import LOOK_AGAIN, PROFILE_NAMES
from vigil.records.record import EpisodeRecord
from vigil.records.row_check import protocol_violations
from vigil.scoring.outcomes import score
from vigil.scoring.rates import RATES
from vigil.scoring.summary import RunScores, summarise

TASK = episode("AI", max_steps=5)
FAIL = reply("report", status="fail", summary="")
CLICK = reply("interact_pixel", intent="ground", x=100, y=50)


def env_of(short: str, recorded_profile: Profile | None = None) -> Env:
    simulator = ScriptedSimulator({"target": thing()})
    return Env(simulator, lambda _: bare_house(), Profile(name=PROFILE_NAMES[short]), recorded_profile=recorded_profile)


def play(env: Env, *replies: Reply) -> tuple[EpisodeRecord, list[Observation]]:
    """Return the record and all observations."""
    observation, seen = env.reset(TASK), []
    for answer in replies:
        assert observation is not None
        seen.append(observation)
        observation = env.step(answer)
    assert observation is None
    return env.record(), seen


def requests(seen: list[Observation]) -> list[str | None]:
    return [None if one.cues is None else one.cues.request for one in seen]


def test_a_first_report_is_answered_by_a_request_to_look_again() -> None:
    record, seen = play(env_of("look_before_report"), WALK, FAIL, WALK, DONE)
    assert requests(seen) == [None, None, LOOK_AGAIN, None]
    assert [step.is_unconfirmed for step in record.steps] == [False, True, False, False]
    assert (record.end, len(record.steps), protocol_violations(TASK, record)) == ("report", 4, [])
    assert score(TASK, record).reported == "success"
    assert EpisodeRecord.model_validate_json(record.model_dump_json()) == record


def test_the_budget_is_unchanged_and_the_last_reply_counts_as_it_is() -> None:
    record, _ = play(env_of("look_before_report"), WALK, WALK, WALK, WALK, DONE)
    assert (record.end, record.steps[-1].is_unconfirmed) == ("report", False)
    silent, _ = play(env_of("look_before_report"), WALK, WALK, WALK, DONE, WALK)
    assert (silent.end, silent.steps[3].is_unconfirmed) == ("fail_no_report", True)
    assert protocol_violations(TASK, silent) == []
    late, _ = play(env_of("look_before_report"), WALK, WALK, WALK, DONE, FAIL)
    assert (late.end, score(TASK, late).reported) == ("report", "fail")


def test_a_row_that_marks_another_step_as_unconfirmed_contradicts_the_protocol() -> None:
    record, _ = play(env_of("baseline"), WALK, DONE)
    walk, report = record.steps
    marked = record.model_copy(update={"steps": (walk.model_copy(update={"is_unconfirmed": True}), report)})
    assert "marked as a report to be confirmed" in " ".join(protocol_violations(TASK, marked))
    open_end = record.model_copy(update={"steps": (walk, report.model_copy(update={"is_unconfirmed": True}))})
    assert "its last action is not a report" in " ".join(protocol_violations(TASK, open_end))


def test_the_baseline_shows_nothing_new_and_its_rows_have_no_new_keys() -> None:
    record, seen = play(env_of("baseline"), CLICK, PROSE, DONE)
    assert [one.cues for one in seen] == [None] * 3
    text = record.model_dump_json()
    assert not [key for key in ("fork", "criteria", "is_unconfirmed", "has_report") if f'"{key}"' in text]
    assert len(record.steps) == 3


def test_the_remaining_steps_count_down_to_the_last_reply() -> None:
    _, seen = play(env_of("remaining_steps"), WALK, PROSE, WALK, WALK, WALK)
    assert [one.cues for one in seen] == [Cues(remaining_steps=left) for left in (5, 4, 3, 2, 1)]


def test_the_next_frame_marks_the_click_and_no_other() -> None:
    env = env_of("grounding_echo")
    frames, observation = [], env.reset(TASK)
    for answer in (WALK, CLICK, CLICK, WALK, PROSE):
        assert observation is not None
        frames.append(observation.rgb)
        observation = env.step(answer)
    marks = [np.argwhere((frame != frame[0, 0]).any(axis=2)) for frame in frames]
    assert [len(mark) > 0 for mark in marks] == [False, False, True, True, False]
    assert np.abs(marks[2].mean(axis=0) - (50, 100)).max() < 0.5
    assert (frames[2][50, 100] == frames[2][0, 0]).all()  # the pixel itself stays as it is
    digests = [step.frame_sha256 for step in env.record().steps]
    assert digests[2] != digests[1]


def test_recorded_steps_are_shown_and_read_under_their_own_profile() -> None:
    source, _ = play(env_of("look_before_report"), CLICK, DONE, FAIL)
    env = env_of("grounding_echo", recorded_profile=Profile(name=PROFILE_NAMES["look_before_report"]))
    observation = env.reset(TASK, 2)
    for step in source.steps[:2]:
        assert observation is not None
        observation = env.replay(step)
    assert observation is not None
    assert observation.cues is None
    assert env.step(FAIL) is None
    found = env.record()
    assert found.steps[:2] == source.steps[:2]
    assert isinstance(found.steps[1].action, Report)
    assert found.end == "report"


def test_recorded_steps_of_another_profile_are_refused_with_advice() -> None:
    source, _ = play(env_of("look_before_report"), DONE, FAIL)
    env = env_of("grounding_echo")  # as for a fork of a fork, whose header has only the profile of its own source
    env.reset(TASK, 1)
    with pytest.raises(
        RecordError, match=r"differs in is_unconfirmed\. If the run itself continues a run with another"
    ):
        env.replay(source.steps[0])


STOP = reply("stop")


def test_a_stop_ends_the_episode_and_only_w_is_scored() -> None:
    record, seen = play(env_of("stop_only"), WALK, STOP)
    assert (record.end, record.has_report, protocol_violations(TASK, record)) == ("stop", False, [])
    assert [one.cues for one in seen] == [None, None]
    found = score(TASK, record)
    assert (found.W, found.label, found.category, found.reported, found.true_report) == (
        False,
        None,
        None,
        None,
        "fail",
    )
    assert EpisodeRecord.model_validate_json(record.model_dump_json()) == record
    rates = summarise(RunScores((found,)))["overall"]
    assert {name for name in RATES if rates[name] is not None} == {"W", "W_strict"}
    assert set(rates["report_policies"].values()) == {None}


def test_a_report_is_not_an_action_without_reports_nor_a_stop_with_them() -> None:
    silent, _ = play(env_of("stop_only"), DONE, WALK, WALK, WALK, WALK)
    assert (silent.end, silent.steps[0].invalid and silent.steps[0].invalid.reason) == (
        "fail_no_report",
        "unknown_skill",
    )
    assert score(TASK, silent).label is None
    plain, _ = play(env_of("baseline"), STOP, DONE)
    assert (plain.end, plain.steps[0].invalid and plain.steps[0].invalid.reason) == ("report", "unknown_skill")
    assert "has_report" not in plain.model_dump_json()


def test_a_row_whose_end_does_not_fit_its_profile_contradicts_the_protocol() -> None:
    record, _ = play(env_of("stop_only"), WALK, STOP)
    late = record.model_copy(update={"end": "fail_no_report"})
    assert "a stop ended it" in " ".join(protocol_violations(TASK, late))
    other = record.model_copy(update={"has_report": True})
    assert "its profile has no stops" in " ".join(protocol_violations(TASK, other))
