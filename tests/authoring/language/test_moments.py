"""What is kept of a scene's things for the moment: always what would be said of them anew."""

from dataclasses import fields

import pytest

from vigil.assets.database import AssetDatabase
from vigil.authoring.drafting.house_context import phrase_finder
from vigil.authoring.language import referring
from vigil.authoring.language.referring import items_as_seen, items_of, phrase_for
from vigil.base.geometry import Vec3
from vigil.packs.pack import Pack
from vigil.scene.build import build_scene
from vigil.scene.things import Scene, Thing

BUILT = {"id", "category", "asset", "is_pickupable", "is_openable", "is_toggleable", "is_receptacle", "is_structure"}
"""What of a thing is settled when its scene is built, besides whether it is a part."""
CHANGES = {
    "position": Vec3(0.5, 0.8, 0.5),
    "rotation": Vec3(0.0, 77.0, 0.0),
    "parent": None,
    "openness": 0.7,
    "is_toggled": True,
    "is_broken": True,
    "is_held": True,
    "from_hand": Vec3(0.0, 0.1, 0.0),
    "is_present": False,
    "parent_joint": "door",
    "surface": None,
}
"""Everything that may change of a thing -> another value."""


@pytest.fixture
def scene(starter: Pack) -> Scene:
    episode = max(starter.episodes, key=lambda each: len(starter.house_of(each).document.rooms))
    return build_scene(starter.house_of(episode), AssetDatabase.default())


def test_every_change_of_a_thing_is_tried() -> None:
    assert {field.name for field in fields(Thing)} == BUILT | {"is_drawer"} | set(CHANGES)


@pytest.mark.parametrize("name", CHANGES)
def test_what_is_said_is_never_of_another_moment(scene: Scene, name: str) -> None:
    for thing in [each for each in scene.things.values() if name != "parent" or not each.is_drawer]:
        before = getattr(thing, name)
        items_of(scene)
        items_as_seen(scene)
        setattr(thing, name, CHANGES[name])
        assert items_of(scene) == referring._items_now.__wrapped__(scene), thing.id
        assert items_as_seen(scene) == referring._items_as_seen_now.__wrapped__(scene), thing.id
        setattr(thing, name, before)


def test_the_same_moment_is_described_once(scene: Scene) -> None:
    first = items_as_seen(scene)
    thing = next(iter(scene.things.values()))
    thing.position, place = Vec3(0.5, 0.8, 0.5), thing.position
    assert items_as_seen(scene) != first
    thing.position = place
    assert all(item is first[name] for name, item in items_as_seen(scene).items())


def test_who_changes_what_was_told_changes_no_later_answer(scene: Scene) -> None:
    count = len(items_as_seen(scene))
    items_as_seen(scene).clear()
    items_of(scene).clear()
    assert len(items_as_seen(scene)) == len(items_of(scene)) == count


def test_equal_scenes_have_no_moment_in_common(starter: Pack, scene: Scene) -> None:
    assert referring.description_key(scene) == referring.description_key(scene)
    assert referring.description_key(scene) != referring.description_key(
        build_scene(starter.house_of(starter.episodes[0]), AssetDatabase.default())
    )


def test_phrases_are_those_of_the_moment(scene: Scene) -> None:
    for thing in [thing for thing in scene.things.values() if thing.is_pickupable][:5]:
        before, items = phrase_finder(scene), items_as_seen(scene)
        assert before is phrase_finder(scene)
        assert before(thing.id) == phrase_for(items[thing.id], items.values())
        thing.is_present = False
        assert phrase_finder(scene) is not before
        with pytest.raises(KeyError):
            phrase_finder(scene)(thing.id)
        thing.is_present = True
