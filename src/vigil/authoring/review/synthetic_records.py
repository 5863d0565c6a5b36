"""Synthetic records: records of worlds that the simulator sets up directly, instead of by playing.

Negative controls (`vigil.authoring.review.validate`) need records because they are scored in the same way as
runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from vigil.base.geometry import Pose
from vigil.errors import EpisodeError
from vigil.protocol.actions import Action, Navigate, Reply, Report, Status
from vigil.protocol.episode import Episode
from vigil.protocol.world import Effect, ObjectSetup, Setup, WorldState
from vigil.records.record import EpisodeRecord, StepRecord
from vigil.sim.privileged import PrivilegedSimulator

PLACEHOLDER_ACTION = Navigate(mode="forward", magnitude=1.0)
"""Default action of a synthetic step. No action led to the step's world, because the simulator set it up."""


@dataclass(frozen=True, slots=True)
class SyntheticStep:
    """One step of a synthetic record."""

    world: WorldState
    action: Action = PLACEHOLDER_ACTION
    effect: Effect | None = None


class SyntheticWorlds:
    """Makes worlds of one episode by setting them up in the simulator."""

    def __init__(self, simulator: PrivilegedSimulator, episode: Episode) -> None:
        self.simulator = simulator
        self.episode = episode

    def set_up(self, setup: Setup, pose: Pose | None = None) -> bool:
        """Reset the simulator to a setup, with the agent at `pose` (None: at the start). Return False if impossible."""
        try:
            self.simulator.reset(pose or self.episode.start, setup)
        except EpisodeError:  # a leaf would be where the body is, or a placement is invalid
            return False
        return True

    def world(self, setup: Setup, pose: Pose | None = None) -> WorldState | None:
        """Return the world in a setup, observed from `pose` (None: from the start); None if the setup is impossible."""
        return self.simulator.world(self.episode.bound_ids()) if self.set_up(setup, pose) else None

    def row(self, setup: Setup, pose: Pose | None = None) -> list[SyntheticStep] | None:
        """Return a list of one step, which has the world in a setup; None if the setup is impossible."""
        world = self.world(setup, pose)
        return None if world is None else [SyntheticStep(world)]

    def changed(self, object_id: str, **facts: object) -> Setup:
        """Return the episode's setup with changes to one object; `facts` are fields of `ObjectSetup`."""
        return changed_setup(self.episode.setup, object_id, **facts)


def changed_setup(setup: Setup, object_id: str, **facts: object) -> Setup:
    """Return a setup with changes to one object; `facts` are fields of `ObjectSetup`."""
    change = setup.objects.get(object_id, ObjectSetup()).model_copy(update=facts)
    return setup.model_copy(update={"objects": {**setup.objects, object_id: change}})


def record_of(
    base: EpisodeRecord, rows: Sequence[SyntheticStep], status: Status, *, after_solution: bool = False
) -> EpisodeRecord:
    """Return a record that consists of the start of `base`, the steps `rows` and a report. If `after_solution` is True,
    the actions of `base` without its report come before the steps."""
    steps = list(base.steps[:-1]) if after_solution else []
    closing = SyntheticStep(
        (rows[-1] if rows else SyntheticStep(base.worlds[0])).world, Report(status=status, summary="")
    )
    for row in (*rows, closing):
        steps.append(
            StepRecord(
                index=len(steps) + 1, reply=Reply(text=""), action=row.action, effect=row.effect, world=row.world
            )
        )
    now = datetime.fromtimestamp(0, UTC)
    return EpisodeRecord(
        run_id="",
        episode_id=base.episode_id,
        started=now,
        ended=now,
        initial=base.initial,
        steps=tuple(steps),
        end="report",
    )
