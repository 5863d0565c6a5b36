"""Env: budgets, the two counters, how episodes end, feedback, frames, and that nothing hidden gets out."""

import json
from datetime import UTC, datetime, timedelta
from itertools import count
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.bare_house import bare_house
from tests.support.builders import episode, thing
from tests.support.scripted_simulator import ScriptedSimulator
from vigil.base.geometry import Pose, Vec3
from vigil.base.versions import Versions
from vigil.env import Env
from vigil.errors import HouseError
from vigil.protocol.actions import InteractPixel, Navigate, Reply, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.observation import Feedback, Observation
from vigil.protocol.profile import ACTION_FEEDBACK, Profile
from vigil.protocol.prompt import frame_stub, past_turn, rendered_sha256, system_prompt
from vigil.protocol.world import Effect, ObjectSetup, Setup
from vigil.records.record import EpisodeRecord

FEEDBACK = Profile(name=ACTION_FEEDBACK)


def reply(skill: str, **arguments: Any) -> Reply:
    return Reply(text=json.dumps({"skill_name": skill, "arguments": arguments}))


WALK = reply("navigate", mode="forward", magnitude=1)
DONE = reply("report", status="success", summary="")
PROSE = Reply(text="I am done.")
FLY = reply("fly")


def ticking():
    """A clock that goes on by a second whenever it is read."""
    seconds = count()
    return lambda: datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=next(seconds))


def env_of(simulator: ScriptedSimulator, profile: Profile | None = None) -> Env:
    return Env(simulator, lambda _: bare_house(), profile or Profile(), ticking())


def stand_in(**facts: Any) -> ScriptedSimulator:
    return ScriptedSimulator({"target": thing(), "obstacle": thing(), "table": thing()}, **facts)


class Broken(ScriptedSimulator):
    """A simulator whose numbers are none from the second look on."""

    looks = 0

    def world(self, object_ids):
        self.looks += 1
        if self.looks > 1:
            thing(box_distance_m=float("nan"))
        return super().world(object_ids)


class Picky(ScriptedSimulator):
    """A simulator that refuses the house `other`, which has become its scene by then."""

    def load(self, house):
        super().load(house)
        if house.name == "other":
            raise HouseError("no floor")


def test_a_number_that_is_none_ends_the_episode_as_an_error():
    record = play(env_of(Broken({"target": thing()})), episode("AI"), [WALK])
    assert (record.end, record.steps) == ("error", ())
    assert record.error is not None
    assert "ObjectState.box_distance_m: Input should be a finite number" in record.error.message
    assert EpisodeRecord.model_validate_json(record.model_dump_json()) == record


def test_a_record_says_under_which_versions_it_was_played():
    assert play(env_of(stand_in()), episode(), [DONE]).versions == Versions.current() != Versions()


def test_the_setup_of_an_episode_is_set_up():
    simulator = stand_in()
    setup = Setup(objects={"target": ObjectSetup(is_toggled=True)})
    env_of(simulator).reset(episode(setup=setup))
    assert simulator.setup == setup


def play(env: Env, task: Episode, replies: list[Reply]) -> EpisodeRecord:
    observation = env.reset(task)
    for answer in replies:
        assert observation is not None
        observation = env.step(answer)
    assert observation is None
    return env.record()


@pytest.mark.parametrize("family", FAMILIES)
class TestBudgets:
    def test_the_last_reply_of_the_budget_may_be_a_report(self, family):
        task = episode(family)
        record = play(env_of(stand_in()), task, [WALK] * (task.max_steps - 1) + [DONE])
        assert (record.end, len(record.steps)) == ("report", task.max_steps)

    def test_the_budget_ends_without_a_report(self, family):
        task = episode(family)
        record = play(env_of(stand_in()), task, [WALK] * task.max_steps)
        assert (record.end, len(record.steps)) == ("fail_no_report", task.max_steps)

    def test_the_invalid_action_that_exceeds_the_limit_ends_it(self, family):
        task = episode(family)
        mixed = [(PROSE, FLY)[index % 2] for index in range(task.max_invalid + 1)]
        record = play(env_of(stand_in()), task, mixed)
        assert (record.end, len(record.steps)) == ("invalid_action_limit_exceeded", task.max_invalid + 1)
        kinds = [step.invalid.kind for step in record.steps if step.invalid]
        assert kinds[:2] == ["protocol_failure", "malformed_action"]

    def test_as_many_invalid_actions_as_the_limit_are_borne(self, family):
        task = episode(family)
        assert play(env_of(stand_in()), task, [PROSE] * task.max_invalid + [DONE]).end == "report"


