"""Rays of programs do not slip between the triangles of a wall or floor."""

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Vec3
from vigil.protocol.house import House
from vigil.sim import make_simulator
from vigil.sim.scene_editor import SceneEditor

CORNERS = [(0.0, 0.0), (0.0, 5.0), (4.0, 5.0), (4.0, 0.0)]


def test_every_ray_along_an_axis_meets_the_room():
    """The eye and the rays lie in the planes in which the room's surfaces are cut into triangles."""
    editor = make_simulator("mujoco", assets=AssetDatabase.default())
    assert isinstance(editor, SceneEditor)
    editor.load(House("room", {"rooms": [_room()], "walls": [_wall(number) for number in range(4)]}))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    for eye in (Vec3(1.5, 1.5, 2.0), Vec3(1.0, 1.0, 1.0), Vec3(2.5, 0.5, 4.5), Vec3(2.25, 1.25, 1.75)):
        _, distances = editor.meets(eye, axes)
        room = [4 - eye.x, 2.5 - eye.y, 5 - eye.z, eye.x, eye.y, eye.z]
        np.testing.assert_allclose(distances, room, atol=1e-4)
    editor.close()


def _room() -> dict:
    floor = [{"x": x, "y": 0.0, "z": z} for x, z in CORNERS]
    return {"id": "room|1", "roomType": "Kitchen", "floorPolygon": floor, "floorMaterial": {"name": "wood"}}


def _wall(number: int) -> dict:
    low = [CORNERS[number], CORNERS[(number + 1) % 4]]
    corners = [*((*corner, 0.0) for corner in low), *((*corner, 2.5) for corner in reversed(low))]
    polygon = [{"x": x, "y": y, "z": z} for x, z, y in corners]
    return {"id": f"wall|1|{number}", "roomId": "room|1", "polygon": polygon, "material": {"name": "plaster"}}
