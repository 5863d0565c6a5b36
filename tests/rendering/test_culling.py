"""What is left out of a picture because nothing of it can be seen."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.cabinet_scene import block, cube
from tests.support.drawing_everything import draw_everything
from vigil.assets.kernel.asset import Asset, Part
from vigil.base.geometry import Pose, Vec3
from vigil.protocol.house import MaterialRef
from vigil.protocol.observation import Quality
from vigil.rendering.culling import InView, in_view
from vigil.rendering.geometry import geometry_of
from vigil.rendering.mirrors import box_of
from vigil.rendering.structure_parts import StructureParts
from vigil.rendering.surfaces import Surfaces
from vigil.rendering.triangles import Triangles
from vigil.rendering.viewer import Mirror, Viewer
from vigil.scene.portals import OUTSIDE, Portals
from vigil.scene.sectors import Sector, Spans, overlap
from vigil.scene.things import Hole, RoomShape, Scene, Thing, WallPanel
from vigil.sim.core.sight import Sight
from vigil.sim.engines.mujoco.compiled import frames
from vigil.sim.engines.mujoco.compiled.model import CompiledModel, build
from vigil.sim.engines.mujoco.engine import MujocoEngine

EYE_M = 1.5
DOOR = Hole(0.1, 1.0, 0.0, 2.0)


NO_WALL = Hole(0.0, 4.0, 0.0, 2.5)
"""Stands for a wall that is missing."""


def rooms(*doors: Hole | None) -> Scene:
    """Return rooms of 4 m in a row, "a" first, with a hole or none in each wall between two."""
    plaster = MaterialRef(name="plaster/white")
    corners = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])
    shapes, panels = [], []
    for number in range(len(doors) + 1):
        name, shift = "abc"[number], np.array([4.0 * number, 0.0])
        lamp = Vec3(2.0 + 4.0 * number, 2.4, 2.0)
        shapes.append(RoomShape(name, "Kitchen", corners + shift, 2.5, plaster, plaster, lamp, (1.0, 1.0, 1.0)))
    far = 4.0 * len(shapes)
    around = [((0.0, 0.0), (0.0, 4.0)), ((far, 0.0), (far, 4.0)), ((0.0, 0.0), (far, 0.0)), ((0.0, 4.0), (far, 4.0))]
    for number, (start, end) in enumerate(around):
        inward = (far / 2 - (start[0] + end[0]) / 2, 2.0 - (start[1] + end[1]) / 2)
        panels.append(WallPanel(f"outer{number}", "a", start, end, 0.0, 2.5, inward, plaster))
    for number, door in enumerate(doors):
        if door is NO_WALL:
            continue
        x, holes = 4.0 * (number + 1), (() if door is None else (door,))
        for room, facing in (("abc"[number], -1.0), ("abc"[number + 1], 1.0)):
            ends = ((x, 0.0), (x, 4.0))
            panels.append(WallPanel(f"{room}{number}", room, *ends, 0.0, 2.5, (facing, 0.0), plaster, holes))
    return Scene(rooms=shapes, panels=panels)


def seen(scene: Scene, x: float, z: float, height: float = EYE_M) -> set[int]:
    """Return which rooms are seen from a place, in any direction; all when nothing is left out."""
    found = Portals(scene).visible_rooms((x, z, height))
    return set(range(len(scene.rooms))) if found is None else {room for room, _ in found} - {OUTSIDE}


def test_rooms_are_seen_through_their_doorways_only() -> None:
    assert seen(rooms(DOOR), 2.0, 2.0) == {0, 1}
    assert seen(rooms(DOOR), 4.0, 0.5) == {0, 1}  # in the doorway
    assert seen(rooms(DOOR), -5.0, 2.0) == {0, 1}  # outside: nothing is left out
    assert seen(rooms(None), 2.0, 2.0) == {0}
    assert seen(rooms(None), 3.9, 2.0) == {0}  # near to the wall


def test_rooms_are_seen_where_no_wall_is_between_them_or_a_low_one() -> None:
    assert seen(rooms(NO_WALL), 1.0, 2.0) == {0, 1}
    low = rooms(None)
    low.panels = [replace(panel, height=1.0) for panel in low.panels]
    assert seen(low, 1.0, 2.0) == {0, 1}


def test_rooms_without_a_wall_between_them_are_one_space() -> None:
    scene = rooms(None)
    long = replace(scene.rooms[0], id="long", polygon=np.array([(1.0, 4.0), (6.0, 4.0), (6.0, 8.0), (1.0, 8.0)]))
    scene.rooms.append(long)
    closed = [((1.0, 4.0), (1.0, 8.0)), ((6.0, 4.0), (6.0, 8.0)), ((1.0, 8.0), (6.0, 8.0))]
    closed += [((0.0, 4.0), (5.7, 4.0)), ((6.0, 4.0), (8.0, 4.0))]  # but for 0.3 m of the wall to the second room
    plaster = scene.panels[0].material
    scene.panels = [panel for panel in scene.panels if (panel.start[1], panel.end[1]) != (4.0, 4.0)]
    scene.panels += [
        WallPanel(f"more{number}", "long", start, end, 0.0, 2.5, (0.0, 1.0), plaster)
        for number, (start, end) in enumerate(closed)
    ]
    assert seen(scene, 3.0, 7.0) == {1, 2}
    assert seen(scene, 1.0, 1.0) == {0}
    assert seen(scene, 7.0, 1.0) == {1, 2}


def test_all_rooms_beside_a_long_edge_without_walls_are_one_space() -> None:
    scene = rooms(None)
    long = replace(scene.rooms[0], id="long", polygon=np.array([(1.0, 4.0), (5.0, 4.0), (5.0, 8.0), (1.0, 8.0)]))
    scene.rooms.append(long)
    scene.panels = [panel for panel in scene.panels if (panel.start[1], panel.end[1]) != (4.0, 4.0)]
    closed = [((1.0, 4.0), (1.0, 8.0)), ((5.0, 4.0), (5.0, 8.0)), ((1.0, 8.0), (5.0, 8.0))]
    scene.panels += [replace(scene.panels[0], start=start, end=end) for start, end in closed]
    assert seen(scene, 3.0, 7.0) == {0, 1, 2}


def test_through_a_mirror_only_what_lies_behind_it_is_seen() -> None:
    portals, eye, entry = Portals(rooms(DOOR)), (-1.0, 0.5, EYE_M), (0.01, 0.5, EYE_M)
    towards_door = Sector.of(eye, [(0.0, 0.4, 1.4), (0.0, 0.6, 1.6)])
    past_it = Sector.of(eye, [(0.0, 1.9, 1.4), (0.0, 2.1, 1.6)])
    assert portals.visible_rooms(eye) is None
    for through, expected in ((towards_door, {0, 1}), (past_it, {0})):
        found = portals.visible_rooms(eye, [entry], through)
        assert found is not None
        assert {room for room, _ in found} == expected


def test_beside_a_mirror_nothing_of_the_mirrored_picture_is_looked_at() -> None:
    viewer = Viewer(np.zeros(3), np.eye(3), 90.0, 640, 480)  # it looks along -z: 240 pixels for each metre at one
    square = np.array([(-0.5, -0.5, -2.0), (0.5, -0.5, -2.0), (0.5, 0.5, -2.0), (-0.5, 0.5, -2.0)])
    mirror = Mirror(0, square.mean(axis=0), np.array([0.0, 0.0, 1.0]), box_of(square, viewer), square)
    sides = viewer.behind(mirror).sides()
    inside = {
        point: bool((sides @ (*point, 1.0) > 0.0).all())
        for point in [(0.0, 0.0, -1.0), (0.6, 0.0, -1.0), (0.0, 0.0, -2.1)]
    }
    assert list(inside.values()) == [True, True, False]  # at 3 m from the eye behind it, 0.75 m aside is in view
    assert not (sides @ (0.9, 0.0, -1.0, 1.0) > 0.0).all()


def test_without_any_inner_wall_a_large_house_is_soon_looked_over() -> None:
    scene = rooms(*[NO_WALL] * 2)
    scene.rooms = [
        replace(scene.rooms[0], id=f"{x} {z}", polygon=scene.rooms[0].polygon + np.array([4.0 * x, 4.0 * z]))
        for x in range(4)
        for z in range(4)
    ]
    scene.panels = [
        replace(scene.panels[0], start=start, end=end)
        for start, end in [
            ((0.0, 0.0), (0.0, 16.0)),
            ((16.0, 0.0), (16.0, 16.0)),
            ((0.0, 0.0), (16.0, 0.0)),
            ((0.0, 16.0), (16.0, 16.0)),
        ]
    ]
    found = Portals(scene).visible_rooms((2.0, 2.0, EYE_M))
    assert found is not None
    assert sorted(room for room, _ in found) == list(range(16))  # each of them once


def test_a_window_beside_a_corner_leads_outside() -> None:
    """The first and the third room have windows that face each other across what the second leaves free."""
    scene = rooms(None, None)
    scene.rooms[1] = replace(scene.rooms[1], polygon=np.array([(4.0, 0.0), (8.0, 0.0), (8.0, 2.0), (4.0, 2.0)]))
    windows = {"a": Hole(0.02, 0.4, 0.8, 2.0), "c": Hole(0.5, 1.5, 0.8, 2.0)}
    plaster = scene.panels[0].material
    ends = {"a": ((4.0, 2.0), (4.0, 4.0)), "c": ((8.0, 2.0), (8.0, 4.0))}
    scene.panels = [panel for panel in scene.panels if panel.room_id not in ends or panel.start[0] not in (4.0, 8.0)]
    for room, (start, end) in ends.items():
        low = WallPanel(f"low {room}", room, (start[0], 0.0), start, 0.0, 2.5, (1.0, 0.0), plaster)
        scene.panels += [
            low,
            WallPanel(f"window {room}", room, start, end, 0.0, 2.5, (1.0, 0.0), plaster, (windows[room],)),
        ]
    scene.panels.append(WallPanel("b", "b", (4.0, 2.0), (8.0, 2.0), 0.0, 2.5, (0.0, -1.0), plaster))
    assert 2 in seen(scene, 1.0, 2.2)


def test_nothing_outside_is_left_out() -> None:
    scene = rooms(DOOR)
    put(scene, "by the wall", 6.0, 4.3)
    looker = Pose(position=Vec3(1.0, 0.0, 2.0), rotation=65.0)
    assert not left_out(build(scene), looker)


@pytest.mark.parametrize("seed", range(6))
def test_whatever_walls_stand_nothing_in_sight_is_left_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = random_house(rng)
    portals = Portals(scene)
    told = hidden = 0
    for room in rng.integers(9, size=60).tolist():
        low = scene.rooms[room].polygon.min(axis=0)
        eye = np.array([*(low + rng.uniform(0.05, 2.95, 2)), EYE_M])
        points = np.column_stack([rng.uniform(0.05, 8.95, (60, 2)), rng.uniform(0.1, 2.4, 60)])
        for point, is_seen in zip(points, in_sight(scene, eye, points).tolist(), strict=True):
            extent = portals.extent(tuple(point - 0.01), tuple(point + 0.01))
            may_see = portals.may_see(tuple(eye), extent)
            assert may_see or not is_seen
            told, hidden = told + is_seen, hidden + (not may_see)
    assert told > 300
    assert hidden > 50


def random_house(rng: np.random.Generator) -> Scene:
    """Return nine rooms of 3 m, between which stand walls with or without holes, low ones, parts of one, or none."""
    scene = rooms(None)
    room, panel = scene.rooms[0], scene.panels[0]
    square = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)])
    corners = [np.array([3.0 * x, 3.0 * z]) for x in range(3) for z in range(3)]
    panels = [
        replace(panel, start=start, end=end, holes=())
        for start, end in [
            ((0.0, 0.0), (0.0, 9.0)),
            ((9.0, 0.0), (9.0, 9.0)),
            ((0.0, 0.0), (9.0, 0.0)),
            ((0.0, 9.0), (9.0, 9.0)),
        ]
    ]
    for x, z in corners:
        for start, end in (((x + 3.0, z), (x + 3.0, z + 3.0)), ((x, z + 3.0), (x + 3.0, z + 3.0))):
            kind = rng.choice(["none", "low", "part", "door", "window", "whole"], p=[0.1, 0.05, 0.05, 0.4, 0.1, 0.3])
            left = float(rng.uniform(0.02, 2.0))
            holes = {"door": (Hole(left, left + 0.9, 0.0, 2.0),), "window": (Hole(left, left + 0.9, 0.9, 2.0),)}
            wall = replace(panel, start=start, end=end, holes=holes.get(kind, ()))
            if kind == "part":
                wall = replace(wall, end=tuple(np.array(start) + left / 3.0 * (np.array(end) - start)))
            if kind != "none":
                panels.append(replace(wall, height=1.0) if kind == "low" else wall)
    return Scene(
        rooms=[replace(room, id=str(number), polygon=square + low) for number, low in enumerate(corners)], panels=panels
    )


def in_sight(scene: Scene, eye: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points (n, 3) no wall hides from an eye (3,), each as (x, z, height)."""
    is_seen, way = np.ones(len(points), dtype=bool), points - eye
    for panel in scene.panels:
        start, along = np.array(panel.start), np.array(panel.end) - panel.start
        length = float(np.linalg.norm(along))
        across = way[:, 0] * along[1] - way[:, 1] * along[0]
        from_eye = start - eye[:2]
        share = (from_eye[0] * along[1] - from_eye[1] * along[0]) / across
        at = length * (from_eye[0] * way[:, 1] - from_eye[1] * way[:, 0]) / across
        height = eye[2] + share * way[:, 2]
        meets = (share > 0.0) & (share < 1.0) & (at >= 0.0) & (at <= length)
        meets &= (height >= panel.bottom) & (height <= panel.bottom + panel.height)
        for hole in panel.holes:
            meets &= (at < hole.left) | (at > hole.right) | (height < hole.bottom) | (height > hole.top)
        is_seen &= ~meets
    return is_seen


