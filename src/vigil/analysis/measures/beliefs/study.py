"""Beliefs of a run: when the agent believed that the task was done, how well its stated likelihoods fit, and why its
reports were false or missing.

Every interval resamples houses, because the beliefs of one episode depend on each other. Source: `protocol.md`
section 10.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vigil.analysis.measures.beliefs import scores
from vigil.analysis.measures.intervals import HouseResampling, clustered_interval
from vigil.records.probe import FRAMINGS, SCALE, Framing
from vigil.records.probe_file import ProbeTable, read_probes
from vigil.scoring.beliefs import PARTS, Belief, BeliefPart, EpisodeBeliefs, episode_beliefs
from vigil.scoring.rates import Interval, Rate, effective_sample_size
from vigil.scoring.saved_run import SavedRun

NEAR_STEPS = 3
"""Greatest number of steps from attainment at which AUROC is computed; far before it, doubt is easy."""
CURVE_STEPS = 10
"""Greatest number of steps from attainment that the curve of beliefs shows."""
DELAY_STEPS = 10
"""Steps to which the mean delay is restricted, because longer delays are often censored."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A statistic with its interval from resampled houses."""

    value: float
    """NaN if the statistic is not defined for these beliefs."""
    interval: Interval | None
    n: int
    """Number of beliefs, or of plays, that it is computed from."""


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """The mean stated likelihood at a number of steps from the moment at which the goal was attained."""

    since: int
    mean: Estimate


@dataclass(frozen=True, slots=True)
class Delay:
    """Steps from the goal to the first answer that it is done (Kaplan-Meier, because some end before that)."""

    plays: int
    """Plays with an answer between attaining the goal and losing it."""
    detected: int
    """Plays with an answer that the task is done."""
    at_once: Estimate
    """Share that answers so at the first frame that shows the goal."""
    median: float | None
    """Median delay in steps; None if half of the plays never answered so."""
    restricted_mean: Estimate
    """Mean delay in steps, where a delay over `DELAY_STEPS` counts as that."""
    survival: tuple[float, ...]
    """Share that does not yet believe after 0, 1, 2 ... steps."""


@dataclass(frozen=True, slots=True)
class PartShare:
    """The share of all scored plays that are of one label and one part of the partition."""

    rate: Rate
    interval: Interval
    """The wider ends of Wilson's interval and of the one from resampled houses, since neither alone is wide enough."""


