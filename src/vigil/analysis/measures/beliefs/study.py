"""Beliefs of a run: when the agent believed that the task was done, how well it was calibrated, and why its reports
were false or missing.

Every interval resamples houses, because the beliefs of one episode depend on each other. Source: `protocol.md` section
10.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vigil.analysis.measures.beliefs import scores
from vigil.analysis.measures.beliefs.scores import calibration_error, recalibrated
from vigil.analysis.measures.intervals import HouseResampling, clustered_interval
from vigil.records.probe import FRAMINGS, SCALE, Framing
from vigil.records.probe_file import ProbeTable
from vigil.scoring.beliefs import PARTS, Belief, BeliefPart, EpisodeBeliefs, episode_beliefs
from vigil.scoring.rates import Interval, Rate, rate_of_plays
from vigil.scoring.saved_run import SavedRun

NEAR_STEPS = 3
"""Largest number of steps between an answer and attainment of the goal at which `auroc_near` uses the answer. Long
before attainment, it is easy to know that the task is not done."""
CURVE_STEPS = 10
"""Number of steps before and after attainment that the curve of beliefs shows."""
DELAY_STEPS = 10
"""Largest delay (steps) in the mean of delays: longer delays count as this long, because they are often unknown (the
play ended first)."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A statistic with its interval, which comes from resampling houses."""

    value: float
    """Value of the statistic; NaN if it is not defined for these beliefs."""
    interval: Interval | None
    n: int
    """Number of beliefs, or of plays, from which the value is computed."""


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """The mean stated likelihood at one number of steps before or after the goal was attained."""

    since: int
    mean: Estimate


@dataclass(frozen=True, slots=True)
class Delay:
    """Steps from attaining the goal to the first answer that the task is done.

    It is estimated by Kaplan and Meier's method, because some plays end before such an answer.
    """

    plays: int
    """Number of plays with an answer while the goal held."""
    detected: int
    """Number of these plays with an answer that the task is done."""
    at_once: Estimate
    """Share of plays in which, at the first frame that shows the goal, the agent says that the task is done."""
    median: float | None
    """Median delay in steps; None if, by the estimate, fewer than half of the plays ever say that the task is done."""
    restricted_mean: Estimate
    """Mean delay in steps, where each delay above `DELAY_STEPS` counts as `DELAY_STEPS`."""


@dataclass(frozen=True, slots=True)
class PartShare:
    """The share of scored plays that have a certain label (FR or NR) and a certain reason for it (`BeliefPart`)."""

    rate: Rate
    interval: Interval | None
    """Interval that contains both Wilson's interval and the interval from resampled houses, because either can be too
    narrow. None without plays."""


