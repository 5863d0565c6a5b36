"""How much of the bare Env's speed a Gymnasium vector keeps, with and without drawing.

    python benchmarks/gymnasium_vector.py [--envs 16] [--seconds 20] [--rounds 3] [--pack starter] [--backend mujoco]

The bare Env is played in as many processes at once as there are cores, each on its own; the vector (asynchronous) in as
many as it has environments. Both draw episodes at random and turn to the end of the budget, resets included. They take
turns, so that a busy machine is fair to both; the figure is the ratio of steps a second.
"""

import argparse
import json
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor

import gymnasium
import numpy as np

import vigil.integrations.gymnasium as integration
from vigil.actions import Reply
from vigil.api import make_env
from vigil.env import Env
from vigil.integrations.gymnasium.env import load_pack
from vigil.pack import Pack

TURN = json.dumps({"skill_name": "navigate", "arguments": {"mode": "turn_right", "magnitude": 30}})
FORKING = multiprocessing.get_context("fork")


def main() -> None:
    options = read_options()
    load_pack(options.pack)  # which the processes below share
    cores = len(os.sched_getaffinity(0))
    print(f"{options.envs} environments, {cores} cores, load average {os.getloadavg()[0]:.1f}, {options.backend}")
    for frames in (False, True):
        bare, vector = [], []
        for _ in range(options.rounds):
            with ProcessPoolExecutor(cores, FORKING) as pool:
                bare.append(sum(pool.map(bare_rate, [(options, frames, seed) for seed in range(cores)])))
            vector.append(vector_rate(options, frames))
        ratios = ", ".join(f"{one / other:.0%}" for one, other in zip(vector, bare, strict=True))
        drawing = "with drawing" if frames else "without drawing"
        print(
            f"{drawing:16} bare {np.mean(bare):6.1f} steps/s, vector {np.mean(vector):6.1f}, "
            f"share {np.sum(vector) / np.sum(bare):.0%} (rounds: {ratios})",
            flush=True,
        )


def bare_rate(job: tuple[argparse.Namespace, bool, int]) -> float:
    """Returns the steps a second of one bare Env."""
    options, frames, seed = job
    pack, rng = load_pack(options.pack), np.random.default_rng(seed)
    with make_env(pack, backend=options.backend, quality=options.quality) as env:
        begin(env, pack, rng, frames)
        start, steps = time.perf_counter(), 0
        while (seconds := time.perf_counter() - start) < options.seconds:
            seen = env.step(Reply(text=TURN))
            steps += 1
            if seen is None:
                begin(env, pack, rng, frames)
            elif frames:
                _ = seen.rgb
    return steps / seconds


def begin(env: Env, pack: Pack, rng: np.random.Generator, frames: bool) -> None:
    """Resets to an episode drawn at random, and looks at its first frame."""
    seen = env.reset(pack.episodes[int(rng.integers(len(pack.episodes)))])
    if frames and seen is not None:
        _ = seen.rgb


def vector_rate(options: argparse.Namespace, frames: bool) -> float:
    """Returns the steps a second of the vector; calls that begin an episode are no steps."""
    env = gymnasium.make_vec(
        integration.ENV_ID,
        num_envs=options.envs,
        vectorization_mode="async",
        vector_kwargs={"context": "fork"},
        pack=options.pack,
        backend=options.backend,
        quality=options.quality,
        frames=frames,
    )
    env.reset(seed=100)
    ended = np.zeros(options.envs, bool)
    start, steps = time.perf_counter(), 0
    while (seconds := time.perf_counter() - start) < options.seconds:
        _, _, terminated, truncated, _ = env.step((TURN,) * options.envs)
        steps += options.envs - int(ended.sum())
        ended = terminated | truncated
    env.close()
    return steps / seconds


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--envs", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each measurement")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pack", default="starter")
    parser.add_argument("--backend", default="mujoco")
    parser.add_argument("--quality", default="default")
    return parser.parse_args()


if __name__ == "__main__":
    main()
