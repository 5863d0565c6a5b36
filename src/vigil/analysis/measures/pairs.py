"""Pairs: which runs may be compared. Only the runs' headers decide this.

An intervention is a pair of runs that differ in one thing: action feedback, another profile, the prompt's variant, the
serving mode of one checkpoint (thinking against instruct), or the pack and a perturbation of it. Repeats differ in
nothing. Runs that differ in more are refused, and the difference is named. Any two runs of one pack may be tested on
the episodes that both have scored, but only as two systems, never as an intervention.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, Literal

import numpy as np
import pandas as pd

from vigil.analysis.measures.intervals import PairedTest, houses_of, mcnemar, paired_difference, paired_test
from vigil.analysis.measures.metrics import RunMetrics, measure
from vigil.analysis.measures.rows import Run, select_rows
from vigil.errors import RecordError
from vigil.protocol.families import FAMILIES
from vigil.protocol.profile import ACTION_FEEDBACK, BASELINE
from vigil.scoring.rates import Interval

PairKind = Literal["feedback", "profile", "prompt", "serving", "perturbation", "repeat"]
VARIED: dict[PairKind, tuple[str, ...]] = {
    "feedback": ("profile.name",),
    "profile": ("profile.name", "prompt_policy", "prompt_policy_sha256"),
    "prompt": ("profile.prompt_variant", "prompt_policy_sha256"),
    "serving": (
        *("agent", "thinking", "sampling.reasoning_effort", "sampling.reasoning_tokens"),
        *("sampling.extra_body.chat_template_kwargs", "sampling.extra_body.enable_thinking"),
        *("sampling.extra_body.reasoning", "sampling.extra_body.thinking"),
    ),
    "perturbation": ("pack", "pack_sha256", "pack_versions", "episode_ids"),
    "repeat": (),
}
"""Kind of pair -> paths of the settings in which its two runs may differ."""
_INTERVENED = {"profile.name", "profile.prompt_variant"}
_IGNORED_SETTINGS = frozenset({"base_url", "epochs"})
"""Settings that may differ in any pair: the address does not change the model, and only shared epochs are compared."""
_SEED_IGNORED_FOR = frozenset({"model", "exec", "human", "remote"})
"""Kinds of agents on which the seed has no effect other than on scheduling."""
KEY = ["episode_id", "epoch"]


@dataclass(frozen=True)
class Pair:
    """Two runs that differ in one thing. `base` is the run with the baseline's profile or prompt, on the original pack,
    or without thinking."""

    kind: PairKind
    base: Run
    other: Run

    def tables(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Return both runs' rows of the episodes that both have scored, in the same order."""
        base, other = shared_rows(self.base.rows, self.other.rows)
        return base.reset_index(), other.reset_index()

    @cached_property
    def measures(self) -> tuple[RunMetrics, RunMetrics]:
        """The measures of the two runs, base first, over the episodes that both have scored."""
        base, other = self.tables()
        return measure(base), measure(other)

    def defines(self, name: str) -> bool:
        """Return whether both runs define `name`: W, B or a label. A run without reports defines only W."""
        return name == "W" or all(run.header.spec.profile.row.has_report for run in (self.base, self.other))

    def p(self, name: str) -> float | None:
        """Return the p-value of McNemar's exact test of W, B or a label over the shared episodes; None if there are no
        shared episodes, or if a run does not define `name`."""
        base, other = self.tables()
        if not len(base) or not self.defines(name):
            return None
        return mcnemar(_indicator(base, name), _indicator(other, name), base["episode_id"].to_numpy(dtype=str)).p


