"""Progress of a study: how much of each run was played, which parts are not yet joined, and what the rest may cost."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from vigil.protocol.episode import Episode
from vigil.records.record import HEADER_FILE
from vigil.runner.dry_run import CostEstimate, estimate
from vigil.runner.merge import merge_runs
from vigil.runner.plan import RunPlan
from vigil.studies.planned_runs import PlannedRun


@dataclass(frozen=True, slots=True)
class RunState:
    """How much of a run was played: numbers of scored and planned plays, errors, and parts that are not joined."""

    scored: int
    errors: int
    planned: int
    parts: int = 0
    """Number of parts that other machines played and that are not yet joined."""

    @property
    def description(self) -> str:
        """The state of the run in one or two words."""
        if self.parts:
            return f"{self.parts} parts, not joined"
        if not self.scored and not self.errors:
            return "not begun"
        return "complete" if self.scored >= self.planned else "begun"


@dataclass(frozen=True, slots=True)
class RunEstimate:
    """Lower and upper bounds on the calls, tokens, cost and time that a run still needs."""

    cost: CostEstimate
    money: tuple[float, float] | None
    """Minimum and maximum cost; None if no prices are known."""
    hours: tuple[float, float] | None
    """Minimum and maximum time (hours) that the calls take; None if the agent calls no model."""


def state_of(run: PlannedRun, plan: RunPlan) -> RunState:
    """Return how much of a run was played. Raises RecordError or PackMismatch if its folder cannot be read."""
    planned = len(plan.spec.episode_ids) * plan.spec.epochs
    saved = run.saved()
    if saved is None:
        return RunState(0, 0, planned, len(parts_of(run)))
    rows = saved.table.rows.values()
    scored = sum(row.outcome is not None for row in rows)
    return RunState(scored, len(rows) - scored, planned)


def parts_of(run: PlannedRun) -> list[str]:
    """Return the names of the parts of a run that were played but not yet joined."""
    if (run.folder / HEADER_FILE).exists() or not run.parts.is_dir():
        return []
    return sorted(path.name for path in run.parts.iterdir() if (path / HEADER_FILE).exists())


def join_parts(run: PlannedRun) -> bool:
    """Join the parts of a run that are not yet joined. Return whether there were any. Raises RecordError."""
    names = parts_of(run)
    if names:
        merge_runs(run.folder, [run.parts / name for name in names])
    return bool(names)


def estimate_rest(run: PlannedRun, plan: RunPlan, call_seconds: float) -> RunEstimate:
    """Return bounds on the calls, tokens, cost and hours of the episodes that remain to be played."""
    rest = replace(plan, episodes=tuple(_unplayed(run, plan)))
    found = estimate(rest)
    prices = plan.execution.prices
    if plan.endpoint is None:
        return RunEstimate(found, None, None)
    low, high = (calls * call_seconds / plan.endpoint.max_connections / 3600 for calls in found.calls)
    return RunEstimate(found, None if prices is None else found.cost(prices), (low, high))


def _unplayed(run: PlannedRun, plan: RunPlan) -> Iterator[Episode]:
    """Yield the episodes of which at least one epoch has not been scored."""
    saved = run.saved()
    done: dict[str, int] = {}
    for (episode_id, _), row in ({} if saved is None else saved.table.rows).items():
        done[episode_id] = done.get(episode_id, 0) + (row.outcome is not None)
    return (episode for episode in plan.episodes if done.get(episode.id, 0) < plan.spec.epochs)
