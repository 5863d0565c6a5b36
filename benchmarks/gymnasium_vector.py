"""How much of the bare Env's speed a Gymnasium vector keeps, with and without drawing.

    python -m benchmarks.gymnasium_vector [--envs 16] [--seconds 20] [--rounds 3] [--families PG,SV] [--asynchronous]

The bare Env is played in as many processes at once as there are cores, each on its own, and the vector in as many;
with --asynchronous in as many as it has environments, as Gymnasium's own does. They take turns. Both draw episodes at
random and turn to the end of the budget, resets included; a first third of the time is not counted, since all begin
with a reset, and before all that the houses are built once in a process that the others are forks of. It prints two
ratios: of steps a second, which holds on a machine with nothing else to do (elsewhere sixteen processes get more of it
than two), and of steps a second of processor time, which holds anywhere but counts no waiting. Before that, one
environment and a bare Env play the same episodes in one process, in turns: what the environment costs by itself.
"""

import argparse
import json
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import gymnasium
import numpy as np
import psutil

import vigil.integrations.gymnasium as integration
from vigil.api import make_env
from vigil.assets.database import AssetDatabase
from vigil.env import Env
from vigil.packs.even_draw import draw_evenly
from vigil.packs.pack import Pack, Selection
from vigil.protocol.actions import Reply
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, parse_families
from vigil.sim import make_simulator

TURN = json.dumps({"skill_name": "navigate", "arguments": {"mode": "turn_right", "magnitude": 30}})
EPISODES_ALONE = 4
FORKING = multiprocessing.get_context("fork")


def main() -> None:
    options = read_options()
    build_all(options)
    cores = len(os.sched_getaffinity(0))
    print(f"{options.envs} environments, {cores} cores, load average {os.getloadavg()[0]:.1f}, {options.backend}")
    for drawing in options.drawing or ("without", "with"):
        frames = drawing == "with"
        with ProcessPoolExecutor(1, FORKING) as pool:  # OpenGL does not survive the forks below
            kept = pool.submit(relative_speed, options, frames).result()
        print(f"{drawing} drawing, one environment: {kept:.1%} of the bare Env", flush=True)
        bare, vector = [], []
        for _ in range(options.rounds):
            with ProcessPoolExecutor(cores, FORKING) as pool:
                bare.append(
                    np.sum(list(pool.map(bare_run, [(options, frames, seed) for seed in range(cores)])), axis=0)
                )
            vector.append(vector_run(options, frames))
        (wall, cpu), (vector_wall, vector_cpu) = rates(np.array(bare), cores), rates(np.array(vector), 1)
        print(
            f"{drawing} drawing: bare {wall:.1f} steps/s, vector {vector_wall:.1f}, "
            f"{vector_wall / wall:.0%}; of processor time {cpu:.1f} and {vector_cpu:.1f}, {vector_cpu / cpu:.0%}",
            flush=True,
        )


def build_all(options: argparse.Namespace) -> None:
    """Build the houses once, so that the processes below share the pack and its assets as after long training."""
    simulator = make_simulator(options.backend, assets=AssetDatabase.default(), quality=options.quality)
    pack = Pack.load(options.pack)
    houses = {episode.house.sha256: episode for episode in chosen(options)}
    for episode in houses.values():
        simulator.prepare(pack.house_of(episode))


def chosen(options: argparse.Namespace) -> list[Episode]:
    """Return the pack's episodes of the families asked for."""
    return Pack.load(options.pack).select(Selection(families=parse_families([options.families])))


def relative_speed(options: argparse.Namespace, frames: bool) -> float:
    """Return the processor time of a bare Env over that of one environment, both having seen the houses before."""
    pack = Pack.load(options.pack)
    episodes = draw_evenly(chosen(options))[:EPISODES_ALONE]
    env = gymnasium.make(
        integration.ENV_ID, pack=options.pack, backend=options.backend, quality=options.quality, frames=frames
    )
    used = [0.0, 0.0]
    with make_env(pack, backend=options.backend, quality=options.quality) as bare:
        for turn in range(1 + options.rounds):
            for episode in episodes:
                times = [time.process_time()]
                play_bare(bare, episode, frames)
                times.append(time.process_time())
                env.reset(options={"episode_id": episode.id})
                while not any(env.step(TURN)[2:4]):
                    pass
                times.append(time.process_time())
                if turn:
                    used = [used[0] + times[1] - times[0], used[1] + times[2] - times[1]]
    env.close()
    return used[0] / used[1]


