from dataclasses import replace

import numpy as np
import pytest
import shapely

from vigil.assets.catalog import CATALOG
from vigil.assets.kernel.asset import Glow
from vigil.assets.making import make
from vigil.base.geometry import Vec3
from vigil.protocol.house import MaterialRef
from vigil.scene.things import RoomShape, Scene, Thing
from vigil.sim.engines.mujoco.compiled.lights import DIM_SHARE, lamps_of, point_light_of

ELL = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.5), (1.5, 1.5), (1.5, 5.0), (0.0, 5.0)]
ZED = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (6.0, 2.0), (6.0, 3.0), (2.0, 3.0), (2.0, 1.0), (0.0, 1.0)]
BOX = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]


def room(polygon: list[tuple[float, float]], light: tuple[float, float], name: str = "r") -> RoomShape:
    material = MaterialRef(name="plaster/white")
    place = Vec3(light[0], 2.4, light[1])
    return RoomShape(name, "Kitchen", np.array(polygon), 2.5, material, None, place, (1.0, 1.0, 1.0))


def lamp_of(shape: RoomShape) -> tuple[float, float]:
    ((x, z, height),) = lamps_of(Scene(rooms=[shape], panels=[])).places
    assert 0.0 < shape.height - height < 0.1
    return x, z


def test_a_lamp_that_reaches_every_corner_stays() -> None:
    assert lamp_of(room(BOX, (2.5, 1.0))) == pytest.approx((2.5, 1.0))


def test_a_lamp_moves_to_where_it_reaches_both_legs() -> None:
    x, z = lamp_of(room(ELL, (3.5, 0.7)))
    floor = shapely.Polygon(ELL).buffer(1e-6)
    assert all(floor.contains(shapely.LineString([(x, z), corner])) for corner in ELL)


def test_a_lamp_stays_where_no_place_reaches_every_corner() -> None:
    assert lamp_of(room(ZED, (2.5, 1.5))) == pytest.approx((2.5, 1.5))


def test_the_lamp_over_somebody_is_that_of_the_nearest_room() -> None:
    rooms = [room([(x + 5.0 * n, z) for x, z in BOX], (5.0 * n + 2.0, 1.5), f"r{n}") for n in range(9)]
    lamps = lamps_of(Scene(rooms=rooms, panels=[]))
    assert lamps.place_over(np.array([21.0, 1.0, 1.6])) == pytest.approx(lamps.places[4])
    assert lamps.place_over(np.array([-3.0, 1.0, 1.6])) == pytest.approx(lamps.places[0])


def test_what_is_on_shines_from_where_it_is(scene: Scene) -> None:
    glow = Glow(Vec3(0.0, 0.3, 0.1), (1.0, 0.5, 0.25), 0.8)
    cabinet = scene.things["cabinet"]
    cabinet.asset = replace(cabinet.asset, glow=glow)
    # The cabinet is turned by half, so what is in front of its middle lies towards -z (MuJoCo's -y).
    assert point_light_of(cabinet).place == pytest.approx((0.0, 0.4, 0.7))
    assert point_light_of(cabinet).colour[0] > point_light_of(cabinet).colour[2] > 0
    with pytest.raises(ValueError, match="is not a lamp"):
        point_light_of(scene.things["cube"])


def test_a_room_is_dim_while_its_switches_are_off() -> None:
    size = CATALOG["LightSwitch"].typical_size
    switch = Thing("s", "LightSwitch", make("LightSwitch", size, 0), Vec3(2.0, 1.1, 0.01), Vec3(0.0, 0.0, 0.0))
    other = replace(switch, id="t", is_toggled=True)
    rooms = [room([(x, z - 3.0) for x, z in BOX], (2.0, -1.5), "behind"), room(BOX, (2.0, 1.5), "before")]
    lamps = lamps_of(Scene(rooms=rooms, panels=[], things={"s": switch, "t": other}))
    tested: list[str] = []

    def brightness(index: int, seen: str) -> float:
        tested.clear()
        lamps.update_switches([switch, other], lambda each: tested.append(each.id) or each.id in seen)
        return float(lamps.strengths()[index].mean())

    behind, dim = brightness(0, "s"), brightness(1, "s")
    assert brightness(1, "st") == pytest.approx(dim / DIM_SHARE)
    assert tested == ["s", "t"]
    assert brightness(1, "t") == pytest.approx(dim / DIM_SHARE)
    assert tested == ["s"]
    switch.is_toggled = True
    assert brightness(1, "s") == pytest.approx(dim / DIM_SHARE)
    assert brightness(0, "s") == pytest.approx(behind)
    assert not tested