@dataclass(frozen=True)
class Repeats:
    """Two or more plays of the same episodes under the same settings: runs, or epochs of one run."""

    run: Run
    """First of the runs that have the same settings."""
    runs: tuple[Run, ...]
    """All runs that have the same settings."""
    name: str
    """Name of the condition under which the repeats were played."""
    names: tuple[str, ...]
    tables: tuple[pd.DataFrame, ...]

    def compared_with_first(self) -> Iterator[tuple[str, pd.DataFrame, pd.DataFrame]]:
        """Yield (name, rows of the first repeat, rows of the later repeat) for each later repeat."""
        for name, table in list(zip(self.names, self.tables, strict=True))[1:]:
            first, other = shared_rows(self.tables[0].assign(epoch=1), table.assign(epoch=1))
            yield name, first.reset_index(), other.reset_index()


@dataclass(frozen=True)
class Pairing:
    """All pairs and repeats found among some runs, by kind, and the reasons why other runs are not paired."""

    feedback: tuple[Pair, ...]
    profile: tuple[Pair, ...]
    prompt: tuple[Pair, ...]
    serving: tuple[Pair, ...]
    perturbation: tuple[Pair, ...]
    repeats: tuple[Repeats, ...]
    refusals: tuple[str, ...]
    choices: Mapping[PairKind, tuple[str, ...]]
    """Kind of pair -> sentences about runs with several possible bases: which base was chosen."""


@dataclass(frozen=True)
class RunComparison:
    """Two runs, compared on the episodes that both have scored."""

    first: Run
    second: Run
    n: int
    w: PairedTest
    b: PairedTest
    delta: tuple[float, Interval | None]
    """Difference of the gap W - B, second run minus first, with its interval from resampled houses."""


def make_pair(first: Run, second: Run, kind: PairKind) -> Pair:
    """Return two runs, given in any order, as a pair. Raises RecordError if they differ in settings other than those of
    `kind`."""
    found = setting_differences(first, second)
    unwanted = [
        text for place, text in found.items() if not any(f"{place}.".startswith(f"{one}.") for one in VARIED[kind])
    ]
    if unwanted:
        raise RecordError(
            f"{first.name!r} and {second.name!r} cannot be paired for {kind}, because they also differ in other "
            f"settings: {'; '.join(unwanted)}. Run one of them again with the other's settings."
        )
    if kind != "repeat" and _pair_kind(first, second) != kind:
        raise RecordError(
            f"{first.name!r} and {second.name!r} cannot be paired for {kind}: their settings for {kind} are the same. "
            "Give two runs that differ in these settings."
        )
    base, other = sorted((first, second), key=_condition)
    return Pair(kind, base, other)


def find_pairs(runs: Sequence[Run]) -> Pairing:
    """Return the pairs and repeats among `runs`, and the reasons why other runs of one agent are not paired.

    Each run with an intervention is in one pair only, even if several runs could be its base.
    """
    pairs: dict[PairKind, list[Pair]] = {kind: [] for kind in VARIED}
    refusals = []
    for first, second in combinations(sorted(runs, key=lambda run: run.name), 2):
        if _agent(first) != _agent(second):
            continue
        kind = _pair_kind(first, second)
        if kind is None:
            continue
        try:
            pairs[kind].append(make_pair(first, second, kind))
        except RecordError as error:
            refusals.append(str(error))
    interventions: dict[PairKind, tuple[tuple[Pair, ...], tuple[str, ...]]] = {
        kind: _one_base_per_run(found) for kind, found in pairs.items() if kind != "repeat"
    }
    kept = {kind: one_each for kind, (one_each, _) in interventions.items()}
    choices: dict[PairKind, tuple[str, ...]] = {kind: sentences for kind, (_, sentences) in interventions.items()}
    return Pairing(**kept, repeats=_repeats(runs, pairs["repeat"]), refusals=tuple(refusals), choices=choices)


def setting_differences(first: Run, second: Run) -> dict[str, str]:
    """Return {path in the settings: description} of the differences between two runs."""
    ours, theirs = dict(_settings(first)), dict(_settings(second))
    found = {}
    for place in sorted(ours.keys() | theirs.keys()):
        if ours.get(place) != theirs.get(place):
            found[place] = f"{place} is {_display(ours.get(place))} in one, {_display(theirs.get(place))} in the other"
    return found


