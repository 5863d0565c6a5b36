"""Check of the graphics: whether frames can be drawn on this machine, with which OpenGL library, and how fast."""

import time
from typing import Any

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.assets.making import make
from vigil.base.geometry import Pose, Vec3
from vigil.errors import SimulatorError
from vigil.protocol.house import MaterialRef
from vigil.scene.things import RoomShape, Scene, Thing, WallPanel
from vigil.sim.engines.mujoco.camera import gl_strings
from vigil.sim.engines.mujoco.compiled.binding import BACKEND, mujoco
from vigil.sim.engines.mujoco.engine import MujocoEngine

FRAMES = 5


def check_graphics() -> dict[str, Any]:
    """Return the results: `ok`, `backend`, `fault` (None if frames can be drawn), OpenGL's names, times and `frame`."""
    found: dict[str, Any] = {
        "ok": False,
        "mujoco": mujoco.__version__,
        "backend": BACKEND.name,
        "chosen_by_user": BACKEND.is_chosen_by_user,
        "fault": BACKEND.fault,
        "frame": None,
    }
    if BACKEND.fault:
        return found
    try:
        found |= {f"gl_{name}": text for name, text in gl_strings().items()} | _draw_one()
    except SimulatorError as error:
        return found | {"fault": str(error)}
    return found | {"ok": found["fault"] is None}


def _draw_one() -> dict[str, Any]:
    engine, agent = MujocoEngine(), Pose(position=Vec3(0.0, 0.0, -1.5), rotation=0.0, horizon=20.0)
    start = time.perf_counter()
    engine.load(_sample())
    frame = engine.draw(agent, None)
    first = time.perf_counter() - start
    start = time.perf_counter()
    for number in range(FRAMES):
        engine.draw(agent.model_copy(update={"rotation": float(number)}), None)
    each = (time.perf_counter() - start) / FRAMES
    engine.close()
    fault = None if frame.std() > 5.0 else "the frame that was drawn is blank"
    return {"first_frame_s": first, "frame_s": each, "frame": frame, "fault": fault}


def _sample() -> Scene:
    """Return a sample scene: a room with an apple on a table."""
    corners = np.array([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)])
    room = RoomShape(
        "room", "Kitchen", corners, 2.5, MaterialRef(name="planks/oak"), None, Vec3(0.0, 2.4, 0.0), (1.0, 1.0, 1.0)
    )
    plaster = MaterialRef(name="plaster/white")
    panels = [
        WallPanel(f"wall{number}", "room", tuple(start), tuple(end), 0.0, 2.5, tuple(-(start + end) / 4.0), plaster)
        for number, (start, end) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True))
    ]
    table, apple = CATALOG["DiningTable"].typical_size, CATALOG["Apple"].typical_size
    things = [
        Thing("table", "DiningTable", make("DiningTable", table, 0), Vec3(0.0, table.y / 2, 0.0), Vec3(0.0, 0.0, 0.0)),
        Thing("apple", "Apple", make("Apple", apple, 0), Vec3(0.0, table.y + apple.y / 2, 0.0), Vec3(0.0, 0.0, 0.0)),
    ]
    return Scene(rooms=[room], panels=panels, things={thing.id: thing for thing in things})
