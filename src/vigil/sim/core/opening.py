"""Opening and closing: a leaf, lid or drawer moves all the way; if something is in its way, it does not move at all.

The moving solids are tested at closely spaced samples of their motion. A solid is blocked if it gets deeper into
another thing or the agent's body than at the start, by more than a tolerance. There is a tolerance because neighbours
in generated houses often touch or overlap a little. The tolerance is larger for things in or on a wall. Walls, windows
and shut doors have no tolerance: no part, not even a handle, may reach into the next room (`vigil.scene.partitions`).

Things in a drawer move with the drawer. If one of them is open, for example a book, its cover must not hit the body of
the drawer's furniture, or anything else.
"""

import math

import numpy as np

from vigil.assets.catalog import CATALOG, WALL
from vigil.scene.geometry import Prism, joint_of, moving_prisms_of, part_motion, penetrations, prisms_of
from vigil.scene.supports import (
    children,
    containers_of,
    contents,
    furniture_of,
    joint_is_hinge,
    moved_by_joint,
    surface_named,
)
from vigil.scene.things import Thing
from vigil.sim.core.state import AGENT, SceneState

TOLERANCE_M = 0.015
"""How much deeper (m) than at the start a moving part may reach into another thing."""
WALL_TOLERANCE_M = 0.05
"""How much deeper (m) than at the start a moving part may reach into a thing that is in or on a wall."""
SAMPLE_M = 0.02
"""Greatest distance (m) that a moving part travels between two samples of its motion."""
MOVED_WITHIN = 0.005
"""If a thing's openness differs from the wanted openness by less than this, the thing does not move."""


def opening_blocker(state: SceneState, thing: Thing, target: float) -> str | None:
    """Return the id of what blocks a thing's moving parts on the way to openness `target`; None if nothing does."""
    rider = _rider(state, thing)
    if rider is not None:
        return rider
    samples = _samples(thing, target)
    partition = state.partitions.blocker(thing, samples)
    if partition is not None:
        return partition
    obstacles = _obstacles(state, thing)
    struck = _first_collision(state, [moving_prisms_of(thing, openness) for openness in samples], obstacles)
    return struck or _carried_collision(state, thing, samples, obstacles)


def _first_collision(state: SceneState, path: list[list[Prism]], obstacles: list[tuple[str, Prism]]) -> str | None:
    """Return the owner of the obstacle that blocks moving solids on their path; None if no obstacle does.

    `path` has the solids at each sample of their motion, always in the same order; the first sample is the start.
    """
    if not path[0]:
        return None
    obstacles = _within_reach(obstacles, path)
    if not obstacles:
        return None
    solids = [solid for _, solid in obstacles]
    at_rest = penetrations(path[0], solids)
    things = [state.scene.things.get(owner) for owner, _ in obstacles]
    at_wall = [each is not None and (each.is_structure or WALL in CATALOG[each.category].rests_on) for each in things]
    slack = np.where(at_wall, WALL_TOLERANCE_M, TOLERANCE_M)
    for prisms in path[1:]:
        excess = penetrations(prisms, solids) - np.maximum(at_rest, 0.0) - slack
        if float(excess.max()) > 0.0:
            return obstacles[int(np.unravel_index(int(excess.argmax()), excess.shape)[1])][0]
    return None


def _carried_collision(
    state: SceneState, thing: Thing, samples: list[float], obstacles: list[tuple[str, Prism]]
) -> str | None:
    """Return the id of what blocks an open thing, such as a book, that a moving part carries; None if nothing does.

    If the body of `thing` itself blocks the carried thing (for a drawer, the body of its furniture), return the id of
    the carried thing.
    """
    whole = furniture_of(state.scene, thing) or thing
    body = [prism for prism in prisms_of(whole) if prism.joint is None]
    obstacles = [(owner, prism) for owner, prism in obstacles if owner != whole.id]
    for joint in thing.asset.joints:
        before = part_motion(thing, joint.name).inverse()
        motions = [part_motion(thing, joint.name, openness).after(before) for openness in samples]
        for carried in moved_by_joint(state.scene, thing, joint.name):
            if carried.openness == 0.0:
                continue
            path = [moving_prisms_of(carried, along=motion) for motion in motions]
            struck = _first_collision(state, path, [*obstacles, *((carried.id, prism) for prism in body)])
            if struck is not None:
                return struck
    return None