def test_when_both_ends_fall_together_the_invalid_limit_wins():
    task = episode("PG", max_steps=4)
    assert play(env_of(stand_in()), task, [PROSE] * 4).end == "invalid_action_limit_exceeded"
    assert play(env_of(stand_in()), task, [WALK] + [PROSE] * 3).end == "fail_no_report"


def test_an_invalid_action_uses_up_a_step_and_leaves_the_scene_alone():
    simulator = stand_in()
    record = play(env_of(simulator), episode(), [WALK, PROSE, FLY, DONE])
    assert simulator.actions == [Navigate(mode="forward", magnitude=1)]
    worlds = record.worlds
    assert worlds[0] != worlds[1] == worlds[2] == worlds[3] == worlds[4]
    first, second, third, last = record.steps
    assert (first.effect, second.effect, third.effect, last.effect) == (Effect(), None, None, None)
    assert (first.invalid, second.action, third.action) == (None, None, None)
    assert isinstance(last.action, Report)
    assert [step.index for step in record.steps] == [1, 2, 3, 4]


def test_a_refused_action_is_a_valid_one():
    task = episode("SV")
    record = play(env_of(stand_in(effects=[Effect(too_far=True, refusal="too_far")] * 5)), task, [WALK] * 5)
    assert record.end == "fail_no_report"
    assert all(step.effect and step.effect.refusal == "too_far" for step in record.steps)


def test_what_the_provider_rejected_is_a_protocol_failure():
    rejected = WALK.model_copy(update={"provider_rejected": True})
    record = play(env_of(stand_in()), episode(), [rejected, DONE])
    assert record.steps[0].invalid is not None
    assert record.steps[0].invalid.reason == "provider_rejected"


def test_the_lenient_policy_is_part_of_the_profile():
    fenced = Reply(text=f"```json\n{DONE.text}\n```")
    assert play(env_of(stand_in(), Profile(reply_policy="lenient")), episode(), [fenced]).end == "report"
    strict = play(env_of(stand_in()), episode(), [fenced, DONE])
    assert strict.steps[0].invalid is not None
    assert strict.steps[0].invalid.would_parse_leniently


def test_the_coordinate_mode_of_the_profile_decides_where_a_click_falls():
    click = reply("interact_pixel", intent="ground", x=500, y=400)
    for mode, pixel in (("pixel", (500, 400)), ("normalized_1000", (320, 192))):
        simulator = stand_in()
        play(env_of(simulator, Profile.model_validate({"coordinates": mode})), episode(), [click, DONE])
        assert simulator.actions == [InteractPixel(intent="ground", x=pixel[0], y=pixel[1])]


def test_each_episode_starts_with_its_budgets_untouched():
    env, task = env_of(stand_in()), episode("PG")
    for _ in range(3):
        record = play(env, task, [PROSE] * task.max_invalid + [DONE])
        assert (record.end, len(record.steps)) == ("report", task.max_invalid + 1)


def test_what_an_episode_binds_is_recorded_at_every_moment():
    task = episode("CR", bindings={"target": "target", "shelf": "table"})
    record = play(env_of(stand_in()), task, [WALK, PROSE, DONE])
    assert [set(world.objects) for world in record.worlds] == [{"target", "obstacle", "table"}] * 4


class TestFeedback:
    EFFECTS = (Effect(too_far=True), Effect(path_blocked=True), Effect())

    def seen(self, profile: Profile) -> list[Feedback | None]:
        env = env_of(stand_in(effects=self.EFFECTS), profile)
        observations = [env.reset(episode())]
        observations += [env.step(answer) for answer in (WALK, WALK, PROSE, WALK)]
        return [observation.feedback for observation in observations if observation]

    def test_the_intervention_tells_two_booleans_after_each_action(self):
        none, far, blocked, invalid, plain = self.seen(FEEDBACK)
        assert none is None
        assert far == Feedback(too_far=True, path_blocked=False)
        assert blocked == Feedback(too_far=False, path_blocked=True)
        assert invalid == plain == Feedback(too_far=False, path_blocked=False)

    def test_the_baseline_tells_nothing_and_the_record_has_it_all_the_same(self):
        assert self.seen(Profile()) == [None] * 5
        env = env_of(stand_in(effects=self.EFFECTS))
        record = play(env, episode(), [WALK, WALK, DONE])
        assert [step.effect.too_far for step in record.steps if step.effect] == [True, False]


