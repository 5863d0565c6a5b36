"""Measures of the closure-stress suite: correct closure (C) by kind of episode, pairs of twins, and how well a run
distinguishes the twins.

A table never mixes runs of this suite with runs of the eight families. Source: `protocol.md` section 8.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np
from scipy.special import ndtri

from vigil.analysis.measures.intervals import CONFIDENCE, clustered_interval, resampling_counts
from vigil.analysis.measures.models import agent_of
from vigil.errors import PackMismatch
from vigil.packs.pack import manifest_of
from vigil.packs.private import is_private, redact_ids
from vigil.records.probe_file import read_probes
from vigil.records.record import Key, RunHeader, read_header
from vigil.scoring.closure import (
    KINDS,
    PAIRED,
    SUITE,
    ClosureAnswer,
    ClosureOutcome,
    Kind,
    closure_answers,
    score_closure,
)
from vigil.scoring.rates import Interval, Rate, rate_of_plays
from vigil.scoring.saved_run import EffectiveRow, RecordTable, SavedRun, pack_folder, read_run

_SuiteRun = TypeVar("_SuiteRun", bound="SuiteRun")
MIN_PAIRS = 5
"""Smallest number of pairs for which intervals are computed, by resampling the pairs."""
CLAIMS = ("concession", "none", "success")
"""What an ending may claim about the goal, from the lowest to the highest claim."""
_SMOOTHING = 0.5
"""Number added to the counts of hits and misses, so that d' is finite at 0 and 100 % (Hautus, 1995)."""


@dataclass(frozen=True)
class SuiteRun:
    """A scored run on a pack of a suite: closure stress, or lists of chores."""

    name: str
    header: RunHeader
    outcomes: tuple[Any, ...]
    """Verdicts on the scored plays."""
    planned: int
    """Number of planned plays: episodes times epochs."""
    notes: tuple[str, ...]
    """Caveats that a reader must see before the numbers."""

    @classmethod
    def of(cls, run: SavedRun, outcomes: Iterable[Any], *caveats: str) -> Self:
        """Return a saved run with the verdicts on its plays; `caveats` are its first notes."""
        scored = tuple(outcomes)
        name = agent_of(run.header.spec, has_reasoning=run.header.has_reasoning).name
        return cls(name, run.header, scored, run.table.planned, (*caveats, *_notes(run, len(scored))))


@dataclass(frozen=True)
class ClosureRun(SuiteRun):
    """One scored run of a pack of the closure-stress suite."""

    outcomes: tuple[ClosureOutcome, ...]

    def outcomes_of(self, kind: Kind) -> list[ClosureOutcome]:
        """Return the verdicts on the episodes of one kind."""
        return [each for each in self.outcomes if each.answer.kind == kind]

    @property
    def kinds(self) -> list[Kind]:
        """The kinds that were played, in the table's order."""
        return [kind for kind in KINDS if self.outcomes_of(kind)]

    def rates(self) -> dict[str, dict[str, Any]]:
        """Return {kind, or `all`: C and related rates}, with intervals, as they are written to JSON."""
        return rates_by_kind(self.outcomes)


@dataclass(frozen=True, slots=True)
class Discrimination:
    """How well the endings of episodes distinguish the two episodes of a pair of twins."""

    pairs: int
    d_prime: float | None
    """Sensitivity d' of claims of success; 0 if both twins get the same claims, None without pairs."""
    d_prime_interval: Interval | None
    auc: float | None
    """The chance that the possible twin gets a higher claim than the impossible twin; ties count half."""
    auc_interval: Interval | None


def suite_of(folder: Path, pack: str | Path | None = None) -> str | None:
    """Return the suite of a run's pack; None if the pack has no suite or is missing. Raises RecordError."""
    try:
        return manifest_of(pack_folder(read_header(folder), pack)).suite
    except PackMismatch:
        return None


