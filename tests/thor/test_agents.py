"""Several agents in one house: each acts by its number, sees from its place, and holds its own object."""

import pytest


def poses(client) -> list[dict]:
    return [each["agent"]["position"] for each in client.last.metadata["agents"]]


@pytest.fixture
def pair(client):
    client.start(agentCount=2)
    client.stand(3.5, 2.5)
    return client


def test_each_agent_acts_by_its_number_and_has_its_own_answer(pair):
    before = poses(pair)
    assert before[0] != before[1]
    pair.send("RotateRight", agentId=1)
    first, second = pair.last.metadata["agents"]
    assert pair.last.metadata["activeAgentId"] == second["agentId"] == 1
    assert (first["lastAction"], second["lastAction"]) == ("TeleportFull", "RotateRight")
    assert (first["agent"]["rotation"]["y"], second["agent"]["rotation"]["y"]) == (0.0, 90.0)
    assert [image.kind for image in pair.last.images] == ["image", "image"]
    assert pair.last.images[0].data != pair.last.images[1].data
    assert poses(pair) == before
    assert "has 2 agents" in pair.fail("Pass", agentId=2)
    assert "has 2 agents" in pair.fail("Pass", agentId=-1)


def test_agents_stand_in_each_others_way(pair):
    pair.send("TeleportFull", agentId=1, x=3.5, y=0.9, z=3.25, rotation={"y": 180.0}, horizon=0.0, standing=True)
    assert pair.fail("MoveAhead", moveMagnitude=0.5).startswith("Agent 1 is blocking Agent 0 from moving")
    assert "Collided" in pair.fail("Teleport", position={"x": 3.5, "y": 0.9, "z": 3.0})
    places = pair.do("GetReachablePositions", gridSize=0.25)["actionReturn"]
    assert all((each["x"] - 3.5) ** 2 + (each["z"] - 3.25) ** 2 >= 0.4**2 for each in places)
    assert pair.do("MoveAhead")["agent"]["position"]["z"] == pytest.approx(2.75)


def test_an_overlapping_agent_can_walk_away(pair):
    place = {"x": 3.5, "y": 0.9, "z": 2.7}
    pair.send("Teleport", agentId=1, position=place, forceAction=True)
    assert "blocking" in pair.fail("MoveAhead")
    assert pair.do("MoveBack")["agent"]["position"]["z"] == pytest.approx(2.25)


def test_each_agent_holds_its_own_object(pair):
    pair.do("PickupObject", objectId="Apple|1", forceAction=True)
    pair.do("MoveHeldObject", up=0.1, ahead=0.1)
    pair.do("RotateHeldObject", pitch=30.0)
    held = pair.get("Apple|1")
    pair.send("PickupObject", agentId=1, objectId="Mug|1", forceAction=True)
    first, second = pair.last.metadata["agents"]
    assert [each["objectId"] for each in first["inventoryObjects"]] == ["Apple|1"]
    assert [each["objectId"] for each in second["inventoryObjects"]] == ["Mug|1"]
    for agent in (first, second):
        assert {each["objectId"] for each in agent["objects"] if each["isPickedUp"]} == {"Apple|1", "Mug|1"}
    again = pair.get("Apple|1")
    assert again["position"] == pytest.approx(held["position"])
    assert again["rotation"] == pytest.approx(held["rotation"])


def test_what_an_agent_held_may_be_taken_away(pair):
    pair.do("PickupObject", objectId="Apple|1", forceAction=True)
    pair.send("PickupObject", agentId=1, objectId="Apple|1", forceAction=True)
    first, second = pair.last.metadata["agents"]
    assert first["inventoryObjects"] == []
    assert [each["objectId"] for each in second["inventoryObjects"]] == ["Apple|1"]


def test_the_number_of_agents_follows_the_settings(pair):
    pair.send("PickupObject", agentId=1, objectId="Apple|1", forceAction=True)
    pair.do("Initialize", agentCount=1)
    assert len(pair.last.metadata["agents"]) == 1
    assert not pair.get("Apple|1")["isPickedUp"]
    pair.do("Initialize", agentCount=3)
    assert len({tuple(each.values()) for each in poses(pair)}) == 3
    assert "no free place for agent" in pair.fail("Initialize", agentCount=1000)
    assert "agentCount" in pair.fail("Initialize", agentCount=0)
