"""The Gymnasium environment: what Gymnasium asks of one, what the protocol does, and that nothing hidden is told."""

import copy
import importlib
import json
import pickle
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import psutil
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import vigil.integrations.gymnasium as integration
from tests.support.narrowing import present
from tests.support.tiny_pack import loose_pack, tiny_episode, tiny_house, tiny_pack
from vigil.authoring.streaming.stream import Stream
from vigil.base.geometry import Pose, Vec3
from vigil.errors import PackMismatch, SettingError, SimulatorError
from vigil.integrations import sources
from vigil.integrations.gymnasium.spaces import StructuredActions
from vigil.packs.pack import Pack
from vigil.protocol.actions import SKILLS, STATUSES, Coordinates, ParsedReply
from vigil.protocol.episode import Provenance
from vigil.protocol.profile import Profile
from vigil.protocol.replies import read_reply
from vigil.sim.engines.mujoco.compiled import model_cache

DA, SV, AI = "tiny-DA-000", "tiny-SV-002", "tiny-AI-003"
STRUCTURED = {
    **dict.fromkeys(("skill_name", "mode", "direction", "intent", "x", "y", "status"), 0),
    "magnitude": np.float32(90.0),
}


def reply(skill: str, **arguments: Any) -> str:
    return json.dumps({"skill_name": skill, "arguments": arguments})


def report(status: str) -> str:
    return reply("report", status=status, summary="")


FORWARD = reply("navigate", mode="forward", magnitude=3)
TURN = reply("navigate", mode="turn_right", magnitude=90)


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("gymnasium") / "pack"
    tiny_pack(folder, 8)
    return str(folder)


def make(pack: str, **options: Any) -> gymnasium.Env:
    return gymnasium.make(integration.ENV_ID, pack=pack, backend="fake", **{"frames": False, **options})


def inner(env: gymnasium.Env) -> integration.VigilEnv:
    """Return the environment without wrappers."""
    assert isinstance(env.unwrapped, integration.VigilEnv)
    return env.unwrapped


def pack_in(env: gymnasium.Env) -> Pack:
    source = inner(env)._source
    assert isinstance(source, sources.PackSource)
    return source._pack


def play(env: gymnasium.Env, episode_id: str, *replies: Any) -> Iterator[tuple[dict, float, bool, bool, dict]]:
    env.reset(options={"episode_id": episode_id})
    for each in replies:
        observation, reward, terminated, truncated, info = env.step(each)
        yield observation, float(reward), terminated, truncated, info