@dataclass(frozen=True, eq=False)
class BeliefStudy:
    """The beliefs of a run's scored plays, under one framing of the question."""

    framing: Framing
    plays: tuple[EpisodeBeliefs, ...]
    """All scored plays, also those without probes."""
    failed: int = 0
    """Number of probes on which the server failed."""
    foreign: int = 0
    """Number of rows that do not count."""

    @cached_property
    def _rows(self) -> list[tuple[str, Belief]]:
        return [(play.outcome.house, belief) for play in self.plays for belief in play.of(self.framing)]

    @cached_property
    def _answered(self) -> list[tuple[str, Belief]]:
        return [row for row in self._rows if row[1].is_answered]

    @property
    def asked(self) -> int:
        """Number of probes with a reply."""
        return len(self._rows)

    @property
    def answered(self) -> int:
        """Number of probes with an answer."""
        return len(self._answered)

    @property
    def closing_asked(self) -> int:
        """Number of plays that were asked at their last step."""
        return sum(belief.is_closing for _, belief in self._rows)

    # --- why reports were false or missing ----------------------------------------------------------------------------

    @cached_property
    def parts(self) -> dict[BeliefPart, dict[str, PartShare]]:
        """The partition of FR and of NR: the share of all scored plays, by part and label."""
        return {part: {label: self._part_share(label, part) for label in ("FR", "NR")} for part in PARTS}

    def _part_share(self, label: str, part: BeliefPart) -> PartShare:
        hits = [play.outcome.label == label and play.part(self.framing) == part for play in self.plays]
        rate = _play_rate((play.outcome.episode_id, hit) for play, hit in zip(self.plays, hits, strict=True))
        houses = np.array([play.outcome.house for play in self.plays])
        ends = [rate.interval, (clustered_interval(np.array(hits), houses) if hits else None) or rate.interval]
        return PartShare(rate, (min(low for low, _ in ends), max(high for _, high in ends)))

    @property
    def broken_identities(self) -> list[str]:
        """Identities of the partition that do not hold; normally empty."""
        labels = Counter(play.outcome.label for play in self.plays)
        return [
            f"the parts of {label} = {label}"
            for label in ("FR", "NR")
            if sum(shares[label].rate.hits for shares in self.parts.values()) != labels[label]
        ]

    # --- belief and world over time -----------------------------------------------------------------------------------

    def curve(self) -> list[CurvePoint]:
        """Return the mean stated likelihood by steps from attainment, where there are answers."""
        found: list[CurvePoint] = []
        for since in range(-CURVE_STEPS, CURVE_STEPS + 1):
            rows = [row for row in self._answered if row[1].since_attained == since]
            if rows:
                found.append(CurvePoint(since, _mean(rows, lambda belief: (belief.sure or 0) / SCALE)))
        return found

    def false_before(self) -> Estimate:
        """Return the share of answers that the task is done, while the goal had never held."""
        return self._share(lambda one: _is_before(one), lambda one: one.done)

    def missed_after(self) -> Estimate:
        """Return the share of answers that the task is not done, while the goal held."""
        return self._share(lambda one: one.is_held, lambda one: not one.done)

    def false_after_loss(self) -> Estimate:
        """Return the share of answers that the task is done, after the goal had been attained and lost again."""
        return self._share(lambda one: not one.is_held and not _is_before(one), lambda one: one.done)

    def lost(self) -> Rate:
        """Return the share of plays that lost a right belief while the goal held, of those that could."""
        found = ((play.outcome.episode_id, play.has_lost_belief(self.framing)) for play in self.plays)
        return _play_rate((name, is_lost) for name, is_lost in found if is_lost is not None)

    def delay(self) -> Delay | None:
        """Return the delay of detection; None if no goal was attained with an answer after it."""
        found = [(play.outcome.house, play.detection(self.framing)) for play in self.plays]
        plays = [(house, *each) for house, each in found if each is not None]
        return _delay(plays) if plays else None

    def _share(self, among: Callable[[Belief], bool], hit: Callable[[Belief], bool]) -> Estimate:
        return _mean([row for row in self._answered if among(row[1])], lambda belief: float(hit(belief)))

    # --- calibration --------------------------------------------------------------------------------------------------

    def calibration(self) -> dict[str, Estimate]:
        """Return the measures of calibration by name, over all answers unless the name says otherwise."""
        near = [row for row in self._answered if abs(_since(row[1])) <= NEAR_STEPS]
        closing = [row for row in self._answered if row[1].is_closing]
        return {
            "base_rate": _statistic(self._answered, scores.base_rate),
            "overconfidence": _statistic(self._answered, scores.overconfidence),
            "brier": _statistic(self._answered, scores.brier),
            "skill": _statistic(self._answered, scores.skill),
            "reliability": _statistic(self._answered, scores.reliability),
            "resolution": _statistic(self._answered, scores.resolution),
            "uncertainty": _statistic(self._answered, scores.uncertainty),
            "debiased_error": _debiased(self._answered),
            "auroc_near": _statistic(near, scores.auroc),
            "auroc_closing": _statistic(closing, scores.auroc),
            "risk_coverage": _statistic(self._answered, scores.risk_coverage),
        }

    def reliability_points(self) -> list[tuple[float, Estimate]]:
        """Return for each stated likelihood the share of answers that were true."""
        found: list[tuple[float, Estimate]] = []
        for value in range(scores.VALUES):
            rows = [row for row in self._answered if row[1].sure == value]
            if rows:
                found.append((value / SCALE, _mean(rows, lambda belief: float(belief.is_true))))
        return found


def belief_studies(run: SavedRun) -> tuple[BeliefStudy, ...]:
    """Return the beliefs of a run, one study for each framing that was asked; empty without probes.

    Raises RecordError when the file of probes cannot be read.
    """
    table = read_probes(run.folder, run.header.sha256)
    asked = {key.framing for key in table.rows}
    framings: list[Framing] = [framing for framing in FRAMINGS if framing in asked]
    if not framings:
        return ()
    plays = tuple(_plays(run, table))
    failed = Counter(key.framing for key, row in table.rows.items() if row.error is not None)
    return tuple(BeliefStudy(framing, plays, failed[framing], table.foreign) for framing in framings)


def _plays(run: SavedRun, table: ProbeTable) -> Iterable[EpisodeBeliefs]:
    asked = {key[:2] for key in table.rows}
    for key, row in sorted(run.table.rows.items(), key=lambda each: each[0]):
        if row.outcome is None:
            continue
        if key not in asked:
            yield EpisodeBeliefs(row.outcome, ())
            continue
        record = run.table.record(key)
        yield episode_beliefs(run.table.episodes[key[0]], record, row.outcome, table.of(record))


def _is_before(belief: Belief) -> bool:
    return belief.since_attained is None or belief.since_attained < 0


def _since(belief: Belief) -> float:
    return math.inf if belief.since_attained is None else belief.since_attained


def _play_rate(plays: Iterable[tuple[str, bool]]) -> Rate:
    """Return the rate of hits over plays, given with the id of their episode."""
    by_episode: dict[str, list[bool]] = {}
    for name, is_hit in plays:
        by_episode.setdefault(name, []).append(is_hit)
    hits, sizes = [sum(each) for each in by_episode.values()], [len(each) for each in by_episode.values()]
    return Rate(sum(hits), sum(sizes), effective_sample_size(hits, sizes))


