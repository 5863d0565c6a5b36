"""Boxes around what rays meet: everything met lies in a box of what is met."""

import numpy as np

from vigil.assets.database import AssetDatabase
from vigil.packs.pack import Pack
from vigil.scene.build import build_scene
from vigil.sim.engines.mujoco.compiled.model import CompiledModel, build


def model_of_a_house() -> CompiledModel:
    pack = Pack.load("starter")
    return build(build_scene(pack.house_of(pack.episodes[0]), AssetDatabase.default()))


def vertices_of(model: CompiledModel, geom: int) -> np.ndarray:
    native, mesh = model.native, model.native.geom_dataid[geom]
    first = native.mesh_vertadr[mesh]
    vertices = native.mesh_vert[first : first + native.mesh_vertnum[mesh]]
    return vertices @ model.data.geom_xmat[geom].reshape(3, 3).T + model.data.geom_xpos[geom]


def test_every_vertex_lies_in_a_box_of_its_geom() -> None:
    model = model_of_a_house()
    bounds = model.bounds()
    for geom in np.flatnonzero(model.native.geom_dataid >= 0):
        own = bounds.geoms == geom
        assert own.any()
        points = vertices_of(model, int(geom))[:, :, None]
        is_in = ((points >= bounds.lows[:, own]) & (points <= bounds.highs[:, own])).all(axis=1)
        assert np.any(is_in, axis=1).all()


def test_a_plane_is_beside_nothing() -> None:
    model = model_of_a_house()
    planes = np.flatnonzero(model.native.geom_dataid < 0)
    far = np.full(3, 1e6)
    is_beside = model.bounds().geoms_outside(far, far + 1.0, model.native.ngeom)
    assert len(planes)
    assert not is_beside[planes].any()
    assert is_beside[model.native.geom_dataid >= 0].all()


def test_walls_have_boxes_of_their_pieces() -> None:
    model = model_of_a_house()
    walls = [geom for geom, kind in enumerate(model.render_scene.structure_kinds) if kind == "wall"]
    middle = (model.data.geom_xpos[walls[0]] * [1.0, 1.0, 0.0]) + [0.0, 0.0, 1.2]
    is_beside = model.bounds().geoms_outside(middle - 0.1, middle + 0.1, model.native.ngeom)
    assert is_beside[walls].all()


def test_a_copy_follows_its_own_things() -> None:
    model = model_of_a_house()
    first = model.bounds().lows.copy()
    copy = model.copy()
    copy.data.mocap_pos[:] += 1.0
    copy.update_kinematics()
    assert (model.bounds().lows == first).all()
    assert (copy.bounds().lows != first).any()
