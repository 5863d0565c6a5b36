"""Worlds and records from which an episode's negative controls (outcomes that only look like success) are made."""

from collections.abc import Callable, Iterator

import numpy as np

from vigil.assets.catalog import CATALOG
from vigil.authoring.language.referring import LOOK_ALIKES
from vigil.authoring.review.synthetic_records import SyntheticStep, record_of
from vigil.authoring.solving.primitive_actions import click
from vigil.authoring.solving.privileged_view import PrivilegedView
from vigil.base.geometry import Pose, floor_distance, yaw_towards
from vigil.errors import EpisodeError
from vigil.protocol.actions import InteractPixel, Status
from vigil.protocol.episode import Episode
from vigil.protocol.world import Setup, WorldState
from vigil.records.record import EpisodeRecord
from vigil.scene.things import Thing
from vigil.sim.privileged import PrivilegedSimulator

TRIED_POSES = 6
"""Approximate number of poses that are tried for each world."""


class ControlWorlds:
    """One episode with the record of its solution, and methods that make worlds and records of wrong outcomes.

    The constructor resets the simulator to the episode's setup. Most methods change the simulator's state.
    """

    def __init__(
        self, simulator: PrivilegedSimulator, view: PrivilegedView, episode: Episode, record: EpisodeRecord
    ) -> None:
        self._simulator = simulator
        self.view, self.episode, self.record = view, episode, record
        self.set_up(episode.setup)
        self.target = view.scene.things[episode.goal.object_id]
        self.look_alike = self._look_alike()
        """The nearest other thing that people may mistake for the target; None if there is none."""

    def set_up(self, setup: Setup, pose: Pose | None = None) -> bool:
        """Reset the simulator to a setup, with the agent at `pose` (None: at the start). Return False if impossible."""
        try:
            self._simulator.reset(pose or self.episode.start, setup)
        except EpisodeError:  # a leaf would be where the body is, or a placement is invalid
            return False
        return True

    def world(self, setup: Setup, pose: Pose | None = None) -> WorldState | None:
        """Return the world in a setup, observed from `pose` (None: from the start); None if the setup is impossible."""
        return self._simulator.world(self.episode.bound_ids()) if self.set_up(setup, pose) else None

    def row(self, setup: Setup, pose: Pose | None = None) -> list[SyntheticStep] | None:
        """Return a list of one step, which has the world in a setup; None if the setup is impossible."""
        world = self.world(setup, pose)
        return None if world is None else [SyntheticStep(world)]

    def from_reset(self, rows: list[SyntheticStep] | None, status: Status = "success") -> EpisodeRecord | None:
        """Return a record: the reset, the steps `rows`, and a report; None if `rows` is None."""
        return None if rows is None else record_of(self.record, rows, status)

    def after_solution(self, rows: list[SyntheticStep] | None) -> EpisodeRecord | None:
        """Return a record: the solution, the steps `rows`, and a report of success; None if `rows` is None."""
        return None if rows is None else record_of(self.record, rows, "success", after_solution=True)

    def undone(self, setup: Setup, pose: Pose | None = None) -> EpisodeRecord | None:
        """Return a record in which the world changes to a setup after the solution; None if the setup is impossible.

        The agent is at `pose`; if this is None, where the solution ended.
        """
        return self.after_solution(self.row(setup, pose or self.record.worlds[-1].agent))

    def nearest(self, is_wanted: Callable[[Thing], bool]) -> Thing | None:
        """Return the thing nearest to the target for which `is_wanted` is true; None if there is none."""
        others = [
            thing
            for thing in self.view.scene.things.values()
            if thing.is_present and thing.id != self.target.id and is_wanted(thing)
        ]
        return min(others, key=lambda thing: floor_distance(thing.position, self.target.position), default=None)

    def poses(self, cells: np.ndarray, thing: Thing) -> Iterator[Pose]:
        """Yield poses that face a thing, at a few places spread over `cells` (n, 2) in x, z."""
        for x, z in cells[:: max(1, len(cells) // TRIED_POSES)]:
            place = self.episode.start.position._replace(x=float(x), z=float(z))
            yaw = yaw_towards(place, thing.position)
            yield self.episode.start.model_copy(update={"position": place, "rotation": yaw})

    def click_on(self, things: list[Thing]) -> list[SyntheticStep] | None:
        """Return a step that clicks on one of these things: the first for which the target is not near the click.

        None if there is no such thing.
        """
        self.set_up(self.episode.setup)
        for thing in things:
            pixel = self.view.click_pixel(thing.id) if thing.is_present else None
            if pixel is not None:
                ground: InteractPixel = click("ground", pixel)
                effect = self._simulator.step(ground)
                if self.target.id not in effect.near:
                    return [SyntheticStep(self._simulator.world(self.episode.bound_ids()), ground, effect)]
        return None

    def _look_alike(self) -> Thing | None:
        """Return the nearest other thing of the target's category, or else the nearest thing with an easily confused
        name.

        None if there is no such thing.
        """
        name = CATALOG[self.target.category].display_name
        groups = [group for group in LOOK_ALIKES if name in group]
        return self.nearest(lambda thing: thing.category == self.target.category) or self.nearest(
            lambda thing: any(CATALOG[thing.category].display_name in group for group in groups)
        )