def test_a_line_of_sight_through_two_doorways_is_needed_for_a_room_behind_another() -> None:
    crossed = rooms(DOOR, Hole(3.0, 3.9, 0.0, 2.0))
    assert seen(crossed, 3.0, 3.9) == {0, 1}
    assert seen(crossed, 2.0, 0.2) == {0, 1}
    assert seen(rooms(DOOR, DOOR), 2.0, 0.5) == {0, 1, 2}


def test_a_line_of_sight_rises_no_more_in_the_next_doorway_than_in_the_first() -> None:
    low, high = Hole(0.1, 1.0, 0.0, 1.6), Hole(0.1, 1.0, 2.2, 2.4)
    assert seen(rooms(low, high), 1.0, 0.5) == {0, 1}  # under 1.6 m one sees what is at 2.2 m from near by alone
    assert seen(rooms(low, high), 3.5, 0.5) == {0, 1, 2}


def test_from_above_no_room_is_left_out() -> None:
    model, middle_of_a = build(rooms(None)), frames.points(np.array([2.0, 0.0, 2.0]))
    for height, shown in ((1.5, {0}), (12.0, {0, 1})):
        eye = middle_of_a + np.array([0.0, 0.0, height])
        viewer = Viewer(eye, np.eye(3), 100.0, 640, 480)  # it looks straight down
        assert set(model.render_scene.structure_rooms[drawn(model, viewer)].tolist()) - {-1} == shown


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_left_out_to_which_a_line_leads_through_the_doorways(seed: int) -> None:
    rng = np.random.default_rng(seed)
    portals = Portals(rooms(DOOR, Hole(0.5, 3.5, 0.8, 2.1)))
    walls = ((4.0, 0.1, 1.0, 0.0, 2.0), (8.0, 0.5, 3.5, 0.8, 2.1))
    found = 0
    for _ in range(300):
        eye, point = rng.uniform((0.0, 0.0, 0.2), (4.0, 4.0, 2.0)), rng.uniform((4.1, 0.0, 0.0), (12.0, 4.0, 2.5))
        way, room = point - eye, int(point[0] // 4.0)
        passes = [
            left < y < right and low < z < high
            for x, left, right, low, high in walls[:room]
            for _, y, z in [eye + way * (x - eye[0]) / way[0]]
        ]
        if all(passes):
            found += 1
            at = Spans.of(eye, point + rng.uniform(-0.2, 0.2, (8, 1, 1)) * way / np.linalg.norm(way))
            ways = [sector for other, sector in portals.visible_rooms(tuple(eye)) or [] if other == room]
            assert overlap(ways, at).all(axis=1).any()
    assert found > 5


def test_directions_to_one_thing_are_those_to_several() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        eye, corners = rng.normal(size=3), rng.normal(rng.normal(0.0, 2.0, (5, 3)), 0.5, (8, 5, 3))
        spans = Spans.of(eye, corners)
        for number in range(5):
            one = Sector.of(eye.tolist(), corners[:, number].tolist())
            several = spans.start[number], spans.width[number], spans.low[number], spans.high[number]
            assert (one.start, one.width, one.low, one.high) == pytest.approx(several)


AT_THE_WALL = Pose(position=Vec3(2.5, 0.0, 2.0), rotation=90.0)


def test_of_the_structure_only_what_is_in_view_is_drawn() -> None:
    model = build(rooms(None))
    geometry = geometry_of(model.render_scene)
    parts = StructureParts(geometry)
    structure = range(len(model.render_scene.structure_kinds))
    assert sum(map(len, parts.faces)) == sum(len(geometry.faces[geometry.face_slices[geom]]) for geom in structure)
    eye, axes = frames.points(np.array([2.5, EYE_M, 2.0])), frames.mujoco_camera_axes(AT_THE_WALL)
    found = in_view(Triangles(geometry, parts), model.render_state(), Viewer(eye, axes, 110.0, 640, 480))
    drawn = {tuple(face) for group in found.groups() for face in group.tolist()}
    shown = [
        part
        for part, numbers in enumerate(parts.faces)
        if not drawn.isdisjoint(map(tuple, geometry.faces[numbers].tolist()))
    ]
    assert not parts.touches[shown, 1].any()  # the other room
    assert (parts.middles + parts.halves.sum(axis=0))[shown, 0].min() > 2.5  # nothing that is all behind the eye
    kinds = {model.render_scene.structure_kinds[geom] for geom in parts.geoms[shown]}
    assert kinds == {"wall", "floor", "ceiling", "skirting", "ground"}


def put(scene: Scene, name: str, x: float, z: float, height: float = 0.5) -> None:
    scene.things[name] = Thing(name, "Cube", cube(0.4, "plastic/#dd1111"), Vec3(x, height, z), Vec3(0.0, 0.0, 0.0))


def drawn(model: CompiledModel, viewer: Viewer) -> np.ndarray:
    """Return the numbers of the geoms that are drawn."""
    geometry = geometry_of(model.render_scene)
    return in_view(Triangles(geometry, StructureParts(geometry)), model.render_state(), viewer).geoms


def left_out(model: CompiledModel, looker: Pose) -> set[str]:
    """Return the things of which nothing is drawn."""
    eye, axes = frames.points(np.array(looker.eye)), frames.mujoco_camera_axes(looker)
    shown = drawn(model, Viewer(eye, axes, 80.0, 640, 480))
    return {name for name, placed in model.things.items() if not np.isin(placed.geoms, shown).any()}


def test_of_the_next_room_only_what_is_in_line_with_the_doorway_is_drawn() -> None:
    scene = rooms(DOOR)
    put(scene, "before the door", 6.0, 0.5)
    put(scene, "beside the door", 6.0, 3.0)
    put(scene, "over the door", 4.6, 0.5, 2.4)
    put(scene, "here", 3.0, 3.0)
    looker = Pose(position=Vec3(1.0, 0.0, 0.5), rotation=70.0)
    model = build(scene)
    assert left_out(model, looker) == {"beside the door", "over the door"}
    near = Pose(position=Vec3(3.7, 0.0, 0.5), rotation=70.0)
    assert left_out(model, near) == {"here"}  # in the doorway all of the next room may be seen


def mirrored_scene() -> Scene:
    """Return two rooms with a mirror of 0.6 m on the wall that is farthest from the door."""
    scene = rooms(DOOR)
    pane = Part("pane", block((-0.3, -0.3, -0.01), (0.3, 0.3, 0.01)), "mirror")
    scene.things["mirror"] = Thing(
        "mirror",
        "Mirror",
        Asset("Mirror", Vec3(0.6, 0.6, 0.02), (pane,), ()),
        Vec3(0.02, 1.5, 0.6),
        Vec3(0.0, 90.0, 0.0),
    )
    put(scene, "in line", 5.0, 0.5, 1.2)
    put(scene, "mirrored", 3.5, 0.5, 1.5)
    put(scene, "beside", 3.5, 3.5, 1.5)
    put(scene, "in the next room", 5.0, 3.0, 1.5)
    return scene


LOOKER = Pose(position=Vec3(1.2, 0.0, 0.7), rotation=-90.0)


def drawn_behind(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> tuple[np.ndarray, set[str], set[str]]:
    """Return a frame, and the things drawn of it as it is and as the mirror shows it."""
    names: list[set[str]] = []
    things = {name: placed.geoms for name, placed in build(scene).things.items()}

    def kept(self: Surfaces, viewer: Viewer) -> InView:
        found = original(self, viewer)
        names.append({name for name, geoms in things.items() if np.isin(geoms, found.geoms).any()})
        return found

    original = Surfaces.shown
    with monkeypatch.context() as patch:
        patch.setattr(Surfaces, "shown", kept)
        frame = draw(scene)
    direct, behind = names
    return frame, direct, behind


def draw(scene: Scene, quality: Quality = "default") -> np.ndarray:
    engine = MujocoEngine(quality)
    engine.load(scene)
    frame = engine.draw(LOOKER, None)
    engine.close()
    return frame


@pytest.mark.usefixtures("drawing")
def test_of_a_mirrored_picture_only_what_the_mirror_may_show_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = mirrored_scene()
    _, direct, behind = drawn_behind(scene, monkeypatch)
    assert direct == {"mirror"}
    assert behind == {"mirrored", "in line", "mirror"}


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("quality", ["default", "fast"])
def test_frames_with_mirrors_are_the_same_with_all_geoms_drawn(quality: Quality, monkeypatch) -> None:
    scene = mirrored_scene()
    frame = draw(scene, quality)
    assert (frame[..., 0] > 1.8 * frame[..., 1]).sum() > 300  # the mirror shows something red
    draw_everything(monkeypatch)
    assert np.array_equal(draw(scene, quality), frame)


def test_what_has_moved_into_view_is_drawn() -> None:
    scene = rooms(DOOR)
    put(scene, "thing", 6.0, 3.0)
    model, looker = build(scene), Pose(position=Vec3(1.0, 0.0, 0.5), rotation=70.0)
    assert left_out(model, looker) == {"thing"}
    model.place(replace(scene.things["thing"], position=Vec3(6.0, 0.5, 0.5)))
    model.update_kinematics()
    assert not left_out(model, looker)


def test_rays_are_cast_at_what_has_moved_into_view() -> None:
    scene = rooms(DOOR)
    put(scene, "thing", 6.0, 3.0)
    engine = MujocoEngine("fast")
    engine.load(scene)
    sight, thing, eye = Sight(engine, scene), scene.things["thing"], Vec3(1.0, EYE_M, 0.5)
    met = []
    for z in (3.0, 0.5, 3.0):
        thing.position = Vec3(6.0, 0.5, z)
        engine.update(scene, {"thing"})
        sight.clear_cache()
        way = np.array([tuple(thing.position)]) - np.array(tuple(eye))
        met.append(bool(sight.meets(eye, way / np.linalg.norm(way), thing, through_glass=True)[0]))
    engine.close()
    assert met == [False, True, False]
