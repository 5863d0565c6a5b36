"""Setups: what an episode changes in a house before it starts (openness, switches, positions, absences, hand)."""

import difflib

from vigil.assets.notice import notice_parts
from vigil.base.geometry import Pose
from vigil.errors import EpisodeError
from vigil.protocol.world import ObjectSetup, Placement, Setup
from vigil.scene.build import rest_on_surface
from vigil.scene.supports import ancestors, contents
from vigil.scene.things import Scene, Thing
from vigil.sim.core.opening import pierced_carrier, set_openness
from vigil.sim.core.state import SceneState


def apply_setup(state: SceneState, setup: Setup, house_name: str, *, checks_leaves: bool = True) -> None:
    """Change the scene as a setup says. Raises EpisodeError when the house does not allow the changes.

    Without `checks_leaves`, open leaves (doors, lids, drawers) may reach through walls and through containers.
    """
    wanted = things_named(setup, state.scene, house_name)
    for thing, change in wanted:
        _set_states(state, thing, change)
    placed = [(thing, change.placement) for thing, change in wanted if change.placement is not None]
    for thing, placement in sorted(placed, key=lambda pair: (len(ancestors(state.scene, pair[0])), pair[0].id)):
        _put(state, thing, placement, house_name)
    for thing, change in wanted:
        if change.is_absent:
            for gone in [thing, *contents(state.scene, thing.id)]:
                gone.is_present = False
                state.mark_changed(gone)
    for thing, _ in placed:
        if not thing.is_present:
            raise EpisodeError(
                f"Setup: {thing.id!r} is placed on {thing.parent!r}, which is taken out of the scene. Place it "
                "elsewhere."
            )
    if setup.held is not None:
        held = state.scene.things[setup.held]
        check_can_be_held(held)
        state.take(held)
        state.move_held()
    if checks_leaves:
        _check_walls(state, [thing for thing, _ in wanted])
        _check_carriers(state, [thing for thing, _ in wanted])


def blocked_start_error(start: Pose, house_name: str) -> EpisodeError:
    """Return the error for a start at which the body does not fit."""
    x, _, z = start.position
    return EpisodeError(
        f"House {house_name!r}: the start ({x:.2f}, {z:.2f}) is inside an obstacle or outside every room. Choose a "
        "start on the free floor: `vigil houses show` draws it."
    )


def thing_named(object_id: str, scene: Scene, house_name: str) -> Thing:
    """Return the thing with this id. Raises EpisodeError if the house does not have it."""
    thing = scene.things.get(object_id)
    if thing is None:
        raise EpisodeError(unknown_object_message(object_id, scene, house_name))
    return thing