@dataclass(frozen=True, eq=False)
class BeliefStudy:
    """The beliefs in a run's scored plays, under one framing of the question."""

    framing: Framing
    plays: tuple[EpisodeBeliefs, ...]
    """All scored plays, including those without probes."""
    failed: int = 0
    """Number of probes on which the server failed."""

    @cached_property
    def _rows(self) -> list[tuple[str, Belief]]:
        return [(play.outcome.house, belief) for play in self.plays for belief in play.of(self.framing)]

    @cached_property
    def _answered(self) -> list[tuple[str, Belief]]:
        return [row for row in self._rows if row[1].is_answered]

    @property
    def asked(self) -> int:
        """Number of probes to which the server replied."""
        return len(self._rows)

    @property
    def answered(self) -> int:
        """Number of probes whose reply is an answer."""
        return len(self._answered)

    # --- why reports were false or missing ----------------------------------------------------------------------------

    @cached_property
    def parts(self) -> dict[BeliefPart, dict[str, PartShare]]:
        """Reason (`BeliefPart`) -> label (FR or NR) -> share of all scored plays."""
        return {part: {label: self._part_share(label, part) for label in ("FR", "NR")} for part in PARTS}

    def _part_share(self, label: str, part: BeliefPart) -> PartShare:
        hits = [play.outcome.label == label and play.part(self.framing) == part for play in self.plays]
        rate = rate_of_plays((play.outcome.episode_id, hit) for play, hit in zip(self.plays, hits, strict=True))
        houses = np.array([play.outcome.house for play in self.plays])
        ends = [each for each in (rate.interval, clustered_interval(np.array(hits), houses) if hits else None) if each]
        return PartShare(rate, (min(low for low, _ in ends), max(high for _, high in ends)) if ends else None)

    @property
    def broken_identities(self) -> list[str]:
        """Sums that do not hold, as text: the parts of FR must add up to FR, and those of NR to NR. Normally empty."""
        labels = Counter(play.outcome.label for play in self.plays)
        return [
            f"the parts of {label} = {label}"
            for label in ("FR", "NR")
            if sum(shares[label].rate.hits for shares in self.parts.values()) != labels[label]
        ]

    # --- belief and world over time -----------------------------------------------------------------------------------

    def curve(self) -> list[CurvePoint]:
        """Return the mean stated likelihood for each number of steps from attainment at which there are answers."""
        steps = range(-CURVE_STEPS, CURVE_STEPS + 1)
        parts = {since: [row for row in self._answered if row[1].since_attained == since] for since in steps}
        sure = {since: _mean(rows, lambda belief: (belief.sure or 0) / SCALE) for since, rows in parts.items() if rows}
        return [CurvePoint(since, mean) for since, mean in sure.items()]

    def false_before(self) -> Estimate:
        """Return the share that say that the task is done, among the answers before the goal first held."""
        return self._share(lambda one: _is_before(one), lambda one: one.done)

    def missed_after(self) -> Estimate:
        """Return the share that say that the task is not done, among the answers while the goal held."""
        return self._share(lambda one: one.is_held, lambda one: not one.done)

    def false_after_loss(self) -> Estimate:
        """Return the share that say that the task is done, among the answers after the goal was lost again."""
        return self._share(lambda one: not one.is_held and not _is_before(one), lambda one: one.done)

    def lost(self) -> Rate:
        """Return the share of plays in which the agent first said that the task is done, and later, while the goal
        held, that it is not.

        Only plays in which this could happen count (`has_lost_belief`).
        """
        found = ((play.outcome.episode_id, play.has_lost_belief(self.framing)) for play in self.plays)
        return rate_of_plays((name, is_lost) for name, is_lost in found if is_lost is not None)

    def delay(self) -> Delay | None:
        """Return the delay of detection; None if no play has an answer after attaining the goal."""
        found = [(play.outcome.house, play.detection(self.framing)) for play in self.plays]
        plays = [(house, *each) for house, each in found if each is not None]
        return _delay(plays) if plays else None

    def _share(self, among: Callable[[Belief], bool], hit: Callable[[Belief], bool]) -> Estimate:
        return _mean([row for row in self._answered if among(row[1])], lambda belief: float(hit(belief)))

    # --- calibration --------------------------------------------------------------------------------------------------

    def calibration(self) -> dict[str, Estimate]:
        """Return {name: measure of calibration} over all answers. Only `auroc_near` is limited to answers near
        attainment, and `auroc_closing` to answers at the last step."""
        near = [row for row in self._answered if abs(_since(row[1])) <= NEAR_STEPS]
        closing = [row for row in self._answered if row[1].is_closing]
        return {
            "base_rate": _statistic(self._answered, scores.base_rate),
            "overconfidence": _statistic(self._answered, scores.overconfidence),
            "brier": _statistic(self._answered, scores.brier),
            "skill": _statistic(self._answered, scores.skill),
            "reliability": _statistic(self._answered, scores.reliability_term),
            "resolution": _statistic(self._answered, scores.resolution),
            "uncertainty": _statistic(self._answered, scores.uncertainty),
            "debiased_error": _debiased(self._answered),
            "auroc_near": _statistic(near, scores.auroc),
            "auroc_closing": _statistic(closing, scores.auroc),
            "risk_coverage": _statistic(self._answered, scores.risk_coverage),
        }

    def recalibration(self) -> dict[str, Estimate]:
        """Return {name: measure} before and after recalibration with maps fitted on other houses; empty with fewer than
        two houses."""
        counts, houses = _counts(self._answered), _houses(self._answered)
        after = recalibrated(counts, houses) if self.answered else None
        if after is None:
            return {}
        before, true = counts[..., scores.STATED] @ scores.P, counts[..., scores.TRUE].sum(axis=1)
        errors = np.stack([(before - true) ** 2, (after - true) ** 2, true, np.ones(len(true))], axis=1)
        return {
            "brier_before": _of_sums(errors, houses, lambda sums: sums[..., 0] / sums[..., 3]),
            "brier_after": _of_sums(errors, houses, lambda sums: sums[..., 1] / sums[..., 3]),
            "gain": _of_sums(errors, houses, lambda sums: (sums[..., 0] - sums[..., 1]) / sums[..., 3]),
            "skill_after": _of_sums(errors, houses, _skill),
            "error_before": Estimate(calibration_error(before, counts), None, len(true)),
            "error_after": Estimate(calibration_error(after, counts), None, len(true)),
        }

    def reliability_points(self) -> list[tuple[float, Estimate]]:
        """For each likelihood that was stated, return it and the share of the beliefs with this likelihood that were
        true."""
        parts = {value: [row for row in self._answered if row[1].sure == value] for value in range(scores.VALUES)}
        return [
            (value / SCALE, _mean(rows, lambda belief: float(belief.is_true))) for value, rows in parts.items() if rows
        ]


def belief_studies(run: SavedRun, table: ProbeTable) -> tuple[BeliefStudy, ...]:
    """Return the studies of a run's beliefs, one for each framing that was asked; empty without probes."""
    asked = {key.framing for key in table.rows}
    framings: list[Framing] = [framing for framing in FRAMINGS if framing in asked]
    if not framings:
        return ()
    plays = tuple(_plays(run, table))
    failed = Counter(key.framing for key, row in table.rows.items() if row.error is not None)
    return tuple(BeliefStudy(framing, plays, failed[framing]) for framing in framings)


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


