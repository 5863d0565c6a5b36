"""How often each kind of interval covers the true value, in simulated runs: a Markdown table.

    python -m benchmarks.coverage [--runs 1000] [--seed 1]

Episodes share houses: the results of two episodes of one house are correlated. The true value is that of endlessly many
houses. Each interval should cover it in 95 % of the runs.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from vigil.analysis.measures.calibration import disattenuated, reliability
from vigil.analysis.measures.intervals import (
    clustered_interval,
    independent_difference,
    mean_of_rates_interval,
    rate_interval_by_houses,
)
from vigil.analysis.measures.item_response import SuccessTable, fit, rank_correlation_interval
from vigil.scoring.rates import Interval, effective_sample_size, wilson

PROFILES = {
    "Families differ": (0.9, 0.55, 0.5, 0.92, 0.45, 0.15, 0.25, 0.1),
    "Families alike": (0.5,) * 8,
    "Families at the ends": (0.98, 0.95, 0.9, 0.98, 0.1, 0.05, 0.02, 0.02),
}
"""True rates of eight families."""
AGENTS = (3, 5, 10, 30)
TRUE_CORRELATION = 0.6
"""True correlation of an index with the difficulties of episodes."""
SIZES = ((8, 7), (80, 24), (80, 57), (240, 12), (1000, 188))
"""Numbers of episodes and houses."""
CORRELATIONS = (0.0, 0.1, 0.2)
PUBLISHED = 0.4
"""True rate of an independent run of a thousand episodes."""
Truth = tuple[Interval | None, float]
"""An interval, and the value that it should cover."""


@dataclass(frozen=True)
class World:
    """Shape of the simulated runs."""

    episodes: int
    houses: int
    correlation: float
    """Correlation of the results of two episodes of one house, for rates near one half."""


@dataclass(frozen=True)
class Plays:
    """One simulated run: an entry of each array for each play."""

    hits: np.ndarray
    rare: np.ndarray
    """Hits of an outcome with a true rate of 5 %."""
    steps: np.ndarray
    """Numbers with a true mean of 10."""
    again: np.ndarray
    """Hits of a second run of the same episodes, whose true rates are 5 points lower."""
    families: np.ndarray
    houses: np.ndarray


def simulate(world: World, rates: np.ndarray, rng: np.random.Generator) -> Plays:
    families = np.arange(world.episodes) % len(rates)
    houses = rng.permutation(np.arange(world.episodes) % world.houses)
    share = np.sin(np.pi / 2 * world.correlation)
    own, common = np.sqrt(1 - share), np.sqrt(share) * rng.standard_normal((2, world.houses))[:, houses]
    episode, noise = rng.standard_normal((2, 2, world.episodes)) * np.sqrt([[[0.5]], [[0.5]]])
    latent = common[0] + own * (episode[0] + noise[0])
    second = common[0] + own * (episode[0] + noise[1])
    bad = common[1] + own * rng.standard_normal(world.episodes)
    return Plays(
        hits=latent < ndtri(rates[families]),
        rare=bad < ndtri(0.05),
        steps=np.exp(0.5 * latent) * 10 / np.exp(0.125),
        again=second < ndtri(np.maximum(rates[families] - 0.05, 1e-3)),
        families=families,
        houses=houses,
    )


def wilson_of(hits: np.ndarray) -> Interval:
    return wilson(float(hits.sum()), len(hits))


def mover_of_families(plays: Plays) -> Interval:
    """Return the former interval of the mean of families: their Wilson intervals combined."""
    ends, rates = [], []
    for family in np.unique(plays.families):
        hits = plays.hits[plays.families == family]
        rates.append(hits.mean())
        ends.append(wilson_of(hits))
    below, above = (
        np.sqrt(np.sum([(end[i] - rate) ** 2 for end, rate in zip(ends, rates, strict=True)])) / len(rates)
        for i in (0, 1)
    )
    return float(np.mean(rates) - below), float(np.mean(rates) + above)


def epochs_interval(plays: Plays) -> Interval:
    """Return the interval of a rate over two plays of each episode."""
    both = plays.hits.astype(int) + plays.again
    effective = effective_sample_size(both.tolist(), [2] * len(both))
    return wilson(effective * both.mean() / 2, effective)


def difference_to_published(plays: Plays, mean: float, rng: np.random.Generator) -> Truth:
    ends = rate_interval_by_houses(plays.hits, np.ones(len(plays.hits)), plays.houses)
    printed = rng.binomial(1000, PUBLISHED) / 1000
    if ends is None:
        return None, 0.0
    own, published = (float(plays.hits.mean()), *ends), (printed, *wilson(1000 * printed, 1000))
    return independent_difference(own, published)[1], mean - PUBLISHED


def kinds(plays: Plays, rates: np.ndarray, rng: np.random.Generator) -> Iterator[tuple[str, Truth]]:
    """Yield the name of each kind of interval, with the interval of a run and the true value."""
    every, mean = np.ones(len(plays.hits)), float(rates.mean())
    lower = float(np.maximum(rates - 0.05, 1e-3).mean())
    one = plays.families == 1
    yield "one rate: Wilson", (wilson_of(plays.hits), mean)
    yield "one rate: by houses", (rate_interval_by_houses(plays.hits, every, plays.houses), mean)
    yield "rate of 5 %: Wilson", (wilson_of(plays.rare), 0.05)
    yield "rate of 5 %: by houses", (rate_interval_by_houses(plays.rare, every, plays.houses), 0.05)
    yield "one family: Wilson", (wilson_of(plays.hits[one]), rates[1])
    yield "one family: by houses", (rate_interval_by_houses(plays.hits, one, plays.houses), rates[1])
    yield "mean of families: MOVER (former)", (mover_of_families(plays), mean)
    yield "mean of families", (mean_of_rates_interval(plays.hits, plays.families, plays.houses), mean)
    yield "two epochs: Wilson, effective plays", (epochs_interval(plays), (mean + lower) / 2)
    yield "mean of steps: bootstrap", (clustered_interval(plays.steps, plays.houses), 10.0)
    change = plays.again.astype(float) - plays.hits
    yield "paired difference: bootstrap", (clustered_interval(change, plays.houses), lower - mean)
    yield "own minus published", difference_to_published(plays, mean, rng)


def coverage(
    world: World, runs: int, rates: np.ndarray, rng: np.random.Generator
) -> dict[str, tuple[float | None, float | None]]:
    """Return, for each kind, the share of given intervals that cover, and their mean width in points."""
    found: dict[str, list[tuple[bool, float]]] = {}
    for _ in range(runs):
        for name, (interval, truth) in kinds(simulate(world, rates, rng), rates, rng):
            given = found.setdefault(name, [])
            if interval is not None:
                given.append((interval[0] <= truth <= interval[1], interval[1] - interval[0]))
    return {
        name: (float(np.mean([hit for hit, _ in given])), float(np.mean([width for _, width in given])))
        if given
        else (None, None)
        for name, given in found.items()
    }


def markdown(runs: int, seed: int, sizes: Sequence[tuple[int, int]] = SIZES, *, rates: np.ndarray) -> str:
    """Return the table: a row for each kind of interval, a column for each shape of run."""
    worlds = [World(*size, correlation) for size in sizes for correlation in CORRELATIONS]
    rng = np.random.default_rng(seed)
    columns = {world: coverage(world, runs, rates, rng) for world in worlds}
    heads = [f"{world.episodes} in {world.houses}, {world.correlation:g}" for world in worlds]
    lines = [f"| interval | {' | '.join(heads)} |", f"|---|{'---:|' * len(heads)}"]
    for name in columns[worlds[0]]:
        cells = (columns[world][name][0] for world in worlds)
        lines.append(f"| {name} | {' | '.join('–' if each is None else f'{100 * each:.0f}' for each in cells)} |")
    return "\n".join(lines)


def difficulty_markdown(runs: int, rng: np.random.Generator) -> str:
    """Return the table of `vigil pack difficulty`: coverage with few and many agents, 80 episodes in 57 houses."""
    lines = [
        "| agents | difficulty ± 1.96 SE | correlation, houses alone (former) | correlation |",
        "|---:|---:|---:|---:|",
    ]
    for agents in AGENTS:
        found = np.array([_difficulty_covers(agents, rng) for _ in range(runs)])
        lines.append(f"| {agents} | {' | '.join(f'{100 * each:.0f}' for each in found.mean(axis=0))} |")
    return "\n".join(lines)


def _difficulty_covers(agents: int, rng: np.random.Generator) -> tuple[float, bool, bool]:
    """Return the share of covered difficulties, and whether either interval covers the true rank correlation."""
    difficulty = 1.5 * rng.standard_normal(80)
    index = TRUE_CORRELATION * difficulty / 1.5 + np.sqrt(1 - TRUE_CORRELATION**2) * rng.standard_normal(80)
    hits = rng.random((agents, 80)) < 1 / (1 + np.exp(difficulty - 1.5 * rng.standard_normal((agents, 1))))
    names = tuple(map(str, range(agents))), tuple(map(str, range(80)))
    fitted = fit(SuccessTable(*names, hits.astype(float), np.ones(hits.shape)))
    covered = np.mean(np.abs(fitted.difficulty - difficulty) < 1.96 * fitted.difficulty_se)
    former = rank_correlation_interval(fitted.difficulty, index, rng.permutation(np.arange(80) % 57))
    assert former is not None
    present = disattenuated(former, reliability(fitted.difficulty, fitted.difficulty_se))
    truth = 6 / np.pi * np.arcsin(TRUE_CORRELATION / 2)  # Spearman's correlation of two normal variables
    return float(covered), former[0] <= truth <= former[1], present[0] <= truth <= present[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for title, rates in PROFILES.items():
        print(f"### {title}\n\n{markdown(options.runs, options.seed, rates=np.array(rates))}\n")
    print(f"### vigil pack difficulty\n\n{difficulty_markdown(options.runs // 5, np.random.default_rng(options.seed))}")


if __name__ == "__main__":
    main()