def read_closure_runs(folders: Sequence[Path], pack: str | Path | None = None) -> list[ClosureRun]:
    """Return the scored runs of the suite in `folders`, sorted by name. Raises RecordError or PackMismatch."""
    return read_in_order(
        folders, pack, lambda run: ClosureRun.of(run, score_rows(run.table, closure_answers(run.pack_folder)))
    )


def read_in_order(
    folders: Sequence[Path], pack: str | Path | None, score: Callable[[SavedRun], _SuiteRun]
) -> list[_SuiteRun]:
    """Return the runs of a suite in `folders`, scored by `score`, with unique names, sorted by name."""
    runs = [score(read_run(folder, pack)) for folder in sorted({folder.resolve() for folder in folders})]
    names = Counter(run.name for run in runs)
    named = [run if names[run.name] == 1 else replace(run, name=f"{run.name} · {run.header.run_id}") for run in runs]
    return sorted(named, key=lambda run: run.name)


def _notes(run: SavedRun, scored: int) -> tuple[str, ...]:
    """Return the caveats of a suite's run with `scored` scored plays, without the ids of private episodes."""
    notes = run.notes
    if read_probes(run.folder, run.header.sha256).rows:
        notes = (*notes, "Its probes are not shown: beliefs are analysed only for episodes of the eight families.")
    if is_private(manifest_of(run.pack_folder).meta):
        notes = tuple(redact_ids(notes, run.table.episodes))
    if scored < run.table.planned:
        return (f"INCOMPLETE: {scored} of {run.table.planned} episodes are scored.", *notes)
    return notes


ClosureScores = dict[Key, tuple[EffectiveRow, ClosureOutcome]]
"""Key of an episode -> its row and the verdict on the row."""


def score_rows(
    table: RecordTable, answers: Mapping[str, ClosureAnswer], known: ClosureScores | None = None
) -> tuple[ClosureOutcome, ...]:
    """Return the verdicts on a run's scored rows, sorted by key; `known` is a cache that is read and updated."""
    known = {} if known is None else known
    scored = {key: row for key, row in sorted(table.rows.items(), key=lambda each: each[0]) if row.outcome is not None}
    for key, row in scored.items():
        if key not in known or known[key][0] is not row:
            known[key] = (row, score_closure(answers[key[0]], table.episodes[key[0]], table.record(key)))
    return tuple(known[key][1] for key in scored)


def closure_rates(pack: Path, table: RecordTable, known: ClosureScores) -> dict[str, dict[str, Any]] | None:
    """Return C and related rates by kind; None if the pack is not of the suite. `known` is a cache of verdicts."""
    if manifest_of(pack).suite != SUITE:
        return None
    return rates_by_kind(score_rows(table, closure_answers(pack), known))


def rates_by_kind(outcomes: Sequence[ClosureOutcome]) -> dict[str, dict[str, Any]]:
    """Return {kind: values and intervals of the rates}, as in JSON. The last entry, `all`, is over all kinds."""
    parts = {kind: [each for each in outcomes if each.answer.kind == kind] for kind in KINDS}
    return {kind: _rates(part) for kind, part in {**parts, "all": outcomes}.items() if part or kind == "all"}


def _rates(part: Sequence[ClosureOutcome]) -> dict[str, Any]:
    found = {
        "C": rate(part, lambda each: each.C),
        "correct_pairs": correct_pairs(part),
        "W": rate(part, lambda each: each.outcome.W),
        "false_success": rate(part, lambda each: each.is_false_success),
        "no_report": rate(part, lambda each: not each.outcome.is_reported),
    }
    intervals = {name: each.interval for name, each in found.items()}
    intervals["C"] = house_interval(part, lambda each: each.C) or found["C"].interval
    values = {name: each.value for name, each in found.items()}
    return {
        "episodes": len(part),
        **values,
        "intervals": {name: list(each) for name, each in intervals.items() if each},
    }


