"""The light that is cast on a scene."""

import numpy as np
import pytest

from tests.support.cabinet_scene import drawn_block
from vigil.base.geometry import Vec3
from vigil.rendering.geometry import BOARD_EDGE_M, geometry_of
from vigil.rendering.light import irradiance, lightmap_atlas
from vigil.rendering.light import lighting as lighting_module
from vigil.rendering.light.irradiance import Samples
from vigil.rendering.light.lighting import Lighting, mixed, shaded
from vigil.rendering.light.smoothing import (
    INSET_M,
    move_inward,
    smooth_edges,
    smoothed,
)
from vigil.rendering.meshes import refined
from vigil.scene.things import Scene, Thing
from vigil.sim.engines.mujoco.compiled import casters, model_cache
from vigil.sim.engines.mujoco.compiled.model import CompiledModel, build


def occluders_at(height: float) -> irradiance.Occluders:
    """Return the block with its middle at a height, as what stops light."""
    block = drawn_block()
    return irradiance.Occluders(casters.make_caster(block.vertices + np.array([0.0, 0.0, height]), block.faces))


def test_planes_lie_apart_and_keep_their_points() -> None:
    floor = np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], float)
    wall = np.array([[0, 3, 0], [4, 3, 0], [4, 3, 2.5], [0, 3, 2.5]], float)
    normals = np.array([[0, 0, 1.0]] * 4 + [[0, -1.0, 0]] * 4)
    vertices = np.concatenate([floor, wall])
    laid_out = lightmap_atlas.pack_atlas(vertices, normals, np.repeat([7, 9], 4))
    assert sorted(laid_out.owners) == [7, 9]
    height, width = laid_out.is_used.shape
    texels = np.floor(laid_out.places * (width, height)).astype(int)
    for vertex, normal, (column, row) in zip(vertices, normals, texels, strict=True):
        inner = laid_out.points[row - (row > 5), column - (column > 5)]
        assert np.linalg.norm(inner - vertex) < 3 * lightmap_atlas.TEXEL_M
        assert inner @ normal == pytest.approx(vertex @ normal, abs=1e-5)
    owner = np.full(laid_out.is_used.shape, -1)
    for number, (top, left, tall, wide) in enumerate(laid_out.boxes):
        assert (owner[top : top + tall, left : left + wide] == -1).all()
        owner[top : top + tall, left : left + wide] = number
    assert ((owner >= 0) == laid_out.is_used).all()


def test_little_light_reaches_what_is_under_something() -> None:
    scene = occluders_at(0.25)
    up = np.array([[0.0, 0.0, 1.0]] * 3, np.float32)
    under, side_by_side, inside = (0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.0, 0.0, 0.33)
    samples = Samples(np.array([under, side_by_side, inside], np.float32), up)
    light, is_buried = irradiance.ambient(scene, samples)
    assert light[0].mean() < 0.5 * light[1].mean()
    assert is_buried.tolist() == [False, False, True]
    lamp = np.array([0.0, 0.0, 2.4])
    here = irradiance.from_lamp(scene, lamp, samples, np.full(3, 0.98, np.float32))
    assert here[0] == 0.0
    assert here[1] > 0.2
    spill_shares = irradiance.from_lamp(scene, lamp, samples, np.array([1.0, 0.5, 0.01], np.float32))
    assert spill_shares[1] == pytest.approx(0.5 / 0.98 * here[1])
    assert spill_shares[2] == 0.0


@pytest.mark.parametrize("count", [1, 3, 17, 150])
def test_light_on_a_point_does_not_depend_on_what_else_is_lit(count: int) -> None:
    rng = np.random.default_rng(2)
    points, normals = rng.normal(size=(2, 400, 3)).astype(np.float32)
    samples = Samples(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))
    scene, lamp = occluders_at(0.0), np.array([0.3, 0.2, 2.4])

    def lit(some: Samples) -> np.ndarray:
        lamps = irradiance.from_lamp(scene, lamp, some, np.ones(len(some.points), np.float32))
        return np.column_stack(
            [
                irradiance.ambient(scene, some)[0],
                irradiance.ambient_facing_shares(some),
                lamps,
                irradiance.lamp_facing_shares(lamp, some),
            ]
        )

    assert np.array_equal(lit(samples)[:count], lit(samples.part(slice(count))))


