"""Synthetic records: records of worlds that the simulator sets up directly, instead of by playing.

Negative controls (`vigil.authoring.review.validate`) need records because they are scored in the same way as
runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from vigil.protocol.actions import Action, Navigate, Reply, Report, Status
from vigil.protocol.world import Effect, ObjectSetup, Setup, WorldState
from vigil.records.record import EpisodeRecord, StepRecord

PLACEHOLDER_ACTION = Navigate(mode="forward", magnitude=1.0)
"""Default action of a synthetic step. No action led to the step's world, because the simulator set it up."""


@dataclass(frozen=True, slots=True)
class SyntheticStep:
    """One step of a synthetic record."""

    world: WorldState
    action: Action = PLACEHOLDER_ACTION
    effect: Effect | None = None


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
    last = rows[-1].world if rows else base.worlds[0]
    for row in (*rows, SyntheticStep(last, Report(status=status, summary=""))):
        reply = Reply(text="")
        steps.append(
            StepRecord(index=len(steps) + 1, reply=reply, action=row.action, effect=row.effect, world=row.world)
        )
    return base.model_copy(update={"steps": tuple(steps), "end": "report"})
