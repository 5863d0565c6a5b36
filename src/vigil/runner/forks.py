"""Forks: plays of a recorded run that another agent, model, profile or prompt continues from a step.

The replies before that step are carried out again, and their results are compared with the record. So a fork starts in
exactly the state that the original play had at that step.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from vigil.errors import RecordError, SettingError
from vigil.protocol.episode import Episode
from vigil.records.record import ForkPoint, ForkSource, RunSpec
from vigil.runner.workers.messages import Fork
from vigil.scoring.goal_check import check
from vigil.scoring.saved_run import SavedRun, read_run

At = int | Literal["goal"]
_SAME = {"simulator": "--backend", "render_quality": "--render-quality", "asset_database_sha256": "--assets"}
"""Setting that must be equal in the original run and the fork -> its option. Frames and states depend on these
settings."""


def parse_at(text: str) -> At:
    """Return the step that an option's text names: a number of steps, or `goal`. Raises SettingError."""
    word = text.strip()
    if word == "goal":
        return "goal"
    if word.isascii() and word.isdigit() and len(word) < 6:
        return int(word)
    raise SettingError(
        f"--at {text!r} is not a step. Give the number of steps to carry out again, e.g. 12; or write --at goal for "
        "all steps until the goal holds."
    )


@dataclass(frozen=True)
class ForkPlan:
    """The run whose plays are continued, and the step from which they are continued."""

    run: SavedRun
    at: At

    @classmethod
    def read(cls, folder: Path, at: At, pack: str | Path | None) -> "ForkPlan":
        """Return the plan of forks of the run in `folder`.

        Raises RecordError if the run cannot be read or was played under other rules, and PackMismatch if `pack` is not
        the pack of the run.
        """
        run = read_run(folder, pack)
        others = run.header.spec.versions.differences()
        if others:
            raise RecordError(
                f"Run {run.header.run_id!r} was played with other versions: {', '.join(others)}. Its plays cannot be "
                "continued with this version. Use the version of VIGIL that played the run."
            )
        return cls(run, at)

    @property
    def source(self) -> ForkSource:
        """The original run, as it is recorded in the header of the new run."""
        header = self.run.header
        return ForkSource(run_id=header.run_id, run_sha256=header.sha256, profile=header.spec.profile, at=self.at)

    def check(self, spec: RunSpec) -> None:
        """Raise SettingError unless the new run's settings allow the original plays to be repeated exactly."""
        theirs = self.run.header.spec
        for name, option in _SAME.items():
            there, here = getattr(theirs, name), getattr(spec, name)
            if there != here:
                raise SettingError(
                    f"Run {self.run.header.run_id!r} was played with {name} {there!r}, but the new run has {here!r}. "
                    f"Recorded steps can be repeated exactly only with an equal value: set {option} to the original "
                    "value."
                )

    def episodes(self, wanted: Sequence[Episode], named: Collection[str]) -> list[Episode]:
        """Return the episodes among `wanted` that can be continued; `named` are the ids that the user asked for.

        Raises RecordError if an episode in `named` cannot be continued, or if none of the wanted episodes can.
        """
        tried = {episode.id: self._fork_or_fault(episode) for episode in wanted}
        faults = {name: fault for name, fault in tried.items() if isinstance(fault, str)}
        refused = next((name for name in named if name in faults), None)
        found = [episode for episode in wanted if episode.id not in faults]
        if refused is not None:
            raise RecordError(f"Episode {refused!r} cannot be continued: {faults[refused]}.")
        if not found:
            name, fault = next(iter(faults.items()), ("", "no episode is chosen"))
            raise RecordError(
                f"No play of run {self.run.header.run_id!r} can be continued at {self.at}. The reason for episode "
                f"{name!r}: {fault}."
            )
        return found

    def fork(self, episode: Episode) -> Fork:
        """Return the fork of an episode: it continues the run's first play of the episode."""
        fork = self._fork_or_fault(episode)
        assert isinstance(fork, Fork)
        return fork

    def _fork_or_fault(self, episode: Episode) -> Fork | str:
        """Return the fork of an episode, or why the episode cannot be continued."""
        table, header = self.run.table, self.run.header
        row = table.rows.get((episode.id, 1))
        if row is None or row.outcome is None:
            return "the run does not have a record of it that ended without an error"
        record = table.record((episode.id, 1))
        step = check(episode.goal, record).first_row if self.at == "goal" else self.at
        if step is None:
            return "its goal was never attained"
        if step >= len(record.steps):
            return f"its play has only {len(record.steps)} steps, so it cannot be continued after step {step}"
        point = ForkPoint(
            run_id=header.run_id, run_sha256=header.sha256, epoch=record.epoch, attempt=record.attempt, step=step
        )
        return Fork(point, record.steps[:step])