def test_several_ends_are_blocked_as_each_alone() -> None:
    scene = occluders_at(0.0)
    origins = np.array([(0.0, 0.0, -1.0), (3.0, 0.0, -1.0)], np.float32)
    ends = np.array([(0.0, 0.0, 1.0), (6.0, 0.0, -1.0), (-4.0, 0.0, 1.0)], np.float32)
    assert scene.are_blocked(origins, ends).tolist() == [[True, False], [False, False], [False, True]]
    assert scene.are_blocked(origins[:0], ends).shape == (3, 0)


def test_light_keeps_the_form_of_what_it_falls_on() -> None:
    """What turns from the lamp is darker however light was averaged over its surface, and dark on its far side."""
    normals = np.array([(0, 0, 1), (0.8, 0, 0.6), (0, 0, -1)], np.float32)
    samples = Samples(np.zeros((3, 3), np.float32), normals)
    light = shaded(np.ones((3, 4), np.float32), samples, [np.array([0.0, 0.0, 2.0])])
    assert light[0, 3] > light[1, 3] > light[2, 3] == 0.0
    assert light[1, 0] > light[0, 0]


def test_walls_that_meet_are_told_apart() -> None:
    sides = np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], np.float32)
    samples = Samples(np.zeros((4, 3), np.float32), sides)
    even = np.array([[*[irradiance.AMBIENT] * 3, irradiance.LAMP]] * 4, np.float32)
    above = np.array([0.0, 0.0, 0.5])  # which all face alike
    light = mixed(shaded(even, samples, [above]), np.ones((1, 3)))[:, 0]
    apart = np.abs(light - np.roll(light, 1)) / np.minimum(light, np.roll(light, 1))
    assert apart.min() > 0.1


def test_a_lamp_makes_no_spot_on_the_ceiling() -> None:
    places = np.array([(x, 0.0, 2.5) for x in (0.0, 0.1, 0.5, 2.0)], np.float32)
    samples = Samples(places, np.array([(0, 0, -1.0)] * 4, np.float32))
    shares = irradiance.lamp_facing_shares(np.array([0.0, 0.0, 2.44]), samples)
    assert shares.max() < 1.6 * shares.min()


def test_light_on_a_face_does_not_come_from_the_corners_of_its_rim() -> None:
    """The front of a machine that lies within a rim was dark all over, as if it were hollow."""
    front = np.array([(x, 0.0, z) for x in (0.0, 0.3, 0.6) for z in (0.0, 0.4, 0.8)], np.float32)
    samples = Samples(front, np.array([(0, -1.0, 0)] * 9, np.float32))
    across = [(i, j) for i in range(9) for j in range(i) if np.abs(front[i] - front[j]).sum() < 0.5]
    moved = move_inward(samples, np.array(across)).points
    assert moved[4] == pytest.approx(front[4])
    for corner, inward in ((0, (1, 1)), (2, (1, -1)), (6, (-1, 1)), (8, (-1, -1))):
        step = moved[corner] - front[corner]
        assert (step[[0, 2]] * inward > 0.01).all()
        assert step[1] == 0.0
        assert np.linalg.norm(step) <= INSET_M + 1e-6


def test_behind_what_stands_in_its_way_a_lamp_leaves_some_light_in_its_own_room() -> None:
    scene = occluders_at(0.5)
    places = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, 0.0)], np.float32)
    samples = Samples(places, np.array([[0.0, 0.0, 1.0]] * 3, np.float32))
    own, other = np.ones(3, np.float32), np.full(3, 0.9, np.float32)
    lamp = np.array([0.0, 0.0, 2.4])
    assert 0.2 < irradiance.from_lamp(scene, lamp, samples, own)[0] / irradiance.LAMP < 0.4
    assert irradiance.from_lamp(scene, lamp, samples, other)[0] == 0.0


