"""Study: the runs of one report, measured once, with the pairs and repeats among them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import get_args

import pandas as pd

from vigil.analysis.measures.labels import Role
from vigil.analysis.measures.metrics import (
    COMPARABLE_W_PP,
    RunMetrics,
    by_family,
    clustered_intervals,
    house_intervals,
    is_excluded,
    mean_with_interval,
    measure,
)
from vigil.analysis.measures.models import GROUPS
from vigil.analysis.measures.pairs import Pairing, RunComparison, compare_runs, find_pairs, shared_rows
from vigil.analysis.measures.paper import Paper, paper
from vigil.analysis.measures.rows import Run, select_rows
from vigil.protocol.profile import BASELINE
from vigil.protocol.reasoning import declared_thinking
from vigil.scoring.rates import CONDITIONAL, RATES, Interval

COMPARE_ALL_UP_TO = 6
"""If there are at most this many runs, every two are compared. If there are more, only neighbours in the order of B,
and runs with similar W, are compared."""


@dataclass(frozen=True)
class RunEntry:
    """A run with its measures, overall and by family, and its role in the study."""

    run: Run
    overall: RunMetrics
    families: dict[str, RunMetrics]
    """The measures of each family that has episodes."""
    role: Role = "main"
    """Whether the run is a model's main run, a repeat of the main run, or a run under another condition."""

    def part(self, rows: pd.DataFrame, measures: RunMetrics) -> "RunEntry":
        """Return an entry for some of the run's episodes, whose rows are `rows` and whose measures are `measures`."""
        return replace(self, run=replace(self.run, rows=rows), overall=measures, families={})

    def family_parts(self) -> Iterator[tuple[str, "RunEntry"]]:
        """Yield each family that has episodes, with the entry of its episodes."""
        names = self.run.rows["family"].to_numpy()
        for family, measures in self.families.items():
            yield family, self.part(select_rows(self.run.rows, names == family), measures)

    def mean(self, column: str) -> tuple[float, float | None, float | None] | None:
        """Return the mean of a column's known values and its interval from resampled houses; None without values."""
        return mean_with_interval(self.run.rows, column)

    @cached_property
    def by_houses(self) -> dict[str, Interval | None]:
        """Name of a rate -> its interval, which accounts for the similarity of plays in one house; None where there are
        too few houses."""
        return house_intervals(self.run.rows, (*RATES, *CONDITIONAL))

    @cached_property
    def clustered(self) -> dict[str, Interval | None]:
        """The intervals of W, B and Delta from resampled houses; None where there are too few houses."""
        return clustered_intervals(self.run.rows)

    @property
    def name(self) -> str:
        """The run's name in every table."""
        return self.run.name

    @property
    def group(self) -> str:
        """The run's group in the paper's panels."""
        return self.run.model.group

    @property
    def panel(self) -> str:
        """The panel of the run's row.

        For a main run: the panel named by the study; otherwise `excluded` if the exclusion rule applies, or else
        `main`. For other runs: the role, `repeat` or `condition`.
        """
        if self.role != "main":
            return self.role
        said = None if self.run.label is None else self.run.label.panel
        return said or ("excluded" if is_excluded(self.overall) else "main")

    @property
    def published(self) -> str | None:
        """The name of the same model in the published rows; None if there is none."""
        if self.run.label is not None:
            return self.run.label.published
        names = {model.name.casefold(): model.name for model in paper().models}
        return names.get(self.run.model.name.casefold())


@dataclass(frozen=True)
class Study:
    """The data of a report's tables and figures: runs with their measures, pairs and comparisons of runs, and published
    rows."""

    entries: tuple[RunEntry, ...]
    """The runs with their measures, sorted by name."""
    pairing: Pairing
    comparisons: tuple[RunComparison, ...]
    published: Paper | None
    """The published rows; None if the user does not want them in the report."""
    warnings: tuple[str, ...]
    """The warnings that are shown at the top of a report."""

    @property
    def runs(self) -> list[Run]:
        """The runs of the study, sorted by name."""
        return [entry.run for entry in self.entries]

    def main_runs(self) -> list[RunEntry]:
        """Return the models' main runs, best B first."""
        return sorted_by_b(entry for entry in self.entries if entry.role == "main")

    def shown_runs(self) -> list[RunEntry]:
        """Return the runs that figures show, best B first: the main runs, or all runs if there is no main run."""
        return self.main_runs() or sorted_by_b(self.entries)

    def entry(self, run: Run) -> RunEntry:
        """Return the entry that has the same name as `run`."""
        return next(entry for entry in self.entries if entry.name == run.name)

    def outside_main_panel(self) -> list[RunEntry]:
        """Return the main runs that the exclusion rule or the study keeps out of the main tables, by panel, best B
        first."""
        return sorted((entry for entry in self.main_runs() if entry.panel != "main"), key=lambda entry: entry.panel)

    def main_panel(self) -> list[RunEntry]:
        """Return the main runs that are in the main tables, best B first."""
        return [entry for entry in self.main_runs() if entry.panel == "main"]


def study(runs: Sequence[Run], *, with_paper: bool = True) -> Study:
    """Measure the runs, find their pairs and compare them; return all as a Study."""
    pairing = find_pairs(runs)
    roles = _roles(runs, pairing)
    entries = tuple(RunEntry(run, measure(run.rows), by_family(run.rows), roles[run.name]) for run in runs)
    faults = [fault for run in runs for fault in run.faults]
    return Study(
        entries=entries,
        pairing=pairing,
        comparisons=tuple(_comparisons(entries)),
        published=paper() if with_paper else None,
        warnings=(
            *faults,
            *_duplicate_runs(runs),
            *_thinking_contradictions(runs),
            *_mixed_settings(runs),
            *pairing.refusals,
        ),
    )


