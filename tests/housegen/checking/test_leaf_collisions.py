"""What leaves cut through: looked at on the triangles that are drawn, where solids say too little."""

import numpy as np
import pytest

from vigil.assets.database import AssetDatabase
from vigil.assets.making import make
from vigil.base.geometry import Vec3
from vigil.housegen.base.spec import spec_for
from vigil.housegen.checking.leaf_collisions import LeafCollisions, drawn_triangles
from vigil.housegen.generate import generate
from vigil.scene.build import build_scene
from vigil.scene.geometry import part_motion
from vigil.scene.things import Scene, Thing

ORIGIN = Vec3(0.0, 0.0, 0.0)
DOOR = Thing("Doorway|1", "Doorway", make("Doorway", Vec3(1.0, 2.1, 0.14), 0), Vec3(0.0, 1.05, 0.0), ORIGIN)
PICTURE = make("Painting", Vec3(0.75, 0.55, 0.03), 0)


def leaf_points(openness: float) -> np.ndarray:
    """All corners (n, 3) of the door's leaf, handles included."""
    moving = [(joint, mesh) for joint, mesh in drawn_triangles(DOOR.asset) if joint is not None]
    return np.concatenate([part_motion(DOOR, joint, openness)(mesh.reshape(-1, 3)) for joint, mesh in moving])


def picture_beside_the_open_leaf(gap: float) -> Thing:
    """A picture on a wall along the open leaf, on its outer side, `gap` (m) from the handle."""
    open_leaf, shut = leaf_points(1.0), leaf_points(0.0)
    side = 1.0 if open_leaf[:, 0].mean() > shut[:, 0].mean() else -1.0
    face = side * (side * open_leaf[:, 0]).max() + side * (gap + PICTURE.size.z / 2)
    place = Vec3(float(face), 1.03, float(open_leaf[:, 2].max() - 0.2))
    return Thing("Painting|1", "Painting", PICTURE, place, Vec3(0.0, -90.0 * side, 0.0))


def cut_by_door(other: Thing) -> Thing | None:
    scene = Scene([], [], {thing.id: thing for thing in (DOOR, other)})
    return LeafCollisions(scene).first_pierced(DOOR)


@pytest.mark.parametrize(("gap", "is_cut"), [(-0.02, True), (0.01, False)])
def test_a_handle_that_swings_into_a_picture(gap, is_cut):
    picture = picture_beside_the_open_leaf(gap)
    assert cut_by_door(picture) is (picture if is_cut else None)


def test_what_stands_before_a_door_is_cut_on_the_way_though_not_at_its_ends():
    post = Thing("Statue|1", "Statue", make("Statue", Vec3(0.1, 0.5, 0.1), 0), Vec3(0.0, 1.0, 0.6), ORIGIN)
    assert cut_by_door(post) is post


def test_what_lies_in_a_drawer_is_not_cut_by_it():
    for seed in range(3):
        scene = build_scene(generate(seed, spec_for("bedroom")), AssetDatabase.default())
        cuts = LeafCollisions(scene)
        assert [thing.id for thing in scene.things.values() if thing.is_openable and cuts.first_pierced(thing)] == []