def compare_runs(first: Run, second: Run) -> RunComparison:
    """Return the paired tests over the episodes that both runs have scored. Raises RecordError if there are none."""
    if first.header.spec.pack_sha256 != second.header.spec.pack_sha256:
        raise RecordError(
            f"{first.name!r} and {second.name!r} were played on different packs, so their episodes cannot be "
            "compared. Give runs of one pack."
        )
    ours, theirs = shared_rows(first.rows, second.rows)
    if not len(ours):
        raise RecordError(
            f"{first.name!r} and {second.name!r} have no scored episode in common, so they cannot be compared."
        )
    ours = ours.reset_index()
    episodes, houses = ours["episode_id"].to_numpy(dtype=str), houses_of(ours)
    w, b = (
        paired_test(_indicator(ours, name), _indicator(theirs, name), episodes=episodes, houses=houses)
        for name in ("W", "B")
    )
    return RunComparison(first, second, len(set(episodes)), w, b, difference(ours, theirs, "Delta"))


def shared_rows(first: pd.DataFrame, second: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the rows of the episodes (and epochs) that both tables have, in the same order."""
    if first[KEY].equals(second[KEY]):
        return first, second
    ours, theirs = first.set_index(KEY), second.set_index(KEY)
    keys = ours.index.intersection(theirs.index).sort_values()
    return ours.loc[keys], theirs.loc[keys]


def mean_difference(pair_of: Pair, name: str) -> tuple[float, Interval | None] | None:
    """Return the `difference` (other - base) over the episodes that both runs have scored; None if there are no such
    episodes, or if a run does not define `name`."""
    base, other = shared_rows(pair_of.base.rows, pair_of.other.rows)
    return difference(base, other, name) if len(base) and pair_of.defines(name) else None


def family_differences(pair_of: Pair, names: Iterable[str]) -> dict[str, tuple[float, Interval | None]]:
    """Return, for each family, the differences of W, B or labels with intervals, under keys such as `AI W`."""
    base, other = pair_of.tables()
    masks = {family: base["family"].to_numpy() == family for family in FAMILIES}
    return {
        f"{family} {name}": difference(select_rows(base, mask), select_rows(other, mask), name)
        for family, mask in masks.items()
        if mask.any()
        for name in names
    }


def difference(base: pd.DataFrame, other: pd.DataFrame, name: str) -> tuple[float, Interval | None]:
    """Return the difference of W, B or a label between two sets of rows of the same plays, with its interval.

    The interval comes from a paired bootstrap that resamples houses; it is None if there are too few houses.
    """
    return paired_difference(_indicator(base, name), _indicator(other, name), houses_of(base))


def _one_base_per_run(pairs: Sequence[Pair]) -> tuple[tuple[Pair, ...], tuple[str, ...]]:
    """Return one pair for each run with an intervention, and a sentence for each run that has several possible bases.

    The base is the run that shares most episodes. If several runs share equally many, the earliest of them is the base.
    """
    by_other: dict[str, list[Pair]] = {}
    for one in pairs:
        by_other.setdefault(one.other.name, []).append(one)
    found, choices = [], []
    for name, candidates in by_other.items():
        best = candidates[0]
        if len(candidates) > 1:
            best = min(candidates, key=lambda one: (-len(one.tables()[0]), one.base.header.started, one.base.name))
            others = ", ".join(repr(one.base.name) for one in candidates if one is not best)
            choices.append(f"{name!r} is paired with {best.base.name!r}; {others} would do as well.")
        found.append(best)
    return tuple(found), tuple(choices)


def _indicator(rows: pd.DataFrame, name: str) -> np.ndarray:
    """Return a boolean column: whether a row has the fact or label `name`; for `Delta`, whether it has W without B."""
    if name == "Delta":
        return np.asarray(rows["W"], dtype=bool) & ~np.asarray(rows["B"], dtype=bool)
    return np.asarray(rows[name] if name in rows else rows["label"] == name, dtype=bool)


def _repeats(runs: Iterable[Run], pairs: Iterable[Pair]) -> tuple[Repeats, ...]:
    sets: list[list[Run]] = []
    for one in pairs:
        home = next((group for group in sets if one.base in group or one.other in group), None)
        if home is None:
            sets.append([one.base, one.other])
        else:
            home.extend(run for run in (one.base, one.other) if all(run is not other for other in home))
    sets += [
        [run] for run in runs if run.header.spec.epochs > 1 and all(run is not one for group in sets for one in group)
    ]
    found = [_epoch_repeats(group) for group in sets]
    return tuple(sorted((one for one in found if len(one.tables) > 1), key=lambda one: one.run.name))


def _epoch_repeats(runs: Sequence[Run]) -> Repeats:
    epochs = [(run, epoch, rows) for run in runs for epoch, rows in run.rows.groupby("epoch")]
    is_numbered = any(run.header.spec.epochs > 1 for run in runs)
    names = tuple(f"{run.name}, epoch {epoch}" if is_numbered else run.name for run, epoch, _ in epochs)
    name = runs[0].name if len(runs) == 1 else runs[0].marked_name
    return Repeats(runs[0], tuple(runs), name, names, tuple(rows for *_, rows in epochs))


def _pair_kind(first: Run, second: Run) -> PairKind | None:
    """Return the kind of pair that two runs of one checkpoint form; None if they differ in more than one thing."""
    varied = setting_differences(first, second).keys() & _INTERVENED
    if first.perturbation != second.perturbation:
        is_one = not varied and first.model.name == second.model.name
        return "perturbation" if is_one and (_perturbs(first, second) or _perturbs(second, first)) else None
    if bool(first.model.is_thinking) != bool(second.model.is_thinking):
        return None if varied else "serving"
    if first.model.name != second.model.name:
        return None
    if varied == {"profile.name"}:
        profiles = {run.header.spec.profile.name for run in (first, second)}
        if BASELINE not in profiles:
            return None  # both differ from the baseline, in different things
        return "feedback" if ACTION_FEEDBACK in profiles else "profile"
    # A prompt file is not a variant of the paper's prompt.
    has_own_prompt = any(run.header.spec.profile.has_custom_prompt for run in (first, second))
    if varied == {"profile.prompt_variant"} and not has_own_prompt:
        return "prompt"
    return None if varied else "repeat"


def _perturbs(run: Run, original: Run) -> bool:
    return run.perturbation is not None and run.perturbation.sha256 == original.header.spec.pack_sha256


def _agent(run: Run) -> tuple[str, str]:
    return run.header.spec.agent_kind, run.model.checkpoint


def _condition(run: Run) -> tuple[bool, bool, bool, bool, str]:
    profile = run.header.spec.profile
    is_perturbed = run.perturbation is not None
    return (
        is_perturbed,
        profile.name != BASELINE,
        profile.prompt_variant != "default",
        bool(run.model.is_thinking),
        run.name,
    )


def _settings(run: Run) -> Iterator[tuple[str, Any]]:
    spec = run.header.spec
    # The name of the policy contains the variant. The variant is also a setting, so a difference would count twice.
    policy = spec.prompt_policy.replace(f"/{spec.profile.prompt_variant}/", "/")
    spec = spec.model_copy(update={"prompt_policy": policy})
    free = _IGNORED_SETTINGS | ({"seed"} if spec.agent_kind in _SEED_IGNORED_FOR else set())
    for place, value in spec.settings.items():
        if place.partition(".")[0] not in free:
            yield place, value
    yield "package_version", run.header.package_version
    yield "simulator_version", run.header.simulator_version


def _display(value: Any) -> str:
    if isinstance(value, tuple) and len(value) > 3:
        return f"a list of {len(value)}"
    if isinstance(value, str) and len(value) == 64:
        return f"{value[:12]}..."
    return "not set" if value is None else repr(value)
