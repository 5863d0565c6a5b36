"""Houses that the engine opens by a scene's name, and documents that it refuses."""

import copy
import json

import pytest

from vigil.sim.conformance.reference_house import reference_house


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda house: house["metadata"].update(schema="2.0.0"), "its schema is 2.0.0"),
        (lambda house: house["objects"][0].update(openness=7), "DiningTable|1: openness 7 is not in [0:1]"),
        (lambda house: house["rooms"].append({**house["rooms"][0], "id": "attic"}), "room|1 and attic overlap"),
    ],
    ids=["schema", "openness", "floors"],
)
def test_a_document_without_meaning_is_refused(client, spoil, message: str):
    house = copy.deepcopy(reference_house().data)
    spoil(house)
    assert message in client.fail("CreateHouse", house=house)


def test_unknown_assets_are_said(client, capfd):
    house = copy.deepcopy(reference_house().data)
    house["objects"][0]["assetId"] = "Nonsense_77"
    assert "Nonsense_77" in client.do("CreateHouse", house=house)["vigil"]["note"]
    assert "Nonsense_77" in capfd.readouterr().err
    client.start()
    assert client.do("Pass")["vigil"] == {"house": "house", "notes": 0, "note": ""}


def test_a_named_scene_is_a_generated_house_with_such_a_room(client, monkeypatch):
    monkeypatch.delenv("VIGIL_THOR_SCENES", raising=False)
    client.do("Reset", sceneName="FloorPlan212_physics")
    client.do("Initialize")
    found = client.do("MoveBack") if client.send("MoveAhead")["errorMessage"] else client.do("Pass")
    assert found["sceneName"] == "FloorPlan212_physics"
    assert "other ids" in found["vigil"]["note"]
    assert [room.room_type for room in client.world.editor.scene().rooms] == ["LivingRoom"]
    client.do("Reset", sceneName="FloorPlan_Val1_2")
    assert len(client.world.editor.scene().rooms) == 3


def test_a_named_scene_is_a_house_on_disk_with_such_a_room(client, monkeypatch, tmp_path):
    one = reference_house().data
    other = copy.deepcopy(one)
    other["rooms"][0]["roomType"] = "Bathroom"
    (tmp_path / "two.jsonl").write_text(f"{json.dumps(one)}\n{json.dumps(other)}\n")
    monkeypatch.setenv("VIGIL_THOR_SCENES", str(tmp_path))
    for scene in ("FloorPlan401", "FloorPlan402_physics"):
        assert client.do("Reset", sceneName=scene)["vigil"]["house"] == "two.jsonl:2"
    assert client.do("Reset", sceneName="FloorPlan302")["vigil"]["house"] == "two.jsonl:2"
    assert client.do("Reset", sceneName="FloorPlan301")["vigil"]["house"] == "two.jsonl:1"
    assert "no house has a room of type LivingRoom" in client.fail("Reset", sceneName="FloorPlan201")
    monkeypatch.setenv("VIGIL_THOR_SCENES", str(tmp_path / "none"))
    assert "does not exist" in client.fail("Reset", sceneName="FloorPlan201")