def edge_list(faces: np.ndarray) -> np.ndarray:
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def test_smoothed_light_keeps_to_one_surface_and_fills_what_is_not_known() -> None:
    (mesh,) = refined([drawn_block()], 0.3)
    is_top = mesh.normals[:, 2] > 0.9
    light = np.where(is_top, 1.0, 0.2)[:, None].repeat(2, axis=1)
    dark, hidden = np.flatnonzero(is_top)[[0, 3]]
    light[dark], light[hidden] = 0.0, 77.0
    is_known = np.arange(len(light)) != hidden
    edges = smooth_edges(mesh.normals, edge_list(mesh.faces))
    after = smoothed(light, is_known, mesh.vertices, edges)
    assert after[~is_top] == pytest.approx(0.2)  # across an edge no light is taken
    assert (after[is_top] > 0.5).all()
    assert after.max() == pytest.approx(1.0)
    alone = np.array([[0, 1]])
    ends = smoothed(light[:3], np.array([False, False, True]), mesh.vertices[:3], alone)
    assert np.isnan(ends[:2]).all()
    assert ends[2] == pytest.approx(light[2])


def test_a_thing_that_stands_on_another_is_not_black_at_its_foot(scene: Scene) -> None:
    scene.things["cube"].position = Vec3(-1.0, 0.0999, 0.0)  # its foot lies just inside the floor
    model = model_cache.model_of(scene)
    lighting = Lighting(model.render_scene)
    lighting.update(model.render_state(), np.arange(model.native.ngeom))
    (geom,) = model.things["cube"].geoms
    light = lighting.vertices[lighting.geometry.vertex_slices[geom], :3].astype(int)
    normals = np.round(lighting.geometry.world(model.render_state(), geom)[1])
    for side in np.unique(normals[normals[:, 2] == 0.0], axis=0):
        on_side = light[(normals == side).all(axis=1)]
        assert on_side.min() > 0.5 * on_side.max()


def test_skirting_boards_have_light_between_their_ends(scene: Scene) -> None:
    model = model_cache.model_of(scene)
    geometry = geometry_of(model.render_scene)
    boards = [geom for geom, kind in enumerate(model.render_scene.structure_kinds) if kind == "skirting"]
    assert boards
    for geom in boards:
        corners = geometry.vertices[geometry.faces[geometry.face_slices[geom]]]
        assert np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max() <= BOARD_EDGE_M + 1e-6


def test_a_leaf_stops_light_unless_it_opens(scene: Scene) -> None:
    stop = []
    for is_openable in (True, False):
        scene.things["cabinet"].is_openable = is_openable
        stop.append(set(model_cache.model_of(scene).render_scene.static_occluders.tolist()))
    ajar, shut = stop
    (leaf,) = shut - ajar
    assert ajar < shut
    assert leaf in model_cache.model_of(scene).things["cabinet"].geoms


def test_light_follows_what_moves_and_leaves_no_shade_behind(scene: Scene) -> None:
    scene.things["cube"].is_pickupable = True
    model = model_cache.model_of(scene)
    lighting, other = Lighting(model.render_scene), Lighting(model_cache.model_of(scene).render_scene)
    every = np.arange(model.native.ngeom)
    assert lighting.update(model.render_state(), every)[0]
    vertices, planes = lighting.vertices.copy(), lighting.planes.copy()
    assert planes.any()
    thing = scene.things["cube"]
    thing.position = Vec3(-0.5, 0.1, 0.4)  # beside the cabinet
    model.place(thing)
    model.update_kinematics()
    has_new_planes, changed = lighting.update(model.render_state(), every)
    assert not has_new_planes
    assert len(changed) == len(model.things["cube"].geoms)
    moved = np.flatnonzero((lighting.vertices != vertices).any(axis=1))
    assert len(moved)
    assert all(part.start <= moved.min() and moved.max() < part.stop for part in changed)
    assert np.array_equal(lighting.planes, planes)
    thing.position = Vec3(-1.0, 0.1, 0.0)
    model.place(thing)
    model.update_kinematics()
    lighting.update(model.render_state(), every)
    assert np.array_equal(lighting.vertices, vertices)
    for geom in every[::-1]:  # one after the other, as they come into view
        other.update(model.render_scene.initial, np.array([geom]))
    assert np.array_equal(other.vertices, vertices)
    assert np.array_equal(other.planes, planes)