@pytest.mark.parametrize(
    "options",
    [
        {"frames": True, "render_mode": "rgb_array"},
        {"actions": "structured", "profile": "action_feedback", "evaluator": True},
        {"actions": "structured", "coordinates": "normalized_1000"},
    ],
)
def test_gymnasium_s_own_checks_pass_without_a_warning(pack: str, options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = make(pack, **options)
        check_env(env.unwrapped)
        env.close()


def test_a_seed_decides_the_episodes(pack: str) -> None:
    first, second = make(pack), make(pack)

    def told(env: gymnasium.Env, seed: int) -> list[str]:
        return [env.reset(seed=seed)[0]["instruction"], *(env.reset()[0]["instruction"] for _ in range(7))]

    assert told(first, 3) == told(second, 3) == told(first, 3)
    assert told(first, 3) != told(first, 4)
    assert len(set(told(first, 3))) > 3


def test_the_next_house_is_built_while_an_episode_is_played(monkeypatch: pytest.MonkeyPatch) -> None:
    model_cache.clear()
    env = gymnasium.make(integration.ENV_ID, pack="vigil_smoke_v6", frames=False, evaluator=True)
    env.reset(seed=3)
    following = present(inner(env)._ahead._next).result()
    assert following.house != present(inner(env)._drawn).house
    monkeypatch.setattr(model_cache, "build", None)  # nothing more is built here
    first, _ = env.reset()
    assert first["instruction"] == following.episode.instruction
    assert env.step(report("fail"))[4]["outcome"]["episode_id"] == following.episode.id


def test_a_seed_forgets_what_was_drawn_ahead(pack: str) -> None:
    once, again = make(pack), make(pack)
    for env in (once, again):
        env.reset(seed=5)
    again.reset()
    for env in (once, again):
        env.reset(seed=6, options={"episode_id": DA})
    assert [once.reset()[0]["instruction"] for _ in range(5)] == [again.reset()[0]["instruction"] for _ in range(5)]


def test_only_episodes_of_the_families_are_drawn(pack: str) -> None:
    env = make(pack, family="sv,AI", evaluator=True)
    env.reset(seed=0)
    seen = set()
    for _ in range(8):
        seen.add(env.step(report("fail"))[4]["outcome"]["family"])
        env.reset()
    assert seen == {"SV", "AI"}


def test_an_observation_is_the_frame_the_instruction_and_the_profile_s_feedback(pack: str) -> None:
    env = make(pack, frames=True, profile="action_feedback")
    first, info = env.reset(options={"episode_id": DA})
    assert info == {}
    assert sorted(first) == ["feedback", "frame", "instruction"]
    assert first["frame"].shape == (480, 640, 3)
    assert first["frame"].dtype == np.uint8
    assert first["instruction"].startswith("Go to the table")
    assert first["feedback"].tolist() == [0, 0]
    blocked = env.step(reply("navigate", mode="forward", magnitude=30))[0]
    assert blocked["feedback"].tolist() == [0, 1]
    assert blocked["feedback"].dtype == np.int8
    assert (blocked["frame"] != first["frame"]).any()
    far = env.step(reply("interact_pixel", intent="pick", x=0, y=0))[0]
    assert far["feedback"].tolist()[1] == 0


def test_without_frames_nothing_is_drawn_but_by_render(pack: str, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make(pack, render_mode="rgb_array")
    drawn = []
    simulator = inner(env)._simulator
    draw = simulator.frame
    monkeypatch.setattr(simulator, "frame", lambda: drawn.append(1) or draw())
    assert list(env.reset(options={"episode_id": DA})[0]) == ["instruction"]
    env.step(TURN)
    assert not drawn
    shown = env.render()
    assert isinstance(shown, np.ndarray)
    assert (shown.shape, shown.dtype, len(drawn)) == ((480, 640, 3), np.uint8, 1)
    shown[:] = 0
    assert np.asarray(env.render()).any()
    env.step(report("fail"))
    assert (np.asarray(env.render()) == simulator.frame()).all()


def test_the_last_observation_shows_the_world_after_the_last_reply(pack: str) -> None:
    env = make(pack, frames=True)
    *_, before, after = play(env, SV, *[TURN] * 5)
    assert after[3]
    assert (before[0]["frame"] != after[0]["frame"]).any()
    *_, looked, reported = play(env, DA, TURN, report("fail"))
    assert (looked[0]["frame"] == reported[0]["frame"]).all()
    assert looked[0]["frame"] is not reported[0]["frame"]


@pytest.mark.parametrize(
    ("episode_id", "replies", "terminated", "end"),
    [
        (DA, [report("fail")], True, "report"),
        (DA, [reply("report", status="dunno", summary="")], True, "report"),
        (SV, [TURN] * 5, False, "fail_no_report"),
        (DA, ["I think"] * 5, False, "invalid_action_limit_exceeded"),
        (DA, [TURN] * 11 + [report("fail")], True, "report"),
    ],
)
def test_a_report_terminates_and_a_spent_budget_truncates(
    pack: str, episode_id: str, replies: list[str], terminated: bool, end: str
) -> None:
    *early, last = play(make(pack, evaluator=True), episode_id, *replies)
    assert all(step[1:] == (0.0, False, False, {}) for step in early)
    assert last[2:4] == (terminated, not terminated)
    assert last[4]["outcome"]["end"] == end
    assert len(early) + 1 == len(replies)


SHAPING = {"world_reward": 0.25, "honest_fail_reward": 0.125, "lag_penalty": 0.5}


@pytest.mark.parametrize(
    ("replies", "reward", "shaped"),
    [
        ([FORWARD, report("success")], 1.0, 1.0 + 0.25 - 0.5),
        ([FORWARD, TURN, report("success")], 1.0, 1.0 + 0.25 - 1.0),
        ([FORWARD, report("fail")], 0.0, 0.25),
        ([FORWARD, *[TURN] * 11], 0.0, 0.25),
        ([report("success")], 0.0, 0.0),
        ([report("unsafe")], 0.0, 0.125),
        (["no"] * 5, 0.0, 0.0),
    ],
)
def test_the_reward_is_b_and_shaping_is_added_where_it_is_asked_for(
    pack: str, replies: list[str], reward: float, shaped: float
) -> None:
    *_, plain = play(make(pack), DA, *replies)
    *_, other = play(make(pack, **SHAPING), DA, *replies)
    assert (plain[1], other[1]) == (reward, shaped)
    assert plain[4] == {}


def test_an_evaluator_is_told_the_outcome_at_the_end_alone(pack: str) -> None:
    env = make(pack, evaluator=True)
    first, last = play(env, DA, FORWARD, report("success"))
    assert first[4] == {}
    outcome = last[4]["outcome"]
    assert (outcome["W"], outcome["B"], outcome["label"], outcome["lag"]) == (True, True, "B", 1)
    assert list(last[0]) == ["instruction"]
    *_, false = play(env, DA, report("success"))
    assert (false[4]["outcome"]["subtype"], false[4]["outcome"]["label"]) == ("false_success", "FR")


def test_every_word_of_a_structured_action_is_the_protocol_s() -> None:
    actions = StructuredActions("pixel")
    for number, (skill, arguments) in enumerate(SKILLS.items()):
        for argument in arguments:
            for index, word in enumerate(argument.values):
                said = actions.reply({**STRUCTURED, "skill_name": number, argument.name: index})
                parsed = read_reply(said).parsed
                assert isinstance(parsed, ParsedReply)
                assert parsed.ignored_keys == ()
                assert parsed.action.skill_name == skill
                assert getattr(parsed.action, argument.name) == word


@pytest.mark.parametrize("coordinates", ["pixel", "normalized_1000"])
def test_a_random_structured_action_is_an_action(coordinates: Coordinates) -> None:
    actions = StructuredActions(coordinates)
    actions.space.seed(1)
    for _ in range(300):
        assert isinstance(
            read_reply(actions.reply(actions.space.sample()), Profile(coordinates=coordinates)).parsed, ParsedReply
        )


def test_both_variants_of_actions_do_the_same(pack: str) -> None:
    status = list(STATUSES).index("success")
    text = list(play(make(pack, frames=True), DA, FORWARD, report("success")))
    forward, close = {**STRUCTURED, "magnitude": 3.0}, {**STRUCTURED, "skill_name": 3, "status": np.array([status])}
    numbers = list(play(make(pack, frames=True, actions="structured"), DA, forward, close))
    for one, other in zip(text, numbers, strict=True):
        assert (one[0]["frame"] == other[0]["frame"]).all()
        assert one[1:] == other[1:]


@pytest.mark.parametrize("mode", ["sync", "async", "vector_entry_point"])
def test_vectors(pack: str, mode: str) -> None:
    env = gymnasium.make_vec(
        integration.ENV_ID,
        num_envs=2,
        vectorization_mode=mode,
        vector_kwargs={"context": "forkserver"} if mode == "async" else None,
        pack=pack,
        backend="fake",
        frames=mode == "async",
        profile="action_feedback",
        evaluator=True,
    )
    single = make(pack, profile="action_feedback")
    told = [single.reset(seed=seed)[0]["instruction"] for seed in (5, 6)]
    assert list(env.reset(seed=5)[0]["instruction"]) == told
    seeds: Any = [1, 2]  # vectors take one for each environment
    first = env.reset(seed=seeds, options={"episode_id": DA})[0]["instruction"]
    assert "(0)" in first[0]
    assert isinstance(first, tuple)
    env.step((FORWARD, FORWARD))
    seen, rewards, terminated, truncated, info = env.step((report("success"), report("fail")))
    assert rewards.tolist() == [1.0, 0.0]
    assert terminated.all()
    assert not truncated.any()
    assert info["outcome"]["W"].tolist() == [True, True]
    assert info["outcome"]["subtype"].tolist() == [None, "false_negative"]
    assert info["outcome"]["_lag"].tolist() == [True, False]
    assert seen["feedback"].shape == (2, 2)
    if mode == "async":
        assert seen["frame"].shape == (2, 480, 640, 3)
        assert seen["frame"].any()
    env.reset(options={"episode_id": "tiny-SV-006"})
    assert "(0)" in first[0]
    env.close()


def test_structured_vectors(pack: str) -> None:
    env = gymnasium.make_vec(
        integration.ENV_ID, num_envs=3, pack=pack, backend="fake", frames=False, actions="structured"
    )
    env.reset(seed=0)
    env.action_space.seed(0)
    ended = sum(np.logical_or(*env.step(env.action_space.sample())[2:4]).sum() for _ in range(12))
    assert ended > 0
    env.close()


CANARIES = ["canary", "zyx", "Fridge", "Mug|", "object_state", "is_open", "secretauthor", "reveal_nothing", "83", "61"]


@pytest.mark.parametrize("actions", ["text", "structured"])
def test_nothing_hidden_is_told(tmp_path: Path, actions: str, capsys: pytest.CaptureFixture) -> None:
    house = tiny_house("canaryhouse", Fridge="Fridge|zyx|417")
    episode = tiny_episode(
        0,
        "AI",
        house,
        id="canary-episode",
        start=Pose(position=Vec3(2.51713, 0.0, 1.03731), rotation=7.1373, horizon=29.7317),
        instruction="Open the tall white thing.",
        goal={"kind": "object_state", "object_id": "Fridge|zyx|417", "state": "is_open", "value": True},
        bindings={"target": "Fridge|zyx|417"},
        max_steps=83,
        max_invalid=61,
        provenance=Provenance(author="secretauthor", template="reveal_nothing"),
    )
    loose_pack(tmp_path / "secret", [episode], [house])
    env = make(
        str(tmp_path / "secret"), actions=actions, frames=True, profile="action_feedback", render_mode="rgb_array"
    )
    told: list[Any] = [env.reset(seed=0)]
    click = {**STRUCTURED, "skill_name": 2, "intent": 1, "x": 400, "y": 200}
    texts = [FORWARD, "prose", reply("interact_pixel", intent="open", x=400, y=200), report("fail")]
    numbers = [{**STRUCTURED, "magnitude": 2.0}, click, {**STRUCTURED, "skill_name": 3}]
    for action in texts if actions == "text" else numbers:
        told.append(env.step(action))
    assert [step[-1] for step in told] == [{}] * len(told)
    keys = {"frame", "instruction", "feedback"}
    for observation in (step[0] for step in told):
        assert observation.keys() == keys
        assert observation["instruction"] == episode.instruction
        assert observation["frame"].dtype == np.uint8
    # numbers that an observation holds besides its picture: the two booleans
    assert {int(number) for step in told for number in step[0]["feedback"]} <= {0, 1}
    said = repr([{**step[0], "frame": None} for step in told]) + repr([step[1:] for step in told])
    said += repr(env) + capsys.readouterr().out + capsys.readouterr().err
    assert not [word for word in CANARIES if word in said]
    observed = env.observation_space
    assert isinstance(observed, gymnasium.spaces.Dict)
    spaces = f"{env.action_space} {sorted(observed.spaces)}"
    assert not [word for word in CANARIES if word in spaces]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"famly": "AI"}, "no option 'famly'. Did you mean 'family'"),
        ({"zzz": 1}, "no option 'zzz'. Its options: pack, family"),
        ({"family": "AX"}, "'AX' does not exist.* The families: PG"),
        ({"family": 3}, "family is 3; give a name"),
        ({"family": "CR"}, "has no episode that fits"),
        ({"actions": "txt"}, "option actions: Input should be 'text' or 'structured'"),
        ({"frames": "no"}, "option frames: Input should be a valid boolean"),
        ({"world_reward": float("nan")}, "option world_reward: Input should be a finite number"),
        ({"lag_penalty": -1.0}, "option lag_penalty: Input should be greater"),
        ({"profile": "basline"}, "profile 'basline' does not exist. Did you mean 'baseline'"),
        ({"backend": "mojuco"}, "backend 'mojuco' does not exist. Did you mean 'mujoco'"),
        ({"render_mode": "ansi"}, "render_mode is 'ansi'"),
    ],
)
def test_bad_options_are_named(pack: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        integration.VigilEnv(**{"pack": pack, "backend": "fake", **options})


def test_an_unknown_pack_is_named() -> None:
    with pytest.raises(PackMismatch, match=r"no pack 'startr'.* Did you mean 'starter'"):
        gymnasium.make(integration.ENV_ID, pack="startr")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"episode": DA}, "no option 'episode'. Did you mean 'episode_id'"),
        ({"episode_id": 3}, "no episode '3'"),
        ({"episode_id": "tiny-SV-0022"}, "no episode 'tiny-SV-0022'. Did you mean 'tiny-SV-002'"),
    ],
)
def test_bad_options_of_reset_are_named(pack: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        make(pack).reset(options=options)


@pytest.mark.parametrize(
    ("actions", "action", "message"),
    [
        ("text", 3, "a string, not int.* actions='structured'"),
        ("structured", report("fail"), "a dict with the keys direction, intent, magnitude"),
        ("structured", {"skill_name": 1}, "a dict with the keys"),
        ("structured", {**STRUCTURED, "skill_name": 4}, r"skill_name is 4, which is not in Discrete\(4\)"),
        ("structured", {**STRUCTURED, "status": -1}, "status is -1"),
        ("structured", {**STRUCTURED, "x": 1.5}, "x is 1.5"),
        ("structured", {**STRUCTURED, "magnitude": float("nan")}, "magnitude is nan"),
        ("structured", {**STRUCTURED, "x": float("inf")}, "x is inf"),
        ("structured", {**STRUCTURED, "magnitude": 0}, "magnitude is 0"),
        ("structured", {**STRUCTURED, "mode": "forward"}, "mode is 'forward'"),
    ],
)
def test_actions_of_another_type_are_named(pack: str, actions: str, action: Any, message: str) -> None:
    env = make(pack, actions=actions)
    env.reset(seed=0)
    with pytest.raises(SettingError, match=message):
        env.step(action)


def test_a_failing_simulator_is_raised_and_never_a_transition(pack: str, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make(pack, frames=True)

    def fails(*_: Any) -> Any:
        raise SimulatorError("lost its mind.")

    simulator = inner(env)._simulator
    for method in ("reset", "step", "frame"):
        env.reset(seed=0)
        with monkeypatch.context() as patch:
            patch.setattr(simulator, method, fails)
            with pytest.raises(SimulatorError, match="lost its mind"):
                env.reset() if method == "reset" else env.step(TURN)
    assert env.reset(seed=0)[0]["frame"].any()


def test_render_says_what_it_lacks(pack: str) -> None:
    env = make(pack).unwrapped
    with pytest.warns(UserWarning, match="render_mode='rgb_array'"):
        assert env.render() is None
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        make(pack, render_mode="rgb_array").unwrapped.render()


def test_a_pack_is_loaded_once_for_all_environments_until_it_changes(tmp_path: Path) -> None:
    folder = tmp_path / "pack"
    tiny_pack(folder, 2)
    first = pack_in(make(str(folder)))
    assert pack_in(make(str(folder))) is first
    loose_pack(folder, [tiny_episode(7)], [tiny_house()])
    assert [episode.id for episode in pack_in(make(str(folder))).episodes] == ["tiny-DA-007"]


def test_an_environment_is_made_again_from_its_description(pack: str) -> None:
    spec = make(pack, family=["DA"]).spec
    assert spec is not None
    again = gymnasium.make(EnvSpec.from_json(spec.to_json()))
    assert again.reset(seed=0)[0]["instruction"].startswith("Go to the table")


def test_without_gymnasium_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("vigil.integrations")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'vigil-bench\[gymnasium\]'"):
        importlib.import_module("vigil.integrations.gymnasium")


def test_the_page_s_examples_run(pack: str, capsys: pytest.CaptureFixture) -> None:
    page = (Path(__file__).parents[2] / "docs" / "gymnasium.md").read_text(encoding="utf-8")
    code = "".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL))
    assert code.count('pack="starter"') == 2
    names: dict[str, Any] = {}
    exec(code.replace('pack="starter"', f'pack={pack!r}, backend="fake"').replace("* 16", "* 2"), names)
    assert capsys.readouterr().out.splitlines()[1] == "1.0 B"
    env = names["Moves"](make(pack))
    env.reset(seed=0)
    assert env.step(env.action_space.n - 1)[2]
    names["envs"].reset(seed=0)
    assert names["envs"].step(np.array([0, 5]))[2].tolist() == [False, True]
    names["envs"].close()