def _estimate(centre: float, houses: np.ndarray, draws: Callable[[HouseResampling], np.ndarray]) -> Estimate:
    """Return a statistic with its interval. `centre` is its value for the rows, whose houses are `houses`; `draws`
    returns its value in each resample."""
    resampling = HouseResampling.of(houses) if math.isfinite(centre) else None
    interval = None if resampling is None else resampling.interval(draws(resampling), centre)
    return Estimate(centre, interval, len(houses))


def _mean(rows: Sequence[tuple[str, Belief]], value: Callable[[Belief], float]) -> Estimate:
    if not rows:
        return Estimate(math.nan, None, 0)
    values = np.array([value(belief) for _, belief in rows])
    pairs = np.stack([values, np.ones(len(values))], axis=1)

    def draws(resampling: HouseResampling) -> np.ndarray:
        sums = resampling.sums(pairs)
        return sums[:, 0] / sums[:, 1]

    return _estimate(float(values.mean()), _houses(rows), draws)


def _houses(rows: Sequence[tuple[str, Belief]]) -> np.ndarray:
    return np.array([house for house, _ in rows])


def _counts(rows: Sequence[tuple[str, Belief]]) -> np.ndarray:
    sure = np.array([belief.sure for _, belief in rows], dtype=int)
    return scores.counts_of(sure, np.array([belief.is_true for _, belief in rows], dtype=float))


def _statistic(rows: Sequence[tuple[str, Belief]], measure: Callable[[np.ndarray], np.ndarray]) -> Estimate:
    """Return a measure of calibration over rows, each of which is (house, belief)."""
    return _of_sums(_counts(rows), _houses(rows), measure) if rows else Estimate(math.nan, None, 0)


def _of_sums(rows: np.ndarray, houses: np.ndarray, measure: Callable[[np.ndarray], np.ndarray]) -> Estimate:
    """Return a measure of the sum of `rows`, (n, ...), with its interval from resampled houses."""
    return _estimate(float(measure(rows.sum(axis=0))), houses, lambda resampling: measure(resampling.sums(rows)))


def _skill(sums: np.ndarray) -> np.ndarray:
    """Return the Brier skill after recalibration.

    `sums`, (..., 4), has the squared errors before and after recalibration, and the numbers of true beliefs and
    of all beliefs.
    """
    rate = sums[..., 2] / sums[..., 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        return 1 - sums[..., 1] / sums[..., 3] / (rate * (1 - rate))


def _debiased(rows: Sequence[tuple[str, Belief]]) -> Estimate:
    """Return the debiased calibration error.

    The mean over resamples is biased: it differs from the value of the rows themselves. The interval is shifted by this
    difference.
    """
    if not rows:
        return Estimate(math.nan, None, 0)
    houses = _houses(rows)
    names, index = np.unique(houses, return_inverse=True)
    by_house = np.zeros((len(names), scores.VALUES, 2))
    np.add.at(by_house, index, _counts(rows))
    squares = scores.square_sums(by_house)
    centre = float(scores.debiased_calibration_error(by_house.sum(axis=0), squares.sum(axis=0)))

    def shifted(resampling: HouseResampling) -> np.ndarray:
        draws = scores.debiased_calibration_error(resampling.resampled(by_house), resampling.resampled(squares))
        return draws + (centre - float(np.nanmean(draws)))

    return _estimate(centre, houses, shifted)


def _delay(plays: Sequence[tuple[str, int, bool]]) -> Delay:
    """Return the delay over plays.

    A play is (house, steps until the answer or the end, whether the answer came). The answer is that the task is done.
    """
    longest = max(steps for _, steps, _ in plays)
    rows = np.zeros((len(plays), max(longest, DELAY_STEPS) + 1, 2))
    for at, (_, steps, is_detected) in enumerate(plays):
        rows[at, steps, 0] = is_detected
        rows[at, steps, 1] = 1.0
    houses, survival = np.array([house for house, *_ in plays]), _survival(rows.sum(axis=0))

    def estimate(statistic: Callable[[np.ndarray], np.ndarray]) -> Estimate:
        centre = float(statistic(survival))
        return _estimate(centre, houses, lambda resampling: statistic(_survival(resampling.sums(rows))))

    below = np.flatnonzero(survival <= 0.5)
    return Delay(
        plays=len(plays),
        detected=sum(is_detected for *_, is_detected in plays),
        at_once=estimate(lambda found: 1 - found[..., 0]),
        median=float(below[0]) if len(below) else None,
        restricted_mean=estimate(lambda found: found[..., :DELAY_STEPS].sum(axis=-1)),
    )


def _survival(counts: np.ndarray) -> np.ndarray:
    """Return Kaplan and Meier's estimate of the share of plays that have not yet said that the task is done, (...,
    steps).

    `counts`, (..., steps, 2), has two numbers for each number of steps: plays in which the answer came then, and all
    plays that ended or answered then.
    """
    ended = counts[..., 1]
    at_risk = ended.sum(axis=-1, keepdims=True) - (np.cumsum(ended, axis=-1) - ended)
    hazard = np.divide(counts[..., 0], at_risk, out=np.zeros_like(at_risk), where=at_risk > 0)
    return np.cumprod(1 - hazard, axis=-1)
