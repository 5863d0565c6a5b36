"""Synthetic records: worlds made by the simulator's own setup instead of by playing, row after row.

A negative control (`vigil.authoring.review.negative_controls`) is scored as any run is, so it has to be a record.
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
"""Stands in a record for whatever would have brought a world about."""


@dataclass(frozen=True, slots=True)
class SyntheticStep:
    """One step of a record that is put together."""

    world: WorldState
    action: Action = PLACEHOLDER_ACTION
    effect: Effect | None = None


class SyntheticWorlds:
    """Worlds of one episode as they would be after something else was done."""

    def __init__(self, simulator: PrivilegedSimulator, episode: Episode) -> None:
        self.simulator = simulator
        self.episode = episode

    def set_up(self, setup: Setup, pose: Pose | None = None) -> bool:
        """Sets the simulator up, with the agent at the start or another pose. Returns whether that can be."""
        try:
            self.simulator.reset(pose or self.episode.start, setup)
        except EpisodeError:  # a leaf would stand in the body, or a thing cannot be there
            return False
        return True

    def world(self, setup: Setup, pose: Pose | None = None) -> WorldState | None:
        """Return the world with a setup, seen from the start or another pose; None where it cannot be set up."""
        return self.simulator.world(self.episode.bound_ids()) if self.set_up(setup, pose) else None

    def row(self, setup: Setup, pose: Pose | None = None) -> list[SyntheticStep] | None:
        """Return the world with a setup as the only row; None where it cannot be set up."""
        world = self.world(setup, pose)
        return None if world is None else [SyntheticStep(world)]

    def changed(self, object_id: str, **facts: object) -> Setup:
        """Return the episode's setup with other facts about one object."""
        return changed_setup(self.episode.setup, object_id, **facts)


def changed_setup(setup: Setup, object_id: str, **facts: object) -> Setup:
    """Return a setup with other facts about one object."""
    change = setup.objects.get(object_id, ObjectSetup()).model_copy(update=facts)
    return setup.model_copy(update={"objects": {**setup.objects, object_id: change}})


def record_of(
    base: EpisodeRecord, rows: Sequence[SyntheticStep], status: Status, *, after_solution: bool = False
) -> EpisodeRecord:
    """Return the record of rows that follow upon the reset, or upon a record's actions, closed by a report."""
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