def pierced_carrier(state: SceneState, thing: Thing) -> str | None:
    """Return the id of a container of `thing` whose body an open leaf (e.g. a book's cover) of `thing` pierces.

    None if there is none. A leaf pierces the body if it reaches deeper into the body than when it is shut.
    """
    if thing.openness == 0.0:
        return None
    shut, now = (moving_prisms_of(thing, openness) for openness in (0.0, thing.openness))
    for carrier in containers_of(state.scene, thing):
        body = [(carrier.id, prism) for prism in prisms_of(carrier) if prism.joint is None]
        struck = _first_collision(state, [shut, now], body)
        if struck is not None:
            return struck
    return None


def set_openness(state: SceneState, thing: Thing, target: float) -> list[Thing]:
    """Open or close a thing without any check, and move what its moving parts carry.

    Return the changed things, `thing` first.
    """
    moved: list[Thing] = []
    for joint in thing.asset.joints:
        along = moved_by_joint(state.scene, thing, joint.name)
        before, after = part_motion(thing, joint.name), part_motion(thing, joint.name, target)
        moved += state.shift(along, after.after(before.inverse()))
    thing.openness = target
    state.mark_changed(thing)
    return [thing, *moved]


def _rider(state: SceneState, thing: Thing) -> str | None:
    """Return the id of a thing on a lid or cover that cannot carry things (a pen on a laptop), or None."""
    if not any(joint.kind == "hinge" for joint in thing.asset.joints):
        return None
    riders = (child.id for child in children(state.scene, thing.id) if not _goes_along_or_lies_inside(thing, child))
    return next((rider for rider in riders if state.scene.things[rider].surface is None), None)


def _samples(thing: Thing, target: float) -> list[float]:
    """Return the values of openness at which the motion is tested, from the thing's present openness to `target`."""
    reach = max((_travel_m(thing, joint.name) for joint in thing.asset.joints), default=0.0)
    count = max(2, math.ceil(reach * abs(target - thing.openness) / SAMPLE_M) + 1)
    return [float(value) for value in np.linspace(thing.openness, target, count)]


def _travel_m(thing: Thing, name: str) -> float:
    """Return the greatest distance (m) that a joint's solids travel from closed to open."""
    joint = joint_of(thing.asset, name)
    if joint is None or joint.kind == "slide":
        return abs(joint.travel) if joint else 0.0
    carried = [solid for solid in thing.asset.solids if solid.joint == name]
    corners = [(x, y, z) for solid in carried for x, z in solid.polygon for y in (solid.bottom, solid.top)]
    arm = max((math.dist(corner, joint.origin) for corner in corners), default=0.0)
    return arm * math.radians(abs(joint.travel))


def _obstacles(state: SceneState, thing: Thing) -> list[tuple[str, Prism]]:
    """Return (id, solid) of everything that can block the thing's moving parts, except walls, windows and shut doors.

    The thing itself, the things that move with it and the things inside it are left out.
    """
    ignored = {thing.id}
    for child in children(state.scene, thing.id):
        if _goes_along_or_lies_inside(thing, child):
            ignored.update(each.id for each in [child, *contents(state.scene, child.id)])
    return [*state.thing_solids(ignored), (AGENT, state.body())]


def _goes_along_or_lies_inside(thing: Thing, child: Thing) -> bool:
    surface = surface_named(thing, child.surface)
    if surface is None:
        return thing.asset.size.y / 2 > child.position.y - thing.position.y
    return surface.needs_opening or (surface.joint is not None and not joint_is_hinge(thing, surface.joint))


def _within_reach(solids: list[tuple[str, Prism]], path: list[list[Prism]]) -> list[tuple[str, Prism]]:
    """Return the solids whose bounds overlap the bounds of the whole path."""
    corners = np.concatenate([prism.polygon for prisms in path for prism in prisms])
    low, high = corners.min(axis=0), corners.max(axis=0)
    bottom, top = min(p.bottom for prisms in path for p in prisms), max(p.top for prisms in path for p in prisms)
    near: list[tuple[str, Prism]] = []
    for owner, prism in solids:
        left, front, right, back = prism.bounds
        is_beside = left >= high[0] or right <= low[0] or front >= high[1] or back <= low[1]
        if not is_beside and prism.bottom < top and prism.top > bottom:
            near.append((owner, prism))
    return near