def _mean(rows: Sequence[tuple[str, Belief]], value: Callable[[Belief], float]) -> Estimate:
    if not rows:
        return Estimate(math.nan, None, 0)
    values = np.array([value(belief) for _, belief in rows])
    resampling = HouseResampling.of(_houses(rows))
    centre = float(values.mean())
    if resampling is None:
        return Estimate(centre, None, len(rows))
    sums = resampling.sums(np.stack([values, np.ones(len(values))], axis=1))
    return Estimate(centre, resampling.interval(sums[:, 0] / sums[:, 1], centre), len(rows))


def _houses(rows: Sequence[tuple[str, Belief]]) -> np.ndarray:
    return np.array([house for house, _ in rows])


def _counts(rows: Sequence[tuple[str, Belief]]) -> np.ndarray:
    sure = np.array([belief.sure for _, belief in rows], dtype=int)
    return scores.counts_of(sure, np.array([belief.is_true for _, belief in rows], dtype=float))


def _statistic(rows: Sequence[tuple[str, Belief]], measure: Callable[[np.ndarray], np.ndarray]) -> Estimate:
    """Return a measure of calibration over rows, each a house and a belief."""
    if not rows:
        return Estimate(math.nan, None, 0)
    counts, resampling = _counts(rows), HouseResampling.of(_houses(rows))
    centre = float(measure(counts.sum(axis=0)))
    if resampling is None or not math.isfinite(centre):
        return Estimate(centre, None, len(rows))
    return Estimate(centre, resampling.interval(measure(resampling.sums(counts)), centre), len(rows))


def _debiased(rows: Sequence[tuple[str, Belief]]) -> Estimate:
    """Return the debiased calibration error.

    A resample is debiased towards the rows, whose own error is not; the interval is moved by the difference.
    """
    if not rows:
        return Estimate(math.nan, None, 0)
    houses = _houses(rows)
    resampling = HouseResampling.of(houses)
    names, index = np.unique(houses, return_inverse=True)
    by_house = np.zeros((len(names), scores.VALUES, 2))
    np.add.at(by_house, index, _counts(rows))
    squares = scores.square_sums(by_house)
    centre = float(scores.debiased_calibration_error(by_house.sum(axis=0), squares.sum(axis=0)))
    if resampling is None or not math.isfinite(centre):
        return Estimate(centre, None, len(rows))
    draws = scores.debiased_calibration_error(resampling.resampled(by_house), resampling.resampled(squares))
    shift = centre - float(np.nanmean(draws))
    return Estimate(centre, resampling.interval(draws + shift, centre), len(rows))


def _delay(plays: Sequence[tuple[str, int, bool]]) -> Delay:
    """Return the delay of plays, each a house, a number of steps, and whether the belief came then."""
    longest = max(steps for _, steps, _ in plays)
    rows = np.zeros((len(plays), max(longest, DELAY_STEPS) + 1, 2))
    for at, (_, steps, is_detected) in enumerate(plays):
        rows[at, steps, 0] = is_detected
        rows[at, steps, 1] = 1.0
    resampling = HouseResampling.of(np.array([house for house, *_ in plays]))
    survival = _survival(rows.sum(axis=0))

    def estimate(statistic: Callable[[np.ndarray], np.ndarray]) -> Estimate:
        centre = float(statistic(survival))
        draws = None if resampling is None else statistic(_survival(resampling.sums(rows)))
        interval = None if resampling is None or draws is None else resampling.interval(draws, centre)
        return Estimate(centre, interval, len(plays))

    below = np.flatnonzero(survival <= 0.5)
    return Delay(
        plays=len(plays),
        detected=sum(is_detected for *_, is_detected in plays),
        at_once=estimate(lambda found: 1 - found[..., 0]),
        median=float(below[0]) if len(below) else None,
        restricted_mean=estimate(lambda found: found[..., :DELAY_STEPS].sum(axis=-1)),
        survival=tuple(survival[: longest + 1].tolist()),
    )


def _survival(counts: np.ndarray) -> np.ndarray:
    """Return Kaplan and Meier's estimate of the share that is left after each step, (..., steps).

    `counts`, (..., steps, 2), are the plays in which the belief came after that many steps, and all that ended then.
    """
    ended = counts[..., 1]
    at_risk = ended.sum(axis=-1, keepdims=True) - (np.cumsum(ended, axis=-1) - ended)
    hazard = np.divide(counts[..., 0], at_risk, out=np.zeros_like(at_risk), where=at_risk > 0)
    return np.cumprod(1 - hazard, axis=-1)
