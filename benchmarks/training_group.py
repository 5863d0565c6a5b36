"""Processor time of an environment step while groups of environments play the same episodes of a stream, with drawing.

    python -m benchmarks.training_group [--envs 16] [--group 8] [--steps 30] [--report 0.25] [--agree 0]

All environments take random actions: reports with the probability `--report`, so that an episode has 1 / `--report`
steps on average, otherwise any other skill. With the probability `--agree`, an environment takes the action of the
first of its group. Environments with equal seeds play the same episodes: the `--group` of them share
the houses that one process makes and lights, and frames with equal contents. With `--group 1`, each environment plays
its own episodes. The time includes starting the processes, making and lighting houses, and resets. Vectors of MiniGrid
and MiniWorld are measured in the same way where these packages are installed.
"""

import argparse
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np
import psutil

import vigil.integrations.gymnasium as integration
from vigil.protocol.actions import SKILLS

OTHERS = {"minigrid": "minigrid:MiniGrid-FourRooms-v0", "miniworld": "miniworld:MiniWorld-FourRooms-v0"}


def main() -> None:
    given = read_options()
    options = {"pack": "stream:7", "family": given.families, "actions": "structured"}
    options |= {"processes": given.processes, "quality": given.quality}
    measure("VIGIL", lambda: gymnasium.make_vec(integration.ENV_ID, num_envs=given.envs, **options), given)
    for package, name in OTHERS.items():
        if find_spec(package) is None:
            print(f"{package} is not installed")
            continue
        measure(package, lambda name=name: gymnasium.make_vec(name, num_envs=given.envs), given)


def measure(name: str, make: Callable[[], Any], given: argparse.Namespace) -> None:
    """Print steps, episodes, and the processor and wall time of a step of a vector."""
    used: dict[int, float] = {}
    before, start = processor_seconds(used), time.perf_counter()
    env = make()
    env.action_space.seed(5)
    rng = np.random.default_rng(5)
    env.reset(seed=[100 + number // given.group for number in range(given.envs)])
    begun = processor_seconds(used)
    ended, steps, episodes = np.zeros(given.envs, bool), 0, 0
    for _ in range(given.steps):
        _, _, terminated, truncated, _ = env.step(drawn_actions(env.action_space.sample(), rng, given))
        steps += given.envs - int(ended.sum())
        ended = terminated | truncated
        episodes += int(ended.sum())
        processor_seconds(used)
    cpu, wall = processor_seconds(used) - before, time.perf_counter() - start
    env.close()
    print(
        f"{name}: {steps} steps, {episodes} episodes, {1000 * cpu / steps:.1f} ms of processor time and "
        f"{1000 * wall / steps:.1f} ms of wall time a step; without the start and the first "
        f"reset {1000 * (before + cpu - begun) / steps:.1f} ms of processor time",
        flush=True,
    )


def drawn_actions(sampled: Any, rng: np.random.Generator, given: argparse.Namespace) -> Any:
    """Return the sampled actions, with VIGIL's skills drawn by `--report` and `--agree`; others are not changed."""
    if not isinstance(sampled, dict):
        return sampled
    skills = list(SKILLS)
    others = rng.choice([number for number, name in enumerate(skills) if name != "report"], given.envs)
    sampled["skill_name"] = np.where(rng.random(given.envs) < given.report, skills.index("report"), others)
    agrees = rng.random(given.envs) < given.agree
    firsts = np.arange(given.envs) // given.group * given.group
    return {name: np.where(agrees, values[firsts], values) for name, values in sampled.items()}


def processor_seconds(used: dict[int, float]) -> float:
    """Return the processor time of this process and of all that it has started, including those that have ended."""
    own = psutil.Process()
    for each in (own, *own.children(recursive=True)):
        try:
            used[each.pid] = sum(each.cpu_times()[:2])
        except psutil.NoSuchProcess:
            continue
    return sum(used.values())


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--envs", type=int, default=16)
    parser.add_argument("--group", type=int, default=8, help="number of environments that play the same episodes")
    parser.add_argument("--steps", type=int, default=30, help="number of steps of each environment")
    parser.add_argument("--report", type=float, default=0.25, help="probability that an action is a report")
    parser.add_argument("--agree", type=float, default=0.0, help="probability of the action of the first of the group")
    parser.add_argument("--families", default="PG")
    parser.add_argument("--quality", default="default")
    parser.add_argument("--processes", type=int)
    return parser.parse_args()


if __name__ == "__main__":
    main()
