"""How much memory a worker of a model's run takes, and whether it grows: live episodes over a pack's houses.

    python -m benchmarks.memory [--pack vigil_balanced_1000] [--live 8] [--episodes 250] [--spread] [--houses 4]

The worker's own class holds `--live` episodes at once. Whenever one ends, the pack's next episode begins, in order of
play, so that several live episodes share a house; with `--spread`, every live episode has a house of its own, which is
the worst case; with `--houses`, the episodes of the first houses are played again and again, so that any growth is a
leak. An episode draws two frames and is closed by a report. Memory is printed every 25 episodes.
"""

import argparse
import itertools
import json

import psutil

from vigil.packs.pack import Pack
from vigil.protocol.actions import Reply
from vigil.protocol.profile import Profile
from vigil.records.shards import play_order
from vigil.runner.workers.messages import Assignment, WorkerPlan
from vigil.runner.workers.worker import EpisodeWorker

TURN = Reply(text=json.dumps({"skill_name": "navigate", "arguments": {"mode": "turn_right", "magnitude": 30}}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pack", default="vigil_balanced_1000")
    parser.add_argument("--live", type=int, default=8)
    parser.add_argument("--episodes", type=int, default=250)
    parser.add_argument("--spread", action="store_true")
    parser.add_argument("--houses", type=int)
    options = parser.parse_args()
    pack = Pack.load(options.pack)
    episodes = list(play_order(pack.episodes, pack.pairs))
    if options.spread:
        episodes = list({episode.house.name: episode for episode in episodes}.values())
    if options.houses:
        names = list(dict.fromkeys(episode.house.name for episode in episodes))[: options.houses]
        episodes = [episode for episode in episodes if episode.house.name in names]
    worker = EpisodeWorker(WorkerPlan(pack=pack.folder, run_id="memory", profile=Profile(), pack_sha256=pack.sha256))
    peak = 0.0
    for number, episode in enumerate(itertools.islice(itertools.cycle(episodes), options.episodes)):
        if number >= options.live:
            worker.drop(number - options.live)
        worker.begin(number, Assignment(episode))
        worker.advance(number, TURN)
        used = psutil.Process().memory_full_info()
        peak = max(peak, used.uss / 2**20)
        if number % 25 == 24:
            print(
                f"{number + 1} episodes, {min(options.live, number + 1)} live: {used.uss / 2**20:.0f} MB of its own, "
                f"{used.rss / 2**20:.0f} MB with shared libraries",
                flush=True,
            )
    print(f"peak {peak:.0f} MB of its own")


if __name__ == "__main__":
    main()
