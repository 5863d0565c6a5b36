from dataclasses import replace

import numpy as np
import pytest
import shapely

from vigil.assets import make
from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Glow
from vigil.house import MaterialRef
from vigil.pose import Vec3
from vigil.scene.things import RoomShape, Scene, Thing
from vigil.sim.engines.mujoco.model import build

ELL = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.5), (1.5, 1.5), (1.5, 5.0), (0.0, 5.0)]
ZED = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (6.0, 2.0), (6.0, 3.0), (2.0, 3.0), (2.0, 1.0), (0.0, 1.0)]
BOX = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]


def room(polygon: list[tuple[float, float]], light: tuple[float, float], name: str = "r") -> RoomShape:
    material = MaterialRef(name="plaster/white")
    place = Vec3(light[0], 2.4, light[1])
    return RoomShape(name, "Kitchen", np.array(polygon), 2.5, material, None, place, (1.0, 1.0, 1.0), 1.0)


def lamp_of(shape: RoomShape) -> tuple[float, float]:
    model = build(Scene(rooms=[shape], panels=[]))
    x, z, height = model.native.light_pos[model.lamps.room_lights[0]]
    assert height > shape.height
    return x, z


def test_a_lamp_that_reaches_every_corner_stays() -> None:
    assert lamp_of(room(BOX, (2.5, 1.0))) == pytest.approx((2.5, 1.0))


def test_a_lamp_moves_to_where_it_reaches_both_legs() -> None:
    x, z = lamp_of(room(ELL, (3.5, 0.7)))
    floor = shapely.Polygon(ELL).buffer(1e-6)
    assert all(floor.contains(shapely.LineString([(x, z), corner])) for corner in ELL)


def test_a_lamp_stays_where_no_place_reaches_every_corner() -> None:
    assert lamp_of(room(ZED, (2.5, 1.5))) == pytest.approx((2.5, 1.5))


def test_one_lamp_casts_shadows_and_all_lights_fit_into_opengl() -> None:
    rooms = [room([(x + 5.0 * n, z) for x, z in BOX], (5.0 * n + 2.0, 1.5), f"r{n}") for n in range(9)]
    model = build(Scene(rooms=rooms, panels=[]))
    scale = model.lamps.select(model.native, Vec3(21.0, 1.6, 1.0), [])
    assert 0.2 < scale < 0.42
    assert np.flatnonzero(model.native.light_castshadow).tolist() == [model.lamps.room_lights[4]]
    headlight = 1
    assert np.count_nonzero(model.native.light_active) + headlight + len(model.lamps.glow_lights) <= 8


def test_the_nearest_things_that_are_on_shine_from_where_they_are(scene: Scene) -> None:
    glow = Glow(Vec3(0.0, 0.3, 0.1), (1.0, 0.5, 0.25), 0.8)
    for thing in scene.things.values():
        thing.asset = replace(thing.asset, glow=glow)
    model = build(scene)
    lamps, native = model.lamps, model.native
    lamps.select(native, Vec3(0.0, 1.6, 0.0), list(scene.things.values()))
    first, second = lamps.glow_lights
    assert native.light_active[[first, second]].all()
    # The cabinet is turned by half, so what is in front of its middle lies towards -z (MuJoCo's -y).
    assert native.light_pos[first] == pytest.approx((0.0, 0.4, 0.7))
    assert native.light_pos[second] == pytest.approx((-1.0, 0.1, 0.4))
    assert native.light_diffuse[first][0] > native.light_diffuse[first][2] > 0
    lamps.select(native, Vec3(0.0, 1.6, 0.0), [])
    assert not native.light_active[lamps.glow_lights].any()


def test_a_room_is_dim_while_its_switches_are_off() -> None:
    size = CATALOG["LightSwitch"].typical_size
    switch = Thing("s", "LightSwitch", make("LightSwitch", size, 0), Vec3(2.0, 1.1, 0.01), Vec3(0.0, 0.0, 0.0))
    rooms = [room([(x, z - 3.0) for x, z in BOX], (2.0, -1.5), "behind"), room(BOX, (2.0, 1.5), "before")]
    scene = Scene(rooms=rooms, panels=[], things={"s": switch})
    model = build(scene)
    lamps, native = model.lamps, model.native

    def brightness(index: int) -> float:
        lamps.heed(scene)
        lamps.select(native, Vec3(2.0, 1.6, 1.5), [])
        return float(native.light_diffuse[lamps.room_lights[index]].mean())

    behind, dim = brightness(0), brightness(1)
    switch.is_toggled = True
    assert brightness(1) == pytest.approx(4 * dim)
    assert brightness(0) == pytest.approx(behind)