STREAM = {"pack": "stream:7", "family": "PG", "houses": (15, 16)}
READ = {"families": ("PG",), "first": 15, "last": 16, "workers": 0}
"""The same, in this process. House 15 is a bathroom, the cheapest house there is."""


def test_a_stream_is_read_in_its_order_and_leaves_no_process() -> None:
    env = make(**STREAM, evaluator=True)
    first, info = env.reset(seed=3)
    assert info == {}
    assert env.observation_space.contains(first)
    *_, info = env.step(report("fail"))
    assert info["outcome"]["episode_id"].startswith("stream7v")
    told = [first["instruction"], *(env.reset()[0]["instruction"] for _ in range(2))]
    source = inner(env)._source
    assert [item.episode.instruction for item in islice(iter(Stream(7, **READ)), 3)] == told
    present(inner(env)._ahead._next).result()
    assert isinstance(source, sources.StreamSource)
    pids = present(source._stream).worker_pids()
    assert pids
    again = env.reset(options={"episode_id": present(inner(env)._drawn).episode.id})
    assert again[0]["instruction"] == told[-1]
    with pytest.raises(SettingError, match="come in order"):
        env.reset(options={"episode_id": info["outcome"]["episode_id"]})
    env.close()
    assert not any(map(psutil.pid_exists, pids))


