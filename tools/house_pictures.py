"""Draws the pictures of docs/houses.md, plan and two inside views of six houses: `python -m tools.house_pictures`."""

from pathlib import Path

import numpy as np
from PIL import Image
from shapely import Polygon, contains_xy

from vigil.assets.catalog import CATALOG
from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose, Vec3, heading
from vigil.housegen.base.spec import spec_for
from vigil.housegen.generate import generate
from vigil.protocol.house import House
from vigil.protocol.world import ObjectSetup, Setup
from vigil.scene.plan_image import draw_plan, plan_and_view
from vigil.scene.things import Scene
from vigil.sim import make_simulator
from vigil.sim.core.motion import CollisionMap
from vigil.sim.pictures.renders import render_birdseye
from vigil.sim.privileged import PrivilegedSimulator

FOLDER = Path(__file__).parents[1] / "docs" / "houses"
HOUSES = (("kitchen", 11), ("bedroom", 9), ("2", 12), ("3", 5), ("4", 21), ("6", 8))
"""Specs and seeds of the six."""
PLAN_WIDTH_PX, VIEW_WIDTH_PX = 1100, 544
TRIAL_PX_PER_M = 10
"""Size of a plan that is drawn to measure the widths of plan and view."""
QUALITY = 84
HORIZON = 12.0
NEAR_M, FAR_M = 0.9, 5.0


def main() -> None:
    """Write the pictures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    simulator = make_simulator("mujoco", assets=AssetDatabase.default())
    for spec, seed in HOUSES:
        house = generate(seed, spec_for(spec))
        simulator.load(house)
        name = f"{house.name}".replace("-", "_")
        _save(_overview(house, simulator.scene()), f"{name}_plan", PLAN_WIDTH_PX)
        for number, pose in enumerate(_viewpoints(house, simulator), start=1):
            simulator.reset(pose, Setup())
            _save(Image.fromarray(simulator.frame()), f"{name}_view{number}", VIEW_WIDTH_PX)
        print(name)
    simulator.close()


def _overview(house: House, scene: Scene) -> Image.Image:
    """Return the plan next to the view from above, nearly as wide as they are saved, so that words stay legible."""
    view, trial = render_birdseye(scene), draw_plan(house, scene, TRIAL_PX_PER_M)
    width = trial.width + view.shape[1] * trial.height / view.shape[0]
    return plan_and_view(draw_plan(house, scene, TRIAL_PX_PER_M * PLAN_WIDTH_PX / width), view)


def _save(picture: Image.Image, name: str, width: int) -> None:
    height = round(picture.height * width / picture.width)
    picture.resize((width, height), Image.Resampling.LANCZOS).save(FOLDER / f"{name}.jpg", quality=QUALITY)


def _viewpoints(house: House, simulator: PrivilegedSimulator) -> list[Pose]:
    """Return the place and heading that show most in each of two rooms; in the one room, two that differ."""
    doors = {door.id: ObjectSetup(openness=1.0) for door in house.document.doors if door.openable}
    assert house.start is not None
    simulator.reset(house.start, Setup(objects=doors))
    places = CollisionMap(simulator.scene()).reachable(house.start.position)
    found: list[tuple[float, Pose]] = []
    for room in house.document.rooms:
        floor = Polygon([(point.x, point.z) for point in room.floor_polygon])
        inside = next(
            near
            for margin in (0.7, 0.5, 0.3, 0.0)
            if len(near := places[contains_xy(floor.buffer(-margin), places[:, 0], places[:, 1])])
        )
        middles = [
            (thing.position.x, thing.position.z, 0.3 if CATALOG[thing.category].is_pickupable else 1.0)
            for thing in simulator.scene().things.values()
            if contains_xy(floor, thing.position.x, thing.position.z)
        ]
        views = [
            (_seen(np.array(middles), x, z, yaw), Pose(position=Vec3(x, 0.0, z), rotation=yaw, horizon=HORIZON))
            for x, z in inside.tolist()
            for yaw in range(0, 360, 30)
        ]
        best = max(views, key=lambda view: view[0])
        found.append(best)
        if len(house.document.rooms) == 1:
            turned = [view for view in views if abs((view[1].rotation - best[1].rotation) % 360 - 180) <= 90]
            found.append(max(turned, key=lambda view: view[0]))
    found.sort(key=lambda view: -view[0])
    return [pose for _, pose in found[:2]]


def _seen(things: np.ndarray, x: float, z: float, yaw: float) -> float:
    """Return how much is before one, neither too near nor too far to make out."""
    dx, dz = heading(yaw)
    ahead = (things[:, 0] - x) * dx + (things[:, 1] - z) * dz
    aside = np.abs((things[:, 0] - x) * dz - (things[:, 1] - z) * dx)
    return float(things[(ahead > NEAR_M) & (ahead < FAR_M) & (aside < 1.1 * ahead), 2].sum())


if __name__ == "__main__":
    main()
