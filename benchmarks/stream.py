"""How many validated episodes a second a stream yields: `python -m benchmarks.stream`.

Wall time says what a learner would have to wait on this machine as busy as it is; processor time says what an episode
costs. Starting the processes is part of both.
"""

import argparse
import os
import resource
import time
from collections import Counter

from vigil.authoring.streaming.stream import Stream
from vigil.protocol.families import parse_families


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--houses", type=int, default=10)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--family", default="PG,DA,VS,SV,AI,SI,SM,CR")
    asked = parser.parse_args()
    families, last = parse_families([asked.family]), asked.first + asked.houses
    begun, load = time.monotonic(), os.getloadavg()[0]
    counts: Counter[str] = Counter()
    waits: list[float] = []
    with Stream(asked.seed, families=families, first=asked.first, last=last, workers=asked.workers) as stream:
        for house in stream.houses():
            counts.update(draft.episode.family for draft in house.drafts)
            waits.append(time.monotonic() - begun)
            print(f"house {house.number}: {len(house.drafts)} episodes, {waits[-1]:.0f} s since the start", flush=True)
    wall_s = time.monotonic() - begun
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    cpu_s = sum(each.ru_utime + each.ru_stime for each in usage)
    total = counts.total()
    print(f"{total} episodes in {asked.houses} houses: {dict(counts)}")
    print(f"{total / wall_s:.2f} episodes a second, {cpu_s / total:.2f} s of processor time an episode")
    print(f"load average {load:.1f} to {os.getloadavg()[0]:.1f}, {usage[1].ru_maxrss / 1024:.0f} MB a process")


if __name__ == "__main__":
    main()
