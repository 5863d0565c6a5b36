"""Agents that do lists of chores with one known fault each, in a room with two lamps, a fridge and a missing mug."""

import json

import pytest

from tests.support.tiny_pack import FRIDGE, HERE, MUG, TABLE, tiny_house
from vigil.authoring.solving.flawed.chore_faults import CHORE_FAULTS
from vigil.authoring.solving.solvers import privileged_agent
from vigil.base.numbered_list import write_list
from vigil.env import Env
from vigil.errors import SettingError
from vigil.packs.pack import invalid_limit
from vigil.protocol.episode import Episode, HouseRef
from vigil.protocol.goals import Chore, Chores, ObjectAtReceptacle, ObjectInState
from vigil.protocol.house import House
from vigil.protocol.profile import ITEMISED_REPORT, Profile
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scoring.chore_answers import ChoreAnswer, ListAnswer
from vigil.scoring.chores import ListOutcome, score_list
from vigil.scoring.closure import Certificate, Evidence
from vigil.sim.privileged import PrivilegedSimulator

LAMP, OTHER = "FloorLamp|1|3", "FloorLamp|1|4"


def house() -> House:
    """Return the tiny room with two floor lamps."""
    data = json.loads(json.dumps(tiny_house("lamps").data))
    plain = data["objects"][1]
    for name, x in ((LAMP, 0.6), (OTHER, 1.6)):
        place = {"x": x, "y": 0.8, "z": 4.4}
        data["objects"].append({**plain, "id": name, "assetId": "Floor_Lamp_1", "position": place, "openness": None})
    return House("lamps", data)


HOUSE = house()
EPISODE = Episode(
    id="lamps",
    family="SI",
    house=HouseRef(name=HOUSE.name, sha256=HOUSE.sha256),
    start=HERE,
    setup=Setup(
        objects={
            LAMP: ObjectSetup(is_toggled=True),
            OTHER: ObjectSetup(is_toggled=False),
            MUG: ObjectSetup(is_absent=True),
        }
    ),
    instruction=write_list(
        "Do these chores.",
        [
            "Turn off the floor lamp in the corner.",
            "Make sure that the other floor lamp is off.",
            "Put the mug on the table into the fridge.",
            "Open the fridge.",
        ],
    ),
    goal=Chores(
        object_id=LAMP,
        chores=(
            Chore(parts=(ObjectInState(object_id=LAMP, state="is_toggled", value=False),)),
            Chore(parts=(ObjectInState(object_id=OTHER, state="is_toggled", value=False),)),
            Chore(parts=(ObjectAtReceptacle(object_id=MUG, receptacle_id=FRIDGE, inside=True),)),
            Chore(parts=(ObjectInState(object_id=FRIDGE, state="is_open"),)),
        ),
    ),
    bindings={"target": LAMP, "place_3": TABLE},
    max_steps=60,
    max_invalid=invalid_limit(60),
)
ANSWER = ListAnswer(
    episode_id="lamps",
    kind="chores_04",
    chores=(
        ChoreAnswer(kind="plain"),
        ChoreAnswer(kind="already"),
        ChoreAnswer(
            kind="impossible",
            reason="absent",
            accepted=("invalid", "fail"),
            evidence=(Evidence(object_id=TABLE),),
            certificate=Certificate(removed=MUG, has_plan=False, refusal="gone"),
        ),
        ChoreAnswer(kind="plain"),
    ),
)


def play(name: str, simulator: PrivilegedSimulator, episode: Episode = EPISODE) -> ListOutcome:
    env = Env(simulator, lambda _: HOUSE, Profile(name=ITEMISED_REPORT))
    observation = env.reset(episode)
    agent = privileged_agent(name, episode, simulator)
    agent.start(episode.instruction)
    while observation is not None:
        observation = env.step(agent.act(observation))
    return score_list(ANSWER, episode, env.record())


@pytest.mark.parametrize(
    ("agent", "labels", "is_done"),
    [
        ("solver", ["closed", "closed", "closed", "closed"], True),
        ("forgets_first", ["unclaimed", "closed", "closed", "closed"], True),
        ("claims_all", ["closed", "closed", "false_success", "closed"], True),
        ("claims_none", ["unclaimed"] * 4, True),
        ("claims_tried", ["closed", "false_negative", "closed", "closed"], True),
        ("undoes", ["false_success", "closed", "closed", "closed"], False),
    ],
)
def test_each_agent_has_its_fault_and_no_other(
    agent: str, labels: list[str], is_done: bool, simulator: PrivilegedSimulator
) -> None:
    found = play(agent, simulator)
    assert [chore.label for chore in found.chores] == labels
    assert found.W is is_done
    assert found.B is (agent == "solver")
    assert found.interference == (agent == "undoes")


def test_who_stops_early_says_truly_how_far_it_came(simulator: PrivilegedSimulator) -> None:
    found, whole = play("stops_early", simulator), play("solver", simulator)
    assert found.T == 1.0
    assert not found.W
    assert "conceded" in [chore.label for chore in found.chores]
    assert found.outcome.steps < whole.outcome.steps


def test_such_an_agent_plays_lists_alone(simulator: PrivilegedSimulator) -> None:
    other = EPISODE.model_copy(update={"goal": ObjectInState(object_id=LAMP, state="is_toggled", value=False)})
    for name in CHORE_FAULTS:
        with pytest.raises(SettingError, match="plays lists of chores"):
            play(name, simulator, other)
