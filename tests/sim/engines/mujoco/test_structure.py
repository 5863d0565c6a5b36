import numpy as np
import pytest
import shapely

from vigil.assets.database import AssetDatabase
from vigil.assets.kernel.asset import Mesh
from vigil.base.geometry import Vec3
from vigil.protocol.house import MaterialRef
from vigil.scene.build import build_scene
from vigil.scene.things import Hole, RoomShape, Scene, WallPanel
from vigil.sim.conformance.reference_house import PANE, reference_house
from vigil.sim.engines.mujoco.compiled.structure import BEHIND_FRAME_M, OVERLAP_M, shells_of
from vigil.sim.engines.mujoco.engine import MujocoEngine

SHAPES = {
    "rectangle": [(0.1, 0.2), (3.3, 0.2), (3.3, 4.0), (0.1, 4.0)],
    "L": [(0.0, 0.0), (4.0, 0.0), (4.0, 2.1), (1.7, 2.1), (1.7, 5.0), (0.0, 5.0)],
    "slanted": [(0.0, 0.0), (4.0, 0.0), (3.0, 2.5), (0.0, 3.0)],
    "collinear": [(0.0, 0.0), (1.3, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)],
}


def a_scene(polygon: list[tuple[float, float]], holes: tuple[Hole, ...] = ()) -> Scene:
    material = MaterialRef(name="plaster/white")
    room = RoomShape("r", "Kitchen", np.array(polygon), 2.5, material, None, Vec3(1.0, 2.4, 1.0), (1.0, 1.0, 1.0))
    panel = WallPanel("w", "r", (0.0, 0.0), (4.0, 0.0), 0.0, 2.5, (0.0, 1.0), material, holes)
    return Scene(rooms=[room], panels=[panel])


def crosses(mesh: Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("name", list(SHAPES))
def test_floor_and_ceiling_cover_the_room_and_face_it(name: str) -> None:
    shells = {shell.kind: shell.mesh for shell in shells_of(a_scene(SHAPES[name]))}
    area = shapely.Polygon(SHAPES[name]).area
    floor, ceiling = crosses(shells["floor"]), crosses(shells["ceiling"])
    assert floor[:, 2].min() > 0
    assert ceiling[:, 2].max() < 0
    assert floor[:, 2].sum() == pytest.approx(area)
    assert ceiling[:, 2].sum() == pytest.approx(-area)
    assert np.allclose(shells["ceiling"].vertices[:, 2], 2.5)


def test_a_wall_has_its_holes_and_faces_its_room() -> None:
    holes = (Hole(0.3, 1.2, 0.0, 2.1), Hole(2.0, 3.0, 0.9, 1.8))
    wall = next(shell for shell in shells_of(a_scene(SHAPES["rectangle"], holes)) if shell.kind == "wall").mesh
    facing = crosses(wall)
    assert facing[:, 1].min() > 0
    whole = 4.0 * (2.5 + 2 * OVERLAP_M)
    behind = BEHIND_FRAME_M
    door, window = (0.9 - 2 * behind) * (2.1 - behind + OVERLAP_M), (1.0 - 2 * behind) * (0.9 - 2 * behind)
    assert facing[:, 1].sum() == pytest.approx(whole - door - window)
    centers = wall.vertices[wall.faces].mean(axis=1)
    inside = (centers[:, 0] > 2.0 + behind) & (centers[:, 0] < 3.0 - behind)
    inside &= (centers[:, 2] > 0.9 + behind) & (centers[:, 2] < 1.8 - behind)
    assert not inside.any()


def test_skirting_stops_at_doors() -> None:
    boards = next(
        s for s in shells_of(a_scene(SHAPES["rectangle"], (Hole(0.5, 1.5, 0.0, 2.1),))) if s.kind == "skirting"
    )
    x = boards.mesh.vertices[:, 0]
    assert not ((x > 0.5 + 1e-6) & (x < 1.5 - 1e-6)).any()
    assert np.isclose(x, 0.5).any()
    assert crosses(boards.mesh)[:, 1].min() > 0


def test_neighbouring_cells_share_their_corners() -> None:
    floor = next(shell for shell in shells_of(a_scene(SHAPES["L"])) if shell.kind == "floor").mesh
    used = np.unique(floor.faces)
    corners = floor.vertices[used].round(6)
    edges = np.sort(np.concatenate([floor.faces[:, [0, 1]], floor.faces[:, [1, 2]], floor.faces[:, [2, 0]]]), axis=1)
    # A corner in the middle of another cell's edge would be a T-junction: a place where seams open.
    for a, b in edges:
        start, end = floor.vertices[a], floor.vertices[b]
        along = (corners - start) @ (end - start) / np.dot(end - start, end - start)
        off = np.linalg.norm(corners - start - along[:, None] * (end - start), axis=1)
        assert not ((off < 1e-6) & (along > 1e-6) & (along < 1 - 1e-6)).any()


def test_no_ray_slips_between_a_frame_and_its_wall() -> None:
    """Rays at the corners and edges of the window between two rooms end at its frame, its pane or the wall."""
    scene = build_scene(reference_house(), AssetDatabase.default())
    engine = MujocoEngine()
    engine.load(scene)
    pane, rng = scene.things[PANE], np.random.default_rng(3)
    x, y, z = pane.position
    width, height = pane.asset.size.x / 2, pane.asset.size.y / 2
    for _ in range(40):
        eye = Vec3(x - float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.3, 2.2)), z + float(rng.uniform(-1.0, 2.0)))
        across = np.concatenate([rng.uniform(-width, width, 40), np.repeat([-width, width], 20)])
        up = np.concatenate([np.repeat([-height, height], 20), rng.uniform(-height, height, 40)])
        nudge = rng.choice([-1e-3, -1e-4, 0.0, 1e-4, 1e-3], (80, 2))
        targets = np.column_stack([np.full(80, x), y + up + nudge[:, 0], z + across + nudge[:, 1]])
        lengths = np.linalg.norm(targets - eye, axis=1)
        hits = engine.cast(eye, (targets - eye) / lengths[:, None], through_glass=False)
        assert (hits.distances < lengths + 0.01).all()
    engine.close()