def test_furniture_that_a_setup_has_moved_changes_the_light_on_itself_alone(scene: Scene) -> None:
    found = []
    for position in (scene.things["big"].position, Vec3(-1.3, 0.45, 1.3)):
        model = build(scene)
        put(model, scene.things["big"], position)
        lighting = Lighting(model.render_scene)
        lighting.update(model.render_state(), np.arange(model.native.ngeom))
        found.append((lighting.vertices, lighting.planes))
        (own,) = (lighting.geometry.vertex_slices[geom] for geom in model.things["big"].geoms)
        scene.things["big"].position = Vec3(1.3, 0.45, 1.3)
    (vertices, planes), (vertices_after, planes_after) = found
    changed = np.flatnonzero((vertices_after != vertices).any(axis=1))
    assert len(changed)
    assert own.start <= changed.min()
    assert changed.max() < own.stop
    assert np.array_equal(planes_after, planes)


@pytest.mark.parametrize("is_taken_away", [False, True])
def test_what_is_put_where_furniture_stood_is_lit(scene: Scene, is_taken_away) -> None:
    scene.things["cube"].is_pickupable = True
    model = model_cache.model_of(scene)
    lighting, every = Lighting(model.render_scene), np.arange(model.native.ngeom)
    (own,) = (lighting.geometry.vertex_slices[geom] for geom in model.things["cube"].geoms)
    big = scene.things["big"]
    before = big.position
    put(model, scene.things["cube"], before)
    lighting.update(model.render_state(), every)
    inside = lighting.vertices[own, :3].copy()
    big.is_present = not is_taken_away
    put(model, big, before if is_taken_away else Vec3(-1.3, 0.45, 1.3))
    lighting.update(model.render_state(), every)
    assert lighting.vertices[own, :3].mean() > inside.mean() + 20
    big.is_present = True
    put(model, big, before)
    lighting.update(model.render_state(), every)
    assert np.array_equal(lighting.vertices[own, :3], inside)


def test_how_a_case_looked_when_its_light_was_cast_does_not_matter(scene: Scene) -> None:
    cabinet = scene.things["cabinet"]
    found = []
    for is_toggled, is_broken, is_present in ((False, False, True), (True, True, True), (False, False, False)):
        model_cache.clear()
        model = model_cache.model_of(scene)
        every, lighting = np.arange(model.native.ngeom), Lighting(model.render_scene)
        cabinet.is_toggled, cabinet.is_broken, cabinet.is_present = is_toggled, is_broken, is_present
        put(model, cabinet, cabinet.position)
        lighting.update(model.render_state(), every)
        found.append(lighting.vertices)
        cabinet.is_toggled, cabinet.is_broken, cabinet.is_present = False, False, True
    assert np.array_equal(found[1], found[0])
    assert np.array_equal(found[2], found[0])


def put(model: CompiledModel, thing: Thing, position: Vec3) -> None:
    thing.position = position
    model.place(thing)
    model.update_kinematics()


def test_light_is_the_same_however_it_is_cast_in_parts(scene: Scene, monkeypatch) -> None:
    found = []
    for points in (10, 500, 10**6):
        monkeypatch.setattr(lighting_module, "PART_POINTS", points)
        model = build(scene)
        lighting = Lighting(model.render_scene)
        lighting.update(model.render_state(), np.arange(model.native.ngeom))
        found.append((lighting.vertices, lighting.planes))
    for vertices, planes in found[1:]:
        assert np.array_equal(vertices, found[0][0])
        assert np.array_equal(planes, found[0][1])


def test_a_failure_on_one_of_two_threads_is_told() -> None:
    with pytest.raises(ZeroDivisionError):
        lighting_module.run_in_parallel([lambda: 1, lambda: divmod(1, 0)])


def test_a_room_is_drawn_darker_while_its_lamp_is_dim(scene: Scene) -> None:
    model = model_cache.model_of(scene)
    lighting, every = Lighting(model.render_scene), np.arange(model.native.ngeom)
    lighting.update(model.render_state(), every)
    bright = lighting.planes.copy()
    model.lamps.dim_rooms = frozenset({0})
    assert lighting.update(model.render_state(), every)[0]
    assert lighting.planes[..., :3].mean() < 0.85 * bright[..., :3].mean()
    model.lamps.dim_rooms = frozenset()
    lighting.update(model.render_state(), every)
    assert np.array_equal(lighting.planes, bright)