def unknown_object_message(object_id: str, scene: Scene, house_name: str) -> str:
    """Return the message for an id that the house does not have."""
    close = difflib.get_close_matches(object_id, scene.things, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else f" It has {len(scene.things)} objects."
    return f"Object {object_id!r} is absent from house {house_name!r}.{hint}"


def check_can_be_held(thing: Thing) -> None:
    """Raise EpisodeError if a thing cannot be held, so that a setup must not put it into the hand."""
    if not thing.is_pickupable or not thing.is_present:
        raise EpisodeError(f"Setup: {thing.id!r} ({thing.category}) cannot be held: it is absent or not pickupable.")


def things_named(setup: Setup, scene: Scene, house_name: str) -> list[tuple[Thing, ObjectSetup]]:
    """Return (thing, change) for each thing that a setup changes. Raises EpisodeError on an unknown id."""
    for object_id in [*setup.objects, *([setup.held] if setup.held else [])]:
        if object_id not in scene.things:
            raise EpisodeError(f"Setup: {unknown_object_message(object_id, scene, house_name)}")
    return [(scene.things[object_id], change) for object_id, change in setup.objects.items()]


def changed_states(thing: Thing, change: ObjectSetup, *, can_open: bool) -> tuple[float | None, bool | None]:
    """Return the openness and the switch state that a setup changes, each None if it stays. Raises EpisodeError."""
    openness = None if change.openness == thing.openness else change.openness
    if openness is not None and not can_open:
        raise EpisodeError(f"Setup: {thing.id!r} ({thing.category}) has no part that opens; leave out its `openness`.")
    is_toggled = None if change.is_toggled == thing.is_toggled else change.is_toggled
    if is_toggled is not None and not thing.is_toggleable:
        raise EpisodeError(f"Setup: {thing.id!r} ({thing.category}) cannot be switched; leave out its `is_toggled`.")
    return openness, is_toggled


def carrier_of(thing: Thing, placement: Placement, scene: Scene, house_name: str) -> Thing | None:
    """Return the parent of a thing that a setup places, if there is one. Raises EpisodeError."""
    if thing.is_structure:
        raise EpisodeError(f"Setup: {thing.id!r} is a door or window and cannot be placed elsewhere.")
    if placement.parent is not None and placement.parent not in scene.things:
        missing = unknown_object_message(placement.parent, scene, house_name)
        raise EpisodeError(f"Setup: parent of {thing.id!r}: {missing}")
    return None if placement.parent is None else scene.things[placement.parent]


def _set_states(state: SceneState, thing: Thing, change: ObjectSetup) -> None:
    openness, is_toggled = changed_states(thing, change, can_open=thing.asset.can_open)
    if openness is not None:
        set_openness(state, thing, openness)
    if is_toggled is not None:
        thing.is_toggled = is_toggled
        state.mark_changed(thing)
    if change.is_broken:
        _break(state, thing)


def _break(state: SceneState, thing: Thing) -> None:
    if not thing.is_toggleable or not notice_parts(thing.asset):
        raise EpisodeError(
            f"Setup: {thing.id!r} ({thing.category}) cannot be broken: only machines with a front on which a notice "
            "can hang can be. Leave out its `is_broken`."
        )
    if thing.is_toggled:
        raise EpisodeError(
            f"Setup: {thing.id!r} ({thing.category}) cannot run while it is broken; set its `is_toggled` to false."
        )
    thing.is_broken = True
    state.mark_changed(thing)


def _check_walls(state: SceneState, changed: list[Thing]) -> None:
    """Raise EpisodeError if an open leaf (door, lid or drawer) of a changed thing reaches into the next room."""
    if any(thing.is_structure for thing in changed):  # a shut door is one more partition
        changed = list(state.scene.things.values())
    for thing in changed:
        if not thing.is_present or thing.is_held or thing.openness == 0.0:
            continue
        through = state.partitions.reaches_through(thing, thing.openness)
        if through is not None:
            raise EpisodeError(
                f"Setup: at openness {thing.openness:g}, {thing.id!r} ({thing.category}) reaches through {through!r} "
                "into the next room. Lower its `openness`, or place it elsewhere."
            )


def _check_carriers(state: SceneState, changed: list[Thing]) -> None:
    """Raise EpisodeError if an open leaf of a thing (e.g. a book's cover) reaches through the thing's container."""
    touched = {each.id: each for thing in changed for each in [thing, *contents(state.scene, thing.id)]}
    for thing in touched.values():
        carrier = pierced_carrier(state, thing) if thing.is_present and not thing.is_held else None
        if carrier is not None:
            raise EpisodeError(
                f"Setup: at openness {thing.openness:g}, {thing.id!r} ({thing.category}) sticks out of "
                f"{carrier!r}, in which it lies. Lower its `openness`, or place it elsewhere."
            )


def _put(state: SceneState, thing: Thing, placement: Placement, house_name: str) -> None:
    if thing.is_drawer:
        raise EpisodeError(f"Setup: {thing.id!r} is a drawer of {thing.parent!r} and cannot be placed elsewhere.")
    parent = carrier_of(thing, placement, state.scene, house_name)
    if parent is not None and thing in (parent, *ancestors(state.scene, parent)):
        raise EpisodeError(
            f"Setup: {thing.id!r} cannot rest on {parent.id!r}, because {parent.id!r} rests on {thing.id!r}. "
            "Place it on something else."
        )
    thing.parent, thing.surface, thing.parent_joint = placement.parent, None, None
    state.move(thing, placement.position, placement.rotation)
    if parent is not None:
        before = thing.position
        rest_on_surface(thing, parent)
        rested, thing.position = thing.position, before
        if rested != before:
            state.move(thing, rested, thing.rotation)
