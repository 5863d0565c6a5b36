"""Builders of episodes and records for tests of the pure parts, without a simulator or a clock."""

from datetime import UTC, datetime
from typing import Any

from pydantic import TypeAdapter

from vigil.base.geometry import Box, Pose, Vec3
from vigil.base.versions import Versions
from vigil.protocol.actions import Action, InteractPixel, InvalidAction, Navigate, Reply, Report
from vigil.protocol.episode import Episode, HouseRef, Provenance
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.goals import (
    Goal,
)
from vigil.protocol.world import Effect, ObjectState, WorldState
from vigil.records.record import End, EpisodeRecord, ErrorFact, StepRecord

NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)
HERE = Pose(position=Vec3(0.0, 0.0, 0.0), rotation=0.0, horizon=30.0)
WALK = Navigate(mode="forward", magnitude=1)
SUCCESS = Report(status="success", summary="")
UNPARSABLE = InvalidAction(kind="protocol_failure", reason="no_object")
MALFORMED = InvalidAction(kind="malformed_action", reason="unknown_skill")


def thing(**facts: Any) -> ObjectState:
    """Return an ordinary object 3 m ahead, in plain view."""
    place = facts.pop("position", Vec3(0.0, 1.0, 3.0))
    plain: dict[str, Any] = {
        "category": "Thing",
        "position": place,
        "box": Box(center=place, size=Vec3(0.4, 0.4, 0.4)),
        "visible": True,
        "visible_px": 500,
        "open_px": 300,
        "toggle_px": 300,
        "nearest_visible_m": 2.9,
        "box_distance_m": 2.8,
        "center_distance_m": 3.2,
    }
    return ObjectState(**{**plain, **facts})


class RecordBuilder:
    """Builder of a record, step by step; every step states how it changes the world."""

    def __init__(self, **objects: ObjectState) -> None:
        self.initial = WorldState(agent=HERE, objects=objects)
        self.steps: list[StepRecord] = []

    def do(self, action: Action = WALK, effect: Effect | None = None, **changes: dict[str, Any]) -> "RecordBuilder":
        """Add one valid action and its effect."""
        self._add(action=action, effect=effect or Effect(), world=self._changed(changes))
        return self

    def ground(self, hit: str | None, category: str = "Thing", near: tuple[str, ...] = ()) -> "RecordBuilder":
        """Add one `ground` click."""
        effect = Effect(hit=hit, hit_category=category if hit else None, near=near)
        return self.do(InteractPixel(intent="ground", x=1, y=1), effect)

    def invalid(self, reason: InvalidAction = UNPARSABLE, **reply: Any) -> "RecordBuilder":
        """Add one reply that is not an action."""
        self._add(invalid=reason, world=self._changed({}), reply=Reply(text="junk", **reply))
        return self

    def report(self, status: str = "success", raw: str | None = None) -> EpisodeRecord:
        """Close the episode and return its record."""
        report = Report.model_validate({"status": status, "summary": "", "raw_status": raw})
        self._add(action=report, world=self._changed({}))
        return self.end("report")

    def end(self, end: End = "fail_no_report") -> EpisodeRecord:
        """Return the record without a report."""
        return EpisodeRecord(
            versions=Versions.current(),
            run_id="run",
            episode_id="e",
            started=NOON,
            ended=NOON,
            initial=self.initial,
            steps=tuple(self.steps),
            end=end,
            error=ErrorFact(boundary="simulator", message="gone") if end == "error" else None,
        )

    def _changed(self, changes: dict[str, dict[str, Any]]) -> WorldState:
        world = self.steps[-1].world if self.steps else self.initial
        objects = {name: state.model_copy(update=changes.get(name, {})) for name, state in world.objects.items()}
        return world.model_copy(update={"objects": objects})

    def _add(self, **facts: Any) -> None:
        facts.setdefault("reply", Reply(text="{}"))
        self.steps.append(StepRecord(index=len(self.steps) + 1, **facts))


GOALS: dict[Family, Goal] = {
    family: TypeAdapter(Goal).validate_python(dict(spec.sample_goal)) for family, spec in FAMILIES.items()
}


def episode(family: Family = "AI", **facts: Any) -> Episode:
    """Return an episode of a family with its simplest goal and its own budgets."""
    spec = FAMILIES[family]
    plain: dict[str, Any] = {
        "id": "e",
        "family": family,
        "house": HouseRef(name="house", sha256="0" * 64),
        "start": HERE,
        "instruction": "Do it.",
        "goal": GOALS[family],
        "bindings": {"target": "target"},
        "max_steps": spec.max_steps,
        "max_invalid": spec.max_invalid,
        "provenance": Provenance(author="test"),
    }
    return Episode(**{**plain, **facts})
