"""A plan on paper: 20 models x 1,000 episodes x 5 conditions on 8, 64 and 512 cores; how long, and what is the limit.

    python -m benchmarks.scale_plan [--steps 15] [--latency 2.0] [--share 0.125]

A queue is simulated, event by event. An episode starts on a core (its house is loaded), then step by step it waits for
its model and goes back to a core for the action, the hidden state, the frame and the driver's own work. Cores are one
pool; a model's server takes any number of requests, of which its runs keep `connections` open at once, and answers each
after a time drawn from an exponential distribution. The models play at the same time, each its conditions one after
another. Times of one core are those of docs/speed.md; the options replace them.
"""

import argparse
import heapq
import random
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

MODELS, EPISODES, CONDITIONS = 20, 1000, 5
CORES = (8, 64, 512)
CONNECTIONS = (16, 64, 256)
MB_OF_A_SCENE, MB_OF_A_WORKER, MB_OF_A_DRIVER = 61, 250, 280


@dataclass(frozen=True, slots=True)
class Costs:
    """Processor and waiting times in seconds."""

    step_s: float
    """Action, hidden state and frame."""
    start_s: float
    """Reset of an episode, its share of a house's loading included."""
    driver_s: float
    """Prompt, request, reply and record of a step, in the run's main process."""
    latency_s: float
    """Mean time that a model takes to answer."""
    steps: float
    """Mean replies of an episode."""


@dataclass(slots=True)
class CampaignLoad:
    """Duration and load of a simulated campaign."""

    wall_s: float = 0.0
    busy_s: dict[str, float] = field(default_factory=lambda: {"start": 0.0, "step": 0.0, "driver": 0.0})
    requests: int = 0


def campaign(costs: Costs, cores: int, connections: int, share: float, seed: int = 0) -> CampaignLoad:
    """Return the load of a campaign of which `share` of the episodes is simulated, with as large a share of its cores.

    Of fewer than `share` x cores there is at least one; connections shrink alike, so that ratios stay.
    """
    rng, load = random.Random(seed), CampaignLoad()
    left = [round(EPISODES * CONDITIONS * share)] * MODELS
    free, waiting = max(1, round(cores * share)), deque[tuple[int, str, int]]()
    events: list[tuple[float, int, str, int, int]] = []
    numbers = iter(range(10**9))
    now = 0.0

    def ask_for_core(model: int, what: str, steps: int) -> None:
        waiting.append((model, what, steps))

    def begin(model: int) -> None:
        if left[model]:
            left[model] -= 1
            ask_for_core(model, "start", 1 + int(rng.expovariate(1 / max(1e-9, costs.steps - 0.5))))

    for model in range(MODELS):
        for _ in range(max(1, round(connections * share))):
            begin(model)
    while events or waiting:
        while free and waiting:
            model, what, steps = waiting.popleft()
            free -= 1
            spent = dict(_parts(costs, what))
            for name, seconds in spent.items():
                load.busy_s[name] += seconds
            heapq.heappush(events, (now + sum(spent.values()), next(numbers), "core", model, steps))
        now, _, kind, model, steps = heapq.heappop(events)
        if kind == "core":
            free += 1
            if steps:
                load.requests += 1
                heapq.heappush(
                    events, (now + rng.expovariate(1 / costs.latency_s), next(numbers), "answer", model, steps)
                )
            else:
                begin(model)
        else:
            ask_for_core(model, "step", steps - 1)
    load.wall_s = now
    return load


def _parts(costs: Costs, what: str) -> Iterator[tuple[str, float]]:
    if what == "start":
        yield "start", costs.start_s
    yield "step", costs.step_s
    yield "driver", costs.driver_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=float, default=15.0, help="mean replies of an episode (15)")
    parser.add_argument("--latency", type=float, default=2.0, help="mean seconds of an answer (2.0)")
    parser.add_argument("--step-ms", type=float, default=57.0, help="core time of a step with its frame (57)")
    parser.add_argument("--start-ms", type=float, default=180.0, help="core time of an episode's start (180)")
    parser.add_argument("--driver-ms", type=float, default=7.6, help="core time of the driver, a step (7.6)")
    parser.add_argument("--share", type=float, default=0.125, help="share of the campaign that is simulated (0.125)")
    given = parser.parse_args()
    costs = Costs(given.step_ms / 1000, given.start_ms / 1000, given.driver_ms / 1000, given.latency, given.steps)
    print(f"{MODELS} models x {EPISODES} episodes x {CONDITIONS} conditions: {costs}")
    columns = "cores, connections a model, hours, cores busy, of that start + step + driver, requests/s, a model's, GB"
    print(f"| {columns.replace(', ', ' | ')} |")
    print(f"|{'---|' * len(columns.split(', '))}")
    for cores in CORES:
        for connections in CONNECTIONS:
            print(row(costs, cores, connections, given.share))


def row(costs: Costs, cores: int, connections: int, share: float) -> str:
    """Return one row of the table."""
    load = campaign(costs, cores, connections, share)
    busy = sum(load.busy_s.values())
    used = busy / (load.wall_s * max(1, round(cores * share)))
    parts = " + ".join(f"{seconds / busy:.0%}" for seconds in load.busy_s.values())
    rate = load.requests / load.wall_s / share
    workers = min(cores, MODELS * connections)
    memory = (MODELS * MB_OF_A_DRIVER + workers * MB_OF_A_WORKER + MODELS * connections * MB_OF_A_SCENE) / 1024
    found = (
        cores,
        connections,
        f"{load.wall_s / 3600:.2f}",
        f"{used:.0%}",
        parts,
        f"{rate:.0f}",
        f"{rate / MODELS:.1f}",
    )
    return f"| {' | '.join(map(str, found))} | {memory:.0f} |"


if __name__ == "__main__":
    main()
