"""A small scene with known shapes: a cabinet with a leaf, a pane and a screen, a ball behind it, a wall with a hole."""

import numpy as np

from vigil.assets.kernel.asset import Asset, Joint, Mesh, Part, Surface
from vigil.base.geometry import Vec3
from vigil.protocol.house import MaterialRef
from vigil.scene.things import Hole, RoomShape, Scene, Thing, WallPanel


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    """Return a box with sharp edges between two corners."""
    low_corner, high_corner = np.array(low, dtype=float), np.array(high, dtype=float)
    vertices, normals, faces = [], [], []
    for axis in range(3):
        for side in (0, 1):
            normal = np.eye(3)[axis] * (2 * side - 1)
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            corners = [0.5 + normal / 2 + a * u / 2 + b * v / 2 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            order = [[0, 1, 2], [0, 2, 3]] if side else [[0, 2, 1], [0, 3, 2]]
            faces += [[len(vertices) + i for i in triangle] for triangle in order]
            vertices += [low_corner + (high_corner - low_corner) * corner for corner in corners]
            normals += [normal] * 4
    uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)] * 6, dtype=np.float32)
    return Mesh(np.array(vertices, np.float32), np.array(faces, np.int32), np.array(normals, np.float32), uvs)


INSIDE = Surface("shelf", Vec3(0.0, -0.3, 0.0), 0.6, 0.2, clearance=0.6, is_inside=True, needs_opening=True)
"""Where a thing may lie behind a leaf."""


def cabinet() -> Asset:
    """Return a box 0.8 m wide and high, 0.4 m deep, its front half a leaf and half a pane, a screen on top."""
    body = Part("body", block((-0.4, -0.4, -0.2), (0.4, 0.4, 0.1)), "plastic/#8888aa")
    leaf = Part("leaf", block((-0.4, -0.4, 0.15), (0.0, 0.4, 0.2)), "plastic/#aa4444", joint="leaf", bears_open=True)
    pane = Part("pane", block((0.0, -0.4, 0.18), (0.4, 0.4, 0.2)), "glass", is_glass=True)
    screen = Part(
        "screen", block((-0.3, 0.4, -0.1), (0.3, 0.7, 0.0)), "plastic/#222222",
        material_on="glow/#ffffff", bears_toggle=True,
    )  # fmt: skip
    flame = Part("flame", block((0.32, 0.4, -0.1), (0.38, 0.6, 0.0)), "glow/#ffaa33", shown="on", bears_toggle=True)
    hinge = Joint("leaf", "hinge", Vec3(0.0, 1.0, 0.0), Vec3(-0.4, 0.0, 0.2), -90.0)
    parts = (body, leaf, pane, screen, flame)
    return Asset("Cabinet", Vec3(0.8, 0.8, 0.4), parts, (), (hinge,), (INSIDE,))


def cube(size: float, material: str) -> Asset:
    """Return a cube."""
    half = size / 2
    part = Part("cube", block((-half, -half, -half), (half, half, half)), material)
    return Asset("Cube", Vec3(size, size, size), (part,), ())


def make_scene() -> Scene:
    """Return the scene; the agent of `agent` sees all of it."""
    corners = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]
    room = RoomShape(
        "room", "Kitchen", np.array(corners), 2.5, MaterialRef(name="planks/oak"), None,
        Vec3(0.0, 2.4, 0.0), (1.0, 1.0, 1.0),
    )  # fmt: skip
    panels = []
    for number in range(4):
        (x0, z0), (x1, z1) = corners[number], corners[(number + 1) % 4]
        holes = (Hole(0.3, 1.0, 1.0, 2.0),) if number == 2 else ()
        normal = (-(x0 + x1) / 4.0, -(z0 + z1) / 4.0)
        panels.append(
            WallPanel(
                f"w{number}", "room", (x0, z0), (x1, z1), 0.0, 2.5, normal, MaterialRef(name="plaster/white"), holes
            )
        )
    things = [
        Thing("cabinet", "Cabinet", cabinet(), Vec3(0.0, 0.4, 0.5), Vec3(0.0, 180.0, 0.0)),
        Thing("cube", "Cube", cube(0.2, "plastic/#33aa33"), Vec3(-1.0, 0.1, 0.0), Vec3(0.0, 0.0, 0.0)),
        Thing("big", "Cube", cube(0.9, "plastic/#3333aa"), Vec3(1.3, 0.45, 1.3), Vec3(0.0, 30.0, 0.0)),
    ]
    return Scene(rooms=[room], panels=panels, things={thing.id: thing for thing in things})


def drawn_block() -> Mesh:
    return block((-1.0, -0.2, -0.1), (1.0, 0.2, 0.1))
