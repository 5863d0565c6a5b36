"""Levels of episodes, and the measures that determine them. Each solution is replayed in its house and measured.

No frames are rendered: rays in the simulator determine what a frame would show. `vigil.scoring.levels` defines the
measures.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from vigil.authoring.language.drawer_names import without_position
from vigil.authoring.language.referring import Phrase, referents
from vigil.authoring.packing.verify import HouseBatch, VerificationSettings, house_batches, pack_tasks
from vigil.authoring.review.containers import may_hold, room_mentioned
from vigil.authoring.review.episode_start import EpisodeStart
from vigil.authoring.review.rules import INSIDE_TEMPLATE
from vigil.authoring.solving.goal_actions import closed_containers_around
from vigil.authoring.solving.look_targets import surface_points
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, Vec3
from vigil.base.processes.group import map_in_workers
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action, Navigate, Report
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.goals import OBSERVABLE_PX
from vigil.protocol.house import House
from vigil.scene.things import Thing
from vigil.scoring.levels import EpisodeLevel, LevelMeasures, grade_episode
from vigil.sim.privileged import PrivilegedSimulator

ROOM_STEP_M = 0.1
"""Distance (m) between the points of a walk at which the current room is looked up. No passage is shorter."""
OnMeasured = Callable[[int, int], None]
"""Function that is called with the number of episodes measured so far and the number of all episodes."""


def pack_levels(
    pack: Pack, settings: VerificationSettings, on_measured: OnMeasured = lambda done, of: None
) -> list[EpisodeLevel]:
    """Return, sorted by id, the levels of those episodes of a pack that have a recorded solution."""
    return measured_levels(house_batches(pack_tasks(pack), pack.house_of), settings, on_measured)


def measured_levels(
    work: Sequence[HouseBatch], settings: VerificationSettings, on_measured: OnMeasured = lambda done, of: None
) -> list[EpisodeLevel]:
    """Return, sorted by id, the levels of those episodes that have a solution."""
    total = sum(len(task.episodes) for batch in work for task in batch.tasks)
    found: list[EpisodeLevel] = []
    for batch in map_in_workers(settings.simulator, _measure, work, settings.workers):
        found += batch
        on_measured(len(found), total)
    return sorted(found, key=lambda each: each.episode_id)


def _measure(simulator: PrivilegedSimulator, batch: HouseBatch) -> list[EpisodeLevel]:
    house = House(batch.name, batch.document)
    simulator.load(house)
    return [
        grade_episode(episode, measures_of_episode(simulator, episode, house, actions))
        for task in batch.tasks
        for episode, actions in zip(task.episodes, task.solutions, strict=True)
        if actions is not None
    ]


def measures_of_episode(
    simulator: PrivilegedSimulator, episode: Episode, house: House, actions: Sequence[Action]
) -> LevelMeasures:
    """Return the measures of an episode. `actions` is its solution; its house must be loaded in the simulator."""
    simulator.reset(episode.start, episode.setup)
    view = PrivilegedView(simulator)
    start = EpisodeStart(episode, house, view)
    target = view.scene.things[episode.goal.object_id]
    others = _look_alikes(start)
    still = {
        "rooms": 1 if FAMILIES[episode.family].visible_at_start else len(view.scene.rooms),
        "containers": _containers(start, target),
        "reference_words": _reference_words(start),
        "slack": round(max(0.0, 1.0 - len(actions) / episode.max_steps), 3),
        "turns": sum(isinstance(action, Navigate) and action.mode.startswith("turn") for action in actions),
    }
    sighting, seen, poses = (0, 1.0), set[str](), [view.agent]
    for action in (None, *actions):
        if isinstance(action, Report):
            break
        if action is not None:
            simulator.step(action)
            poses.append(view.agent)
        states = view.world([target.id, *others]).objects
        seen |= {name for name in others if states[name].visible_px >= OBSERVABLE_PX}
        if not sighting[0] and states[target.id].visible_px:
            sighting = states[target.id].visible_px, _occlusion(view, target)
    return LevelMeasures(
        **still,
        path_m=round(sum(math.dist(a.position, b.position) for a, b in pairwise(poses)), 2),
        doors=_rooms_changed(view, poses),
        look_alikes=len(seen),
        target_px=sighting[0],
        occlusion=sighting[1],
    )


def _look_alikes(start: EpisodeStart) -> list[str]:
    """Return the ids of the other things that the target's name, without adjectives or place, could mean."""
    target = start.items.get(start.episode.goal.object_id)
    if target is None:
        return []
    return [
        item.id
        for item in referents(Phrase(without_position(target.name)), start.items.values())
        if item.id != target.id
    ]


def _containers(start: EpisodeStart, target: Thing) -> int:
    """Return the number of closed containers to open: those around the target.

    If the instruction does not name the target's container, all containers in which people would look for the target
    count.
    """
    if start.episode.provenance.template != INSIDE_TEMPLATE:
        return len(closed_containers_around(start.view, target.id))
    return len(may_hold(start.view, start.items, target, room_mentioned(phrase for phrase, _ in start.mentioned)))


def _reference_words(start: EpisodeStart) -> int:
    """Return the number of words in the longest phrase that means only the target; 0 if there is no such phrase."""
    target = start.episode.goal.object_id
    meant = [phrase for phrase, items in start.mentioned if [item.id for item in items] == [target]]
    return max((len(str(phrase).split()) - 1 for phrase in meant), default=0)


def _occlusion(view: PrivilegedView, target: Thing) -> float:
    """Return the share of the target's surface that other things hide from the camera."""
    seen = view.sees(view.agent.eye, surface_points(target), target.id, through_glass=True)
    return round(1.0 - float(np.mean(seen)), 3)


def _rooms_changed(view: PrivilegedView, poses: Sequence[Pose]) -> int:
    """Return how often the walk through these poses, in straight lines, passes from one room into another."""
    rooms: list[str] = []
    for before, after in pairwise(poses):
        length_m = math.dist(before.position, after.position)
        for share in np.linspace(0.0, 1.0, max(2, math.ceil(length_m / ROOM_STEP_M) + 1)):
            place = Vec3(*(a + float(share) * (b - a) for a, b in zip(before.position, after.position, strict=True)))
            room = view.room_at(place)
            if room is not None and rooms[-1:] != [room]:
                rooms.append(room)
    return max(len(rooms) - 1, 0)
