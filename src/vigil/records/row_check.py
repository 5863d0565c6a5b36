"""Row checks: which rows of a record file belong to the run, and why the others are left out.

All readers of records (score, report, view, export, verify, and a resumed run) use these checks. A row that is left out
is not scored, and its episode counts as not played. Source: `protocol.md` sections 2.3 and 7.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from vigil.protocol.actions import ClosingAction, Report, Stop
from vigil.protocol.episode import Episode
from vigil.protocol.prompt import policy_sha256, rendered_sha256
from vigil.records.record import EpisodeRecord, RunHeader
from vigil.records.shards import shard_episodes

MAX_LISTED = 3
"""Maximum number of left-out rows that a message lists for each reason."""
UNREADABLE = "cannot be read"
REPEATED = "repeats an earlier row that counts"


@dataclass(frozen=True, slots=True)
class LeftOutRow:
    """A row that is left out, i.e. not scored."""

    line: int
    """Line number in the file, counted from 1."""
    reason: str
    """Reason why the row is left out, e.g. `is of another run`. All rows with the same reason have the same text."""
    detail: str
    """What exactly is wrong in this row."""
    episode_id: str = ""

    def __str__(self) -> str:
        return f"{self.reason}: {self.detail}"


class RowCheck:
    """Checks whether rows belong to a run and follow the protocol."""

    def __init__(self, header: RunHeader, episodes: Iterable[Episode]) -> None:
        """`episodes` are all episodes of the run's pack. Episodes that the run does not plan are ignored."""
        self._header = header
        self._sha256 = header.sha256
        wanted = set(header.spec.episode_ids)
        self.episodes = {episode.id: episode for episode in episodes if episode.id in wanted}
        """Episodes of the run by id. If the run is a shard, these are the episodes of all shards."""
        self.played_ids = {episode.id for episode in shard_episodes(self.episodes.values(), header.spec.shard)}
        """Ids of the episodes that this run (or shard) plays."""
        self._prompts: dict[str, str] = {}
        self._knows_prompt = policy_sha256(header.spec.profile) == header.spec.prompt_policy_sha256

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes for readers: which checks were not possible, and whether the run is only a shard."""
        run, spec = f"run {self._header.run_id!r}", self._header.spec
        unchecked = f"The prompts of {run} were not checked: this vigil has another text for {spec.prompt_policy!r}."
        partial = (
            f"This {run} is shard {spec.shard} of a run: it plays {len(self.played_ids)} of the {len(self.episodes)} "
            "episodes. `vigil merge` joins the shards."
        )
        said = {unchecked: not self._knows_prompt, partial: spec.shard is not None}
        return tuple(note for note, is_so in said.items() if is_so)

    def rejection(self, line: int, record: EpisodeRecord) -> LeftOutRow | None:
        """Return why a row is left out; None if the row belongs to the run."""
        for reason, detail in self._faults(record):
            return LeftOutRow(line, reason, detail, record.episode_id)
        return None

    def _faults(self, record: EpisodeRecord) -> Iterator[tuple[str, str]]:
        spec = self._header.spec
        if record.run_sha256 != self._sha256:
            yield "is of another run", f"{record.run_id!r}, hash {record.run_sha256[:12] or 'none'}"
        if record.versions != spec.versions:
            named = ", ".join(f"{name} {number}" for name, number in record.versions.model_dump().items())
            yield "was played under other versions than its run", named
        episode = self.episodes.get(record.episode_id)
        if episode is None:
            yield "is of an episode that this run does not have", f"{record.episode_id!r}"
            return
        if episode.id not in self.played_ids:
            yield "is of an episode of another shard", f"{record.episode_id!r}"
        if record.epoch > spec.epochs:
            yield "is of an epoch that this run does not have", f"epoch {record.epoch} of {spec.epochs}"
        source = spec.fork
        if (source and source.run_sha256) != (record.fork and record.fork.run_sha256):
            yield "continues another play than its run says", "none" if record.fork is None else record.fork.run_id
        if not self._is_prompt(record, episode):
            yield "was played with another prompt", f"prompt {record.prompt_sha256[:12] or 'of no hash'}"
        for fault in protocol_violations(episode, record):
            yield "contradicts the protocol", fault

    def _is_prompt(self, record: EpisodeRecord, episode: Episode) -> bool:
        if not self._knows_prompt or (record.end == "error" and not record.prompt_sha256):
            return True  # an episode that was lost before its reset has seen no prompt
        if episode.id not in self._prompts:
            self._prompts[episode.id] = rendered_sha256(episode.instruction, self._header.spec.profile)
        return record.prompt_sha256 == self._prompts[episode.id]


def contradictions(episode: Episode, record: EpisodeRecord) -> list[str]:
    """Return how the steps of a record contradict its ending or the budgets. Such a record cannot be scored."""
    closing = [step for step in record.steps if isinstance(step.action, ClosingAction) and not step.is_unconfirmed]
    reports, stops = ([step.index for step in closing if isinstance(step.action, kind)] for kind in (Report, Stop))
    steps, last, over = len(record.steps), episode.max_invalid + 1, _last_invalid(episode, record)
    faults = {
        f"it goes on after the report of step {reports[0] if reports else 0}": bool(reports) and reports[0] != steps,
        f"it has {steps} steps of at most {episode.max_steps}": steps > episode.max_steps,
        f"it goes on after invalid reply {last} of step {over}": over is not None and over != steps,
        "it ended by a report, but its last action is not a report": record.end == "report" and not reports,
        f"it ended as {record.end}, but its last action is a report": record.end != "report" and bool(reports),
        f"it goes on after the stop of step {stops[0] if stops else 0}": bool(stops) and stops[0] != steps,
        f"it ended as {record.end}, but a stop {'ended' if stops else 'did not end'} it": (record.end == "stop")
        != bool(stops),
        "it has a report, but its profile has no reports": not record.has_report and bool(reports),
        "it has a stop, but its profile has no stops": record.has_report and bool(stops),
    }
    return [fault for fault, is_so in faults.items() if is_so]


def protocol_violations(episode: Episode, record: EpisodeRecord) -> list[str]:
    """Return descriptions of how a record violates its episode's budgets, ending rules or list of bound objects."""
    steps, over = len(record.steps), _last_invalid(episode, record)
    invalid = sum(step.invalid is not None for step in record.steps)
    found = contradictions(episode, record)
    match record.end:
        case "report" | "stop" if over is not None:
            found.append(f"it ended by a {record.end}, although its invalid replies were used up")
        case "fail_no_report" if steps < episode.max_steps:
            found.append(f"it ended as fail_no_report after {steps} of {episode.max_steps} steps")
        case "fail_no_report" if over is not None:
            found.append("it ended as fail_no_report, although its invalid replies were used up")
        case "invalid_action_limit_exceeded" if over is None:
            found.append(f"it ended by its invalid replies, but has {invalid}; {episode.max_invalid} are allowed")
        case "error" if over is not None or steps >= episode.max_steps:
            found.append("it ended as an error after it had ended")
        case _:
            pass
    asked = [step for step in record.steps if step.is_unconfirmed]
    if len(asked) > 1 or any(not isinstance(step.action, Report) or step.index == episode.max_steps for step in asked):
        found.append("a step is marked as a report to be confirmed, but cannot be one")
    bound = episode.bound_ids()
    for index, world in enumerate(record.worlds if record.initial else ()):
        missing = [object_id for object_id in bound if object_id not in world.objects]
        if missing:
            found.append(f"object {missing[0]!r} is missing from the world after step {index}")
            break
    return found


def _last_invalid(episode: Episode, record: EpisodeRecord) -> int | None:
    """Return the step of the invalid reply that must end the episode; None if there are too few invalid replies."""
    invalid = [step.index for step in record.steps if step.invalid is not None]
    return invalid[episode.max_invalid] if len(invalid) > episode.max_invalid else None


def summarize_left_out(left_out: Sequence[LeftOutRow]) -> list[str]:
    """Return a line for each reason: how many rows are left out for this reason, and the first of these rows."""
    lines: list[str] = []
    for reason in dict.fromkeys(row.reason for row in left_out):
        rows = [row for row in left_out if row.reason == reason]
        first = "; ".join(f"line {row.line}: {row.detail}" for row in rows[:MAX_LISTED])
        more = f"; and {len(rows) - MAX_LISTED} more" if len(rows) > MAX_LISTED else ""
        how_many = "1 row is left out, which" if len(rows) == 1 else f"{len(rows)} rows are left out, each of which"
        lines.append(f"{how_many} {reason} ({first}{more}).")
    return lines