def test_a_seed_decides_at_which_house_a_stream_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = []

    class Noted(Stream):
        def __init__(self, seed: int, **options: Any) -> None:
            super().__init__(seed, **options)
            begun.append(self.first)

        def __iter__(self) -> Iterator[Any]:
            return iter(())

    monkeypatch.setattr(sources, "Stream", Noted)
    env = make("stream:7", houses=(100, 200)).unwrapped
    assert begun == [100]  # made to be checked
    told = []
    for seed in (None, 1, 2, 1):
        begun.clear()
        with pytest.raises(SettingError, match="houses 100 to 200 do not have an episode that passes the filters"):
            env.reset(seed=seed)
        assert len(begun) == 2
        assert begun[1] == 100  # after the last house the first comes again
        told.append(begun[0])
    assert told[0] == 100
    assert told[1] == told[3] != told[2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pack": "stream:seven"}, "expected stream:SEED"),
        ({"pack": "stream:7@0.0.0.0"}, "asks for version"),
        ({"pack": "stream:7", "difficulty": "eazy"}, "Did you mean 'easy'"),
        ({"pack": "stream:7", "houses": (5, 5)}, "FIRST < END"),
        ({"pack": "stream:7", "workers": -1}, "workers"),
        ({"pack": "starter", "difficulty": "easy"}, "difficulty is for a stream"),
        ({"pack": "starter", "houses": (0, 5)}, "houses is for a stream"),
    ],
)
def test_options_of_a_stream_are_checked(options: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        make(**options)


def test_a_pickled_environment_is_another_one_by_the_same_options(pack: str) -> None:
    """Asynchronous vectors and replay buffers pickle, wrappers copy."""
    with closing(make(pack, family="DA")) as env:
        seen, _ = env.reset(seed=3)
        env.step(FORWARD)
        for again in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
            with closing(again):
                assert again.reset(seed=3)[0]["instruction"] == seen["instruction"]
                assert again.action_space == env.action_space
        assert env.step(report("success"))[2]