def rate(outcomes: Iterable[ClosureOutcome], is_hit: Callable[[ClosureOutcome], bool]) -> Rate:
    """Return the share of verdicts for which `is_hit` is true. Plays of one episode are treated as correlated."""
    return rate_of_plays((each.answer.episode_id, is_hit(each)) for each in outcomes)


def house_interval(outcomes: Sequence[ClosureOutcome], value: Callable[[ClosureOutcome], float]) -> Interval | None:
    """Return the interval of the mean of `value` over verdicts, from resampled houses; None with too few houses."""
    if not outcomes:
        return None
    values = np.array([float(value(each)) for each in outcomes])
    return clustered_interval(values, np.array([each.house for each in outcomes]))


def correct_pairs(outcomes: Iterable[ClosureOutcome]) -> Rate:
    """Return the share of plays of pairs in which both episodes were closed knowingly (`is_knowing`)."""
    return rate_of_plays(
        (pair, left.is_knowing and right.is_knowing)
        for pair, plays in _pairs(outcomes).items()
        for left, right in plays
    )


def discrimination(outcomes: Iterable[ClosureOutcome]) -> Discrimination:
    """Return d' and AUC of the claims about twins, with intervals from resampled pairs."""
    pairs = list(_pairs(outcomes).values())
    if not pairs:
        return Discrimination(0, None, None, None, None)
    counts = np.array([_claims(plays) for plays in pairs])
    total = counts.sum(axis=0)[None]
    d_interval = auc_interval = None
    if len(pairs) >= MIN_PAIRS:
        drawn = np.tensordot(resampling_counts(len(pairs)), counts, axes=1)
        d_interval, auc_interval = _percentile_interval(_d_prime(drawn)), _percentile_interval(_auc(drawn))
    return Discrimination(len(pairs), float(_d_prime(total)[0]), d_interval, float(_auc(total)[0]), auc_interval)


def _percentile_interval(values: np.ndarray) -> Interval:
    low, high = np.quantile(values, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return float(low), float(high)


def _pairs(outcomes: Iterable[ClosureOutcome]) -> dict[str, list[tuple[ClosureOutcome, ClosureOutcome]]]:
    """Return {pair of twins: its plays}, one play for each epoch. In each play, the twin that obeys the families' rules
    comes first."""
    found: dict[tuple[str, int], dict[str, ClosureOutcome]] = {}
    for each in outcomes:
        if each.answer.pair is not None and each.answer.side is not None:
            found.setdefault((each.answer.pair, each.outcome.epoch), {})[each.answer.side] = each
    pairs: dict[str, list[tuple[ClosureOutcome, ClosureOutcome]]] = {}
    for (pair, _), sides in sorted(found.items()):
        if len(sides) == 2:
            first, second = PAIRED[next(iter(sides.values())).answer.kind]
            pairs.setdefault(pair, []).append((sides[first], sides[second]))
    return pairs


def _claims(plays: Sequence[tuple[ClosureOutcome, ClosureOutcome]]) -> list[list[int]]:
    """Return how often each twin got each claim, (2 twins, 3 claims)."""
    return [[sum(play[side].claim == claim for play in plays) for claim in CLAIMS] for side in (0, 1)]


def _d_prime(counts: np.ndarray) -> np.ndarray:
    """Return d' from the counts of claims, (n, 2 twins, 3 claims)."""
    rates = (counts[:, :, 2] + _SMOOTHING) / (counts.sum(axis=2) + 2 * _SMOOTHING)
    return ndtri(rates[:, 0]) - ndtri(rates[:, 1])


def _auc(counts: np.ndarray) -> np.ndarray:
    """Return the probability that the first twin's claim is the higher one, from the counts of claims (n, 2, 3)."""
    first, second = counts[:, 0].astype(float), counts[:, 1].astype(float)
    below = np.cumsum(second, axis=1) - second
    return (first * (below + second / 2)).sum(axis=1) / (first.sum(axis=1) * second.sum(axis=1))