def sorted_by_b(entries: Iterable[RunEntry]) -> list[RunEntry]:
    """Return entries sorted by B, the best first; entries with equal B are sorted by name."""
    return sorted(entries, key=lambda entry: (-(entry.overall.share("B") or 0.0), entry.name))


def sorted_by_role(entries: Iterable[RunEntry]) -> list[RunEntry]:
    """Return the main runs, then repeats, then runs under other conditions, best B first in each."""
    order = get_args(Role)
    return sorted(sorted_by_b(entries), key=lambda entry: order.index(entry.role))


def sorted_by_group(entries: Iterable[RunEntry]) -> list[RunEntry]:
    """Return entries in the order of the panels' groups; within a group, the best B comes first."""
    order = {group: index for index, group in enumerate(GROUPS)}
    found = sorted_by_b(entries)
    order |= {group: order.get(group, len(order)) for group in sorted({entry.group for entry in found})}
    return sorted(found, key=lambda entry: order[entry.group])


def _roles(runs: Sequence[Run], pairing: Pairing) -> dict[str, Role]:
    """Return the role of each run by name. A study's label decides; without a label, the settings and repeats of the
    run decide.

    If several runs repeat each other, the earliest is the main run.
    """
    roles: dict[str, Role] = {run.name: "main" if _has_default_condition(run) else "condition" for run in runs}
    for repeats in pairing.repeats:
        first, *others = sorted(repeats.runs, key=lambda run: (run.header.started, run.name))
        if roles[first.name] == "main":
            roles |= {run.name: "repeat" for run in others}
    roles.update({run.name: run.label.role for run in runs if run.label is not None})
    return roles


def _has_default_condition(run: Run) -> bool:
    """Return whether a run has the default prompt, no feedback and an original pack."""
    profile = run.header.spec.profile
    return profile.name == BASELINE and profile.prompt_variant == "default" and run.perturbation is None


def _comparisons(entries: Sequence[RunEntry]) -> Iterable[RunComparison]:
    packs: dict[str, list[RunEntry]] = {}
    entries = [entry for entry in entries if entry.overall.has_reports]
    main = [entry for entry in entries if entry.role == "main"]
    for entry in main if len(main) > 1 else entries:
        if entry.run.n:
            packs.setdefault(entry.run.header.spec.pack_sha256, []).append(entry)
    for same_pack in packs.values():
        ranked = sorted_by_b(same_pack)
        for index, first in enumerate(ranked):
            for place, second in enumerate(ranked[index + 1 :]):
                apart_pp = 100 * abs((first.overall.share("W") or 0.0) - (second.overall.share("W") or 0.0))
                has_comparable_w = apart_pp <= COMPARABLE_W_PP + 1e-9
                is_wanted = len(ranked) <= COMPARE_ALL_UP_TO or place == 0 or has_comparable_w
                if is_wanted and len(shared_rows(first.run.rows, second.run.rows)[0]):
                    yield compare_runs(first.run, second.run)


def _duplicate_runs(runs: Sequence[Run]) -> list[str]:
    """Return sentences about runs that were given twice, because a copy would look like a perfect repeat."""
    return [
        f"{first.name} and {second.name} are copies of one run, not repeats of it. Give one of them only."
        for first, second in combinations(runs, 2)
        if first.n and first.header.sha256 == second.header.sha256 and first.rows.equals(second.rows)
    ]


def _thinking_contradictions(runs: Sequence[Run]) -> Iterator[str]:
    """Yield sentences about models whose answers contradict the serving mode in their names or settings."""
    for run in runs:
        spec, (reasoned, replies) = run.header.spec, run.header.replies_with_reasoning
        said = declared_thinking(spec.agent, spec.thinking, spec.sampling)
        if said is False and reasoned:
            yield (
                f"{run.name} should not think, by its name or settings, but {reasoned} of its {replies} replies (with "
                "those to the check before the run) came with reasoning: it counts as thinking. Its server does not "
                "pass the setting on, or serves another model."
            )
        elif said and replies and not reasoned:
            yield (
                f"{run.name} should think, by its name or settings, but none of its {replies} replies (with those "
                "to the check before the run) came with reasoning. It still counts as thinking, because some "
                "providers do not return reasoning: check whether its server has it turned off."
            )


def _original_pack(run: Run) -> str:
    """Return the name and hash of a run's pack, or of the original if the pack is a perturbed copy.

    A perturbed episode has the id of its original.
    """
    found, spec = run.perturbation, run.header.spec
    name, sha256 = (spec.pack, spec.pack_sha256) if found is None else (found.of, found.sha256)
    return f"{name} {sha256[:12]}"


def _mixed_settings(runs: Sequence[Run]) -> list[str]:
    """Return sentences about differences in settings that a reader would assume to be equal for all runs."""
    found = []
    checks = {
        "packs": _original_pack,
        "simulators": lambda run: run.header.simulator_version or run.header.spec.simulator,
        "versions of vigil": lambda run: run.header.package_version,
    }
    for what, fact in checks.items():
        kinds: dict[str, list[str]] = {}
        for run in runs:
            kinds.setdefault(fact(run), []).append(run.name)
        if len(kinds) > 1:
            shown = "; ".join(f"{kind}: {', '.join(names)}" for kind, names in sorted(kinds.items()))
            found.append(f"These runs were made with different {what} ({shown}). Do not compare their rows.")
    return found