def play_bare(env: Env, episode: Episode, frames: bool) -> None:
    """Play one episode to the end of its budget."""
    seen = env.reset(episode)
    while seen is not None:
        if frames:
            _ = seen.rgb
        seen = env.step(Reply(text=TURN))


def rates(runs: np.ndarray, at_once: int) -> tuple[float, float]:
    """Return steps a second, and a second of processor time, of rows of steps, seconds and processor time."""
    steps, seconds, cpu = runs.sum(axis=0)
    return steps / seconds * at_once, steps / cpu


def bare_run(job: tuple[argparse.Namespace, bool, int]) -> tuple[float, float, float]:
    """Return the steps of one bare Env, the seconds, and those of processor time."""
    options, frames, seed = job
    pack, rng, episodes = Pack.load(options.pack), np.random.default_rng(seed), chosen(options)
    with make_env(pack, backend=options.backend, quality=options.quality) as env:
        begin(env, episodes, rng, frames)
        start, cpu, steps, is_warm = time.perf_counter(), 0.0, 0, False
        while (seconds := time.perf_counter() - start) < options.seconds:
            if not is_warm and seconds > options.seconds / 3:
                start, cpu, steps, is_warm = time.perf_counter(), time.process_time(), 0, True
            seen = env.step(Reply(text=TURN))
            steps += 1
            if seen is None:
                begin(env, episodes, rng, frames)
            elif frames:
                _ = seen.rgb
        return steps, seconds, time.process_time() - cpu


def begin(env: Env, episodes: list[Episode], rng: np.random.Generator, frames: bool) -> None:
    """Reset to an episode drawn at random, and look at its first frame."""
    seen = env.reset(episodes[int(rng.integers(len(episodes)))])
    if frames and seen is not None:
        _ = seen.rgb


def vector_run(options: argparse.Namespace, frames: bool) -> tuple[float, float, float]:
    """Return the same of the vector; calls that begin an episode are no steps."""
    started: dict[str, Any] = {"context": "fork"}
    if options.asynchronous:
        started = {"vectorization_mode": "async", "vector_kwargs": started}
    env = gymnasium.make_vec(
        integration.ENV_ID,
        num_envs=options.envs,
        **started,
        pack=options.pack,
        family=options.families,
        backend=options.backend,
        quality=options.quality,
        frames=frames,
    )
    env.reset(seed=100)
    ended = np.zeros(options.envs, bool)
    start, cpu, steps, is_warm = time.perf_counter(), 0.0, 0, False
    while (seconds := time.perf_counter() - start) < options.seconds:
        if not is_warm and seconds > options.seconds / 3:
            start, cpu, steps, is_warm = time.perf_counter(), processor_seconds(), 0, True
        _, _, terminated, truncated, _ = env.step((TURN,) * options.envs)
        steps += options.envs - int(ended.sum())
        ended = terminated | truncated
    cpu = processor_seconds() - cpu
    env.close()
    return steps, seconds, cpu


def processor_seconds() -> float:
    """Return what this process and those that it started have used."""
    own = psutil.Process()
    return sum(times.user + times.system for times in (each.cpu_times() for each in (own, *own.children())))


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--envs", type=int, default=16)
    parser.add_argument("--asynchronous", action="store_true", help="a process for each environment")
    parser.add_argument("--drawing", choices=["without", "with"], action="append", help="one of the two alone")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pack", default="starter")
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--backend", default="mujoco")
    parser.add_argument("--quality", default="default")
    return parser.parse_args()


if __name__ == "__main__":
    main()
