"""Schedule of probes: the steps of an episode at which the agent is asked what it believes."""

from dataclasses import dataclass

from vigil.errors import SettingError, did_you_mean
from vigil.protocol.episode import Episode
from vigil.records.record import EpisodeRecord
from vigil.scoring.goal_check import check

EVERY, AT_GOAL, AT_REPORT = "every", "at-goal", "at-report"
MAX_PERIOD = 1000


@dataclass(frozen=True, slots=True)
class ProbeSchedule:
    """Steps at which probes are asked. They are chosen after the episode has ended, so the episode never waits for a
    probe."""

    period: int | None = None
    """Number of steps from one probe to the next. The last step of the episode also gets a probe. None if probes are
    not regular."""
    at_goal: bool = False
    """Whether to ask at the first step whose frame shows that the goal is attained."""
    at_report: bool = False
    """Whether to ask at the last step, which has the report or is the last of the step budget."""

    def steps(self, episode: Episode, record: EpisodeRecord) -> tuple[int, ...]:
        """Return the steps of a record at which to ask, in order; empty if the record ended as an error.

        If the record is a fork, steps of the play that it continues are left out, because the agent did not take them.
        """
        last, before = len(record.steps), record.replayed_steps
        if record.end == "error" or not last:
            return ()
        found = set(range(self.period, last + 1, self.period)) if self.period else set[int]()
        if self.period or self.at_report:
            found.add(last)
        if self.at_goal:
            first = check(episode.goal, record).first_row
            found |= {first + 1} if first is not None and first < last else set()
        return tuple(step for step in sorted(found) if step > before)

    def bounds(self, max_steps: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return two sets of steps at which probes are asked in an episode of at most `max_steps` steps: in the case
        with the fewest probes, and in the case with the most costly probes."""
        least = (1,) if self.period or self.at_report else ()
        most = {*range(self.period, max_steps + 1, self.period)} if self.period else set[int]()
        extra = self.at_goal + (self.at_report or self.period is not None)
        most |= set(range(max(0, max_steps - extra) + 1, max_steps + 1))
        return least, tuple(sorted(most))

    def __str__(self) -> str:
        names = [EVERY if self.period == 1 else str(self.period)] if self.period else []
        return ",".join([*names, *([AT_GOAL] if self.at_goal else []), *([AT_REPORT] if self.at_report else [])])


def parse_schedule(text: str) -> ProbeSchedule:
    """Return the schedule in a text such as "every", "5" or "at-goal,at-report". Raises SettingError."""
    words = [word.strip() for word in text.split(",")]
    period = None
    for word in words:
        if word == EVERY or (word.isascii() and word.isdigit() and 1 <= int(word) <= MAX_PERIOD):
            period = min(period or MAX_PERIOD, 1 if word == EVERY else int(word))
        elif word not in (AT_GOAL, AT_REPORT):
            raise SettingError(
                f"Steps to probe {text!r}: {word!r} is not known.{did_you_mean(word, (EVERY, AT_GOAL, AT_REPORT))} "
                f"Give {EVERY}, a number of steps from 1 to {MAX_PERIOD}, {AT_GOAL}, {AT_REPORT}, or several with "
                "commas between."
            )
    return ProbeSchedule(period, at_goal=AT_GOAL in words, at_report=AT_REPORT in words)
