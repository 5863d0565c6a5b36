"""Env under the profile in which an agent names objects: what it gets, and that refusals are the same."""

from collections.abc import Iterator

import numpy as np
import pytest

from tests.support.builders import episode
from tests.test_env import reply
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3
from vigil.env import Env
from vigil.errors import SettingError
from vigil.protocol.actions import InteractPixel, Reply
from vigil.protocol.episode import Episode
from vigil.protocol.goals import OBSERVABLE_M, OBSERVABLE_PX, ObjectHeld, is_observable
from vigil.protocol.observation import Observation
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import PROFILE_NAMES
from vigil.protocol.prompt import frame_stub, policy_text
from vigil.protocol.world import Effect
from vigil.records.record import EpisodeRecord
from vigil.sim.conformance.reference_house import DRAWER, SIBLING, reference_house
from vigil.sim.core.embedded import EmbeddedSimulator
from vigil.sim.core.naming import IN_VIEW_M, IN_VIEW_PX
from vigil.sim.engines.fake import FakeEngine

NAMED = Profile(name=PROFILE_NAMES["named_objects"])
TABLE = Pose(position=Vec3(1.8, 0.0, 3.2), rotation=180, horizon=30)
"""Pose in reach of a table with one apple, one mug, and one bowl with an egg."""
TWO_LAMPS = Pose(position=Vec3(8.0, 0.0, 2.2), rotation=180, horizon=20)
"""Pose that sees the floor lamp and the desk lamp of the bedroom."""


def task(start: Pose = TABLE) -> Episode:
    goal = ObjectHeld(kind="object_held", object_id="Mug|1")
    return episode("AI", start=start, goal=goal, bindings={"target": "Mug|1"})


def named(intent: str, **arguments: str) -> Reply:
    return reply("interact_object", intent=intent, **arguments)


@pytest.fixture(scope="module")
def simulator() -> EmbeddedSimulator:
    return EmbeddedSimulator(FakeEngine(), AssetDatabase.default())


def test_a_simulator_that_cannot_find_names_is_refused_at_once(simulator: EmbeddedSimulator) -> None:
    class Nameless:
        name = "nameless"

    with pytest.raises(SettingError, match="simulator 'nameless' cannot find objects by their names"):
        Env(Nameless(), lambda _: reference_house(), NAMED)  # pyright: ignore[reportArgumentType]
    Env(simulator, lambda _: reference_house(), NAMED)


def play(simulator: EmbeddedSimulator, *replies: Reply, start: Pose = TABLE) -> tuple[EpisodeRecord, list[Observation]]:
    env = Env(simulator, lambda _: reference_house(), NAMED)
    return next(_plays(env, start, replies))


def _plays(env: Env, start: Pose, replies: tuple[Reply, ...]) -> Iterator[tuple[EpisodeRecord, list[Observation]]]:
    observation, seen = env.reset(task(start)), []
    for answer in (*replies, reply("report", status="fail", summary="")):
        assert observation is not None
        _ = observation.rgb
        seen.append(observation)
        observation = env.step(answer)
    yield env.record(), seen


def test_the_only_object_of_a_name_in_view_is_acted_on(simulator: EmbeddedSimulator) -> None:
    record, _ = play(simulator, named("ground", object="the Apple"), named("pick", object="mug"), named("drop"))
    ground, pick, drop, _ = record.steps
    assert isinstance(ground.action, InteractPixel)
    assert (ground.action.object, ground.effect and ground.effect.hit) == ("the Apple", "Apple|1")
    assert (pick.effect and pick.effect.changed, pick.world.held) == (("Mug|1",), "Mug|1")
    assert isinstance(drop.action, InteractPixel)
    assert (drop.action.object, drop.world.held) == (None, None)
    assert EpisodeRecord.model_validate_json(record.model_dump_json()) == record


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("fridge", id="in the house, behind the agent"),
        pytest.param("lettuce", id="in the house, inside something closed"),
        pytest.param("television", id="not in the house"),
        pytest.param("gzorp", id="not a word"),
        pytest.param("", id="empty"),
        pytest.param("Mug|1", id="an id"),
        pytest.param("room|1", id="a room"),
    ],
)
@pytest.mark.parametrize("intent", ["ground", "open_access", "pick", "place"])
def test_every_name_that_means_nothing_in_view_is_refused_alike(
    simulator: EmbeddedSimulator, name: str, intent: str
) -> None:
    record, seen = play(simulator, named(intent, object=name))
    step = record.steps[0]
    assert isinstance(step.action, InteractPixel)
    assert (step.invalid, step.action.x, step.action.y) == (None, None, None)
    assert step.effect == Effect(refusal="nothing_hit")
    assert step.world == record.initial
    assert_nothing_is_said(seen)


def test_an_ambiguous_name_is_refused_as_one_that_is_not_there(simulator: EmbeddedSimulator) -> None:
    alone, _ = play(simulator, named("ground", object="desk lamp"), start=TWO_LAMPS)
    assert alone.steps[0].effect
    assert alone.steps[0].effect.hit == "DeskLamp|1"
    several, seen = play(simulator, named("ground", object="drawer"), start=TWO_LAMPS)
    drawers = simulator.world([DRAWER, SIBLING]).objects.values()
    assert [is_observable(drawer) for drawer in drawers] == [True, True]
    absent, other = play(simulator, named("ground", object="gzorp"), start=TWO_LAMPS)
    assert several.steps[0].effect == absent.steps[0].effect == Effect(refusal="nothing_hit")
    assert [stub(one) for one in seen] == [stub(one) for one in other]
    assert_nothing_is_said(seen)


def test_what_is_held_cannot_be_named(simulator: EmbeddedSimulator) -> None:
    record, _ = play(simulator, named("pick", object="mug"), named("ground", object="mug"))
    assert record.steps[1].effect == Effect(refusal="nothing_hit")


def test_in_view_means_observable() -> None:
    assert (IN_VIEW_PX, IN_VIEW_M) == (OBSERVABLE_PX, OBSERVABLE_M)


def test_pixels_are_not_actions_and_the_prompt_does_not_speak_of_them(simulator: EmbeddedSimulator) -> None:
    record, _ = play(
        simulator,
        reply("interact_pixel", intent="ground", x=1, y=1),
        named("ground"),
        reply("interact_object", intent="ground", object=3),
    )
    reasons = [step.invalid and step.invalid.reason for step in record.steps[:3]]
    assert reasons == ["unknown_skill", "missing_argument", "ill_typed"]
    for coordinates in ("pixel", "normalized_1000"):
        text = policy_text(NAMED.model_copy(update={"coordinates": coordinates}))
        assert not [word for word in ("pixel", "x, y", "normalized") if word in text]
        assert "requires object" in text


def stub(one: Observation) -> str:
    return frame_stub("current", one.feedback, one.cues)


def assert_nothing_is_said(seen: list[Observation]) -> None:
    """Assert that the observation after the first reply is that before it, to the byte."""
    first, second, *_ = seen
    assert (second.feedback, second.cues) == (first.feedback, first.cues) == (None, None)
    assert np.array_equal(first.rgb, second.rgb)