class TestFrames:
    def test_nothing_is_drawn_until_somebody_looks(self):
        simulator = stand_in()
        record = play(env_of(simulator), episode(), [WALK, WALK, DONE])
        assert "frame" not in simulator.calls
        assert [step.frame_sha256 for step in record.steps] == [None] * 3

    def test_a_frame_is_drawn_once_and_its_hash_recorded(self):
        simulator = stand_in()
        env = env_of(simulator)
        first = env.reset(episode())
        assert first is not None
        assert first.rgb.shape == (480, 640, 3)
        assert np.array_equal(first.rgb, first.rgb)
        second = env.step(WALK)
        assert second is not None
        assert second.rgb[0, 0, 0] == 1
        env.step(DONE)
        hashes = [step.frame_sha256 for step in env.record().steps]
        assert simulator.calls.count("frame") == 2
        assert None not in hashes
        assert len(set(hashes)) == 2

    def test_a_stale_frame_is_refused(self):
        env = env_of(stand_in())
        stale = env.reset(episode())
        last = env.step(WALK)
        assert stale is not None
        assert last is not None
        with pytest.raises(RuntimeError, match="has changed"):
            _ = stale.rgb
        env.step(DONE)
        with pytest.raises(RuntimeError, match="has changed"):
            _ = last.rgb

    def test_a_frame_of_an_episode_that_broke_off_or_gave_way_to_another_is_refused(self):
        env = env_of(stand_in())
        first = env.reset(episode())
        env.fail("model", "gone")
        assert first is not None
        with pytest.raises(RuntimeError, match="has changed"):
            _ = first.rgb
        env.reset(episode(id="other"))
        with pytest.raises(RuntimeError, match="has changed"):
            _ = first.rgb


class TestFailures:
    @pytest.mark.parametrize("call", ["load", "reset", "world"])
    def test_a_simulator_that_fails_at_the_reset_ends_the_episode(self, call):
        env = env_of(stand_in(fails_at=call))
        assert env.reset(episode()) is None
        record = env.record()
        assert (record.end, record.initial, record.steps) == ("error", None, ())
        assert record.error is not None
        assert (record.error.boundary, record.error.message) == ("simulator", f"{call} broke")

    def test_a_step_on_which_the_simulator_fails_is_no_step(self):
        simulator = stand_in()
        env = env_of(simulator)
        env.reset(episode())
        env.step(WALK)
        simulator.fails_at = "step"
        assert env.step(WALK) is None
        assert (env.record().end, len(env.record().steps)) == ("error", 1)

    def test_a_model_that_fails_ends_the_episode_at_its_boundary(self):
        env = env_of(stand_in())
        env.reset(episode())
        env.fail("model", "503")
        record = env.record()
        assert record.error is not None
        assert (record.end, record.error.boundary) == ("error", "model")

    def test_an_episode_that_has_ended_stays_as_it_is(self):
        env = env_of(stand_in())
        play(env, episode(), [DONE])
        env.fail("worker", "late")
        assert (env.end, env.record().error) == ("report", None)

    def test_a_broken_scene_is_loaded_afresh(self):
        simulator = stand_in()
        env = env_of(simulator)
        play(env, episode(), [DONE])
        play(env, episode(), [DONE])
        assert simulator.calls.count("load") == 1
        env.reset(episode())
        env.fail("simulator", "hung")
        play(env, episode(), [DONE])
        assert simulator.calls.count("load") == 2

    def test_a_load_that_failed_is_tried_again(self):
        simulator = stand_in(fails_at="load")
        env = env_of(simulator)
        assert env.reset(episode()) is None
        simulator.fails_at = ""
        assert play(env, episode(), [DONE]).end == "report"
        assert simulator.calls.count("load") == 2

    def test_a_house_that_is_refused_leaves_no_other_one_believed_loaded(self):
        houses = [bare_house(), bare_house("other")]
        simulator = Picky({"target": thing()})
        env = Env(simulator, lambda task: houses[task.id == "other"], Profile(), ticking())
        play(env, episode(), [DONE])
        with pytest.raises(HouseError):
            env.reset(episode(id="other"))
        play(env, episode(), [DONE])
        assert simulator.calls.count("load") == 3

    def test_another_house_is_loaded(self):
        houses = [bare_house(), bare_house("other")]
        simulator = stand_in()
        env = Env(simulator, lambda task: houses[task.id == "other"], Profile(), ticking())
        for name in ("e", "other", "other", "e"):
            play(env, episode(id=name), [DONE])
        assert simulator.calls.count("load") == 3

    def test_a_model_that_fails_leaves_the_scene_loaded(self):
        simulator = stand_in()
        env = env_of(simulator)
        env.reset(episode())
        env.fail("model", "503")
        play(env, episode(), [DONE])
        assert simulator.calls.count("load") == 1

    def test_misuse_is_told(self):
        env = env_of(stand_in())
        with pytest.raises(RuntimeError, match="Call reset first"):
            env.step(WALK)
        env.reset(episode())
        with pytest.raises(RuntimeError, match="not ended"):
            env.record()
        env.step(DONE)
        with pytest.raises(RuntimeError, match="Call reset first"):
            env.step(WALK)


