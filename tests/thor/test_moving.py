"""Walking, turning, looking and teleporting, as AI2-THOR's agent does."""

import pytest

POSE = {"rotation": {"y": 0.0}, "horizon": 0.0, "standing": True}


def test_a_step_is_of_the_grid(client):
    client.stand(3.5, 2.5, yaw=90.0)
    assert client.do("MoveAhead")["agent"]["position"]["x"] == pytest.approx(3.75)
    assert client.do("MoveBack", moveMagnitude=0.5)["agent"]["position"]["x"] == pytest.approx(3.25)
    assert client.do("MoveRight")["agent"]["position"]["z"] == pytest.approx(2.25)
    assert client.do("MoveLeft")["agent"]["position"]["z"] == pytest.approx(2.5)


def test_a_walk_goes_all_the_way_or_not_at_all(client):
    before = client.stand(3.5, 2.5)["agent"]
    assert "is blocking Agent 0 from moving by" in client.fail("MoveAhead", moveMagnitude=3.0)
    assert client.do("Pass")["agent"] == before
    assert "moveMagnitude must be > 0" in client.fail("MoveAhead", moveMagnitude=0)


def test_turns_are_of_the_step_that_was_set(client):
    client.stand(3.5, 2.5)
    assert client.do("RotateRight")["agent"]["rotation"]["y"] == 90.0
    assert client.do("RotateLeft", degrees=30.0)["agent"]["rotation"]["y"] == pytest.approx(60.0)
    assert "degrees" in client.fail("RotateRight", degrees=0)


def test_the_head_turns_between_its_limits_and_no_farther(client):
    client.stand(3.5, 2.5)
    assert client.do("LookDown")["agent"]["cameraHorizon"] == 30.0
    assert client.do("LookDown", degrees=30)["agent"]["cameraHorizon"] == 60.0
    assert client.fail("LookDown", degrees=0.1) == "can't look down beyond 60 degrees below the forward horizon"
    client.stand(3.5, 2.5)
    assert client.fail("LookUp", degrees=31) == "can't look up beyond 30 degrees above the forward horizon"
    assert "multiple of 0.1" in client.fail("LookUp", degrees=1.23)


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ({"x": 3.0, "y": 0.901, "z": 4.65}, "Collided with something"),
        ({"x": 50.0, "y": 0.901, "z": 2.0}, "outside of the rooms"),
        ({"x": 3.5, "y": 1.2, "z": 2.5}, "is not on the floor"),
    ],
)
def test_a_teleport_to_no_place_fails(client, place, message):
    assert message in client.fail("TeleportFull", position=place, **POSE)


def test_a_teleport_needs_no_standing_and_takes_both_forms(client):
    found = client.do("TeleportFull", x=3.5, y=0.901, z=2.5, rotation={"x": 0, "y": 45, "z": 0}, horizon=0.0)
    assert found["agent"]["rotation"]["y"] == 45.0
    assert client.do("Teleport", rotation={"y": 10})["agent"]["position"] == found["agent"]["position"]
    assert "Each horizon must be in" in client.fail("Teleport", horizon=80)


def test_off_the_grid_when_snapping_fails(client):
    client.do("Initialize", snapToGrid=True)
    assert "off the grid" in client.fail("Teleport", position={"x": 3.6, "y": 0.901, "z": 2.5})
    assert client.do("Teleport", position={"x": 3.5, "y": 0.901, "z": 2.5})["agent"]["position"]["x"] == 3.5


def test_steps_keep_to_the_grid_through_the_agent(client):
    client.stand(3.37, 2.61, yaw=90.0)
    client.do("Initialize", snapToGrid=True)
    assert client.do("MoveAhead", moveMagnitude=0.3)["agent"]["position"]["x"] == pytest.approx(3.62)
    assert client.do("MoveBack")["agent"]["position"]["x"] == pytest.approx(3.37)
    assert client.do("MoveRight")["agent"]["position"]["z"] == pytest.approx(2.36)


def test_crouching_lowers_the_camera(client):
    high = client.stand(3.5, 2.5)["cameraPosition"]["y"]
    low = client.do("Crouch")
    assert low["cameraPosition"]["y"] == pytest.approx(high - 0.675)
    assert not low["agent"]["isStanding"]
    assert client.fail("Crouch") == "Already crouching"
    assert client.do("Stand")["cameraPosition"]["y"] == pytest.approx(high)


def test_rotate_look_sets_the_turn_and_the_head_and_nothing_else(client):
    before = client.stand(3.5, 2.5, yaw=30.0)["agent"]
    after = client.do("RotateLook", rotation=90, horizon=31)["agent"]
    assert after == {**before, "rotation": {"x": 0.0, "y": 90.0, "z": 0.0}, "cameraHorizon": 31.0}
    level = client.do("RotateLook")["agent"]
    assert level["rotation"]["y"] == level["cameraHorizon"] == 0.0


def test_a_locobot_has_a_low_camera_and_always_stands(client):
    client.start(agentMode="locobot")
    found = client.do("Teleport", position={"x": 3.5, "y": 0.9, "z": 2.5}, horizon=30.0)
    assert found["cameraPosition"]["y"] == pytest.approx(0.87, abs=0.01)
    assert found["fov"] == 60.0
    assert found["agent"]["isStanding"] is None
    assert "beyond 30 degrees" in client.fail("LookDown")
    assert "cannot stand or crouch" in client.fail("Crouch")
    assert "leave `standing` out" in client.fail("Teleport", horizon=0.0, standing=True)
    client.go_to("Fridge|1")
    client.do("OpenObject", objectId="Fridge|1")