def test_the_record_names_run_prompt_and_times():
    env = env_of(stand_in())
    play(env, episode(), [WALK, DONE])
    record = env.record(run_id="r", epoch=2, attempt=3)
    assert (record.run_id, record.key, record.attempt) == ("r", ("e", 2), 3)
    assert (env.record().run_id, env.record().key, env.record().attempt) == ("", ("e", 1), 1)
    assert record.prompt_sha256 == rendered_sha256("Do it.", Profile())
    assert record.ended - record.started == timedelta(seconds=1)
    assert EpisodeRecord.model_validate_json(record.model_dump_json()) == record


def test_without_a_clock_of_its_own_an_env_notes_the_time_in_utc():
    before = datetime.now(UTC)
    record = play(Env(stand_in(), lambda _: bare_house(), Profile()), episode(), [DONE])
    assert before <= record.started <= record.ended <= datetime.now(UTC)
    assert record.started.tzinfo is UTC


def test_before_the_first_episode_there_is_no_end_and_no_record():
    env = env_of(stand_in())
    assert env.end is None
    with pytest.raises(RuntimeError, match="not ended"):
        env.record()


def test_an_env_closes_its_simulator():
    simulator = stand_in()
    with env_of(simulator) as env:
        env.reset(episode())
        assert "close" not in simulator.calls
    assert simulator.calls.count("close") == 1


def test_the_keys_that_were_ignored_are_recorded():
    odd = reply("navigate", mode="forward", magnitude=1, speed=3)
    assert [step.ignored_keys for step in play(env_of(stand_in()), episode(), [odd, PROSE, DONE]).steps] == [
        ("arguments.speed",),
        (),
        (),
    ]


def test_what_the_history_cuts_is_recorded():
    long = Reply(text=DONE.text[:-1] + ', "thought": "' + "x" * 4000 + '"}')
    assert [step.history_cut for step in play(env_of(stand_in()), episode(), [WALK, long]).steps] == [False, True]


def test_two_plays_of_the_same_replies_give_equal_records():
    replies = [WALK, PROSE, FLY, WALK, DONE]
    first, second = (play(env_of(stand_in()), episode(), replies) for _ in range(2))
    assert first == second


@given(st.lists(st.binary(max_size=40) | st.text(max_size=40) | st.sampled_from([WALK.text, FLY.text, DONE.text])))
def test_whatever_an_agent_says_the_episode_goes_on_or_ends_in_exactly_one_way(texts: list[str | bytes]):
    env = env_of(stand_in())
    task = episode("PG")
    observation = env.reset(task)
    for text in texts:
        if observation is None:
            break
        observation = env.step(Reply.model_validate({"text": text}))
    assert (observation is None) is (env.end is not None)
    if env.end is not None:
        record = env.record()
        invalid = sum(step.invalid is not None for step in record.steps)
        assert (record.end == "report") is isinstance(record.steps[-1].action, Report)
        assert (record.end == "invalid_action_limit_exceeded") is (invalid > task.max_invalid)
        assert len(record.steps) <= task.max_steps
        assert all((step.action is None) is (step.invalid is not None) for step in record.steps)


def test_nothing_hidden_gets_into_what_an_agent_sees():
    """A canary: every hidden fact is a value that occurs nowhere else; none may come out."""
    task = episode(
        "DA",
        id="canary_7391",
        start=Pose(position=Vec3(73.91, 0.0, 19.37), rotation=137.91, horizon=30.0),
        instruction="Walk to the lamp.",
        max_steps=739,
        max_invalid=193,
    )
    far = Effect(too_far=True, hit="target", moved_m=7.391, blocked_by="Wall|7391", refusal="no_room")
    simulator = stand_in(effects=[far, far])
    simulator.objects["target"] = thing(category="Canary7391", center_distance_m=9.137)
    out: list[str] = [system_prompt(task.instruction, FEEDBACK)]
    env = env_of(simulator, FEEDBACK)
    observation: Observation | None = env.reset(task)
    for answer in (WALK, PROSE, WALK, WALK):
        assert observation is not None
        assert {name for name in Observation.__slots__ if not name.startswith("_")} == {"cues", "feedback"}
        assert observation.cues is None
        out += [frame_stub("current", observation.feedback), *past_turn(observation.feedback, answer.text, FEEDBACK)]
        observation = env.step(answer)
    text = "\n".join(out)
    for canary in ("7391", "73.91", "19.37", "137.91", "7.391", "9.137", "739", "193", "target", "Canary", "no_room"):
        assert canary not in text.replace("Place a held object at target", "").replace("targeting", "")
