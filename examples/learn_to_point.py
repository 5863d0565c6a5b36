"""A small network learns to point: cloned from demonstrations of a stream, then improved on B by playing.

    pip install 'vigil-bench[gymnasium]'
    pip install torch --index-url https://download.pytorch.org/whl/cpu      # for processors only; 200 MB, not 3 GB
    python examples/learn_to_point.py --out runs/pointing

Pointing (family PG) takes two replies: a click on the object that the instruction names, and a report of success. The
network reads the frame, shrunk to 160 x 120, and the instruction's words, and samples its click from a map of 40 x 30
places.

1. `vigil demos` writes what the solver saw and answered in houses of a stream; the network learns to click there.
2. In other houses it plays: for each episode several clicks are sampled from its map, and B is their reward. Clicks
   that earned B become likelier; in an episode in which no click has earned it yet, those tried become less likely.
3. In houses that neither step has used it clicks on the best place of its map. For comparison, a random policy clicks
   anywhere on the same frames, and the solver plays the same episodes.
"""

import argparse
import csv
import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from matplotlib.figure import Figure
from PIL import Image

from vigil.packs.pack import Pack
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.scoring.rates import wilson


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for results; finished parts in it are reused")
    parser.add_argument("--demos", type=int, default=400, help="number of demonstrated episodes (400)")
    parser.add_argument("--played", type=int, default=500, help="number of episodes to play (500)")
    parser.add_argument("--tested", type=int, default=300, help="number of episodes to test on (300)")
    parser.add_argument("--epochs", type=int, default=20, help="passes over the demonstrations (20)")
    parser.add_argument("--every", type=int, default=10, help="epochs between tests (10)")
    parser.add_argument("--rounds", type=int, default=2, help="rounds of play (2)")
    parser.add_argument("--processes", type=int, default=2, help="number of processes that play (2)")
    parser.add_argument("--seed", type=int, default=0, help="random seed of the network and its clicks (0)")
    return parser.parse_args()


# Before the learning libraries are imported, so that --help works without them.
GIVEN = read_options() if __name__ == "__main__" else None

try:
    import gymnasium

    # The development environment has no PyTorch.
    import torch  # pyright: ignore[reportMissingImports]
    from torch import nn  # pyright: ignore[reportMissingImports]
    from torch.nn import functional  # pyright: ignore[reportMissingImports]

    import vigil.integrations.gymnasium  # noqa: F401 - registers Vigil-v0
except ModuleNotFoundError as error:
    raise SystemExit(f"{error.name} is not installed. The docstring of this file says how to install it.") from None

STREAM = "stream:21"
FAMILY = ("--family", "PG", "--difficulty", "easy", "--difficulty", "medium")
DEMOS, PLAYED, TESTED = "0:5000", "5000:6000", "6000:7000"
"""Houses of the stream for each of the three parts, which do not share any."""
WIDTH, HEIGHT = 160, 120
COLUMNS, ROWS = 40, 30
BATCH = 32
DRAWS = 6
"""Number of clicks drawn for each episode in a round of play."""
PASSES = 6
"""Number of passes over all episodes after each round of play."""
REPORT = json.dumps({"skill_name": "report", "arguments": {"status": "success", "summary": "I clicked on it."}})

CHUNK = 8
"""Number of consecutive episodes given to a process: those of one house follow each other, and it is built once."""


def main(given: argparse.Namespace) -> None:
    torch.manual_seed(given.seed)
    began = time.monotonic()
    demos = read_demos(write_demos(given.out / "demos", given.demos))
    words = Vocabulary(demo.instruction for demo in demos)
    network = Network(len(words))
    packs = [
        write_pack(given.out / name, houses, count)
        for name, houses, count in (("played", PLAYED, given.played), ("tested", TESTED, given.tested))
    ]
    with ProcessPoolExecutor(given.processes, get_context("spawn")) as pool:
        played, tested = (EpisodePool(pack, pool) for pack in packs)
        curve = Curve(tested, began)
        curve.add("chance", 0, torch.randint(COLUMNS * ROWS, (len(tested),)))
        for epoch in clone(network, words, demos, given.epochs):
            if epoch % given.every == 0 or epoch == given.epochs:
                curve.add("cloned", epoch, map_of(network, words, tested).argmax(dim=1))
        for number in improve(network, words, demos, played, given.rounds):
            curve.add("improved on B", number, map_of(network, words, tested).argmax(dim=1))
    curve.add_solver(given.out)
    curve.write(given.out)


@dataclass(frozen=True, slots=True)
class Demo:
    """A frame, the instruction, and where the solver clicked."""

    frame: torch.Tensor
    instruction: str
    place: int


def vigil_command(*words: str | Path) -> None:
    subprocess.run([sys.executable, "-c", "from vigil.cli import main; main()", *map(str, words)], check=True)


def write_demos(out: Path, count: int) -> Path:
    """Write demonstrations, unless they are there; return the file."""
    if not (out / "train.parquet").exists():
        asked = ("--count", str(count), "--houses", DEMOS, "--format", "parquet", "--render-quality", "fast")
        vigil_command("demos", "--pack", STREAM, *FAMILY, *asked, "--out", out)
    return out / "train.parquet"


def write_pack(out: Path, houses: str, count: int) -> Path:
    """Write a part of the stream as a pack, unless it is there; return its folder."""
    if not (out / "manifest.json").exists():
        seed = STREAM.partition(":")[2]
        vigil_command(
            "pack", "stream", "--seed", seed, "--count", str(count), "--houses", houses, *FAMILY, "--out", out
        )
    return out


def read_demos(file: Path) -> list[Demo]:
    """Return the clicks of all demonstrations."""
    found = []
    for row in pq.read_table(file).to_pylist():
        answer = json.loads(row["messages"][-1]["content"][0]["text"])
        if row["kind"] == "demonstration" and answer["skill_name"] == "interact_pixel":
            frame = shrunk(np.asarray(Image.open(BytesIO(row["images"][-1]["bytes"]))))
            arguments = answer["arguments"]
            found.append(Demo(frame, instruction_of(row), place_of(arguments["x"], arguments["y"])))
    return found


def instruction_of(row: dict) -> str:
    """Return the task, which has its own line in the system prompt."""
    found = re.search("^Task: (.*)$", row["messages"][0]["content"][0]["text"], re.MULTILINE)
    assert found is not None
    return found[1]


def shrunk(frame: np.ndarray) -> torch.Tensor:
    """Return a frame (480, 640, 3) as a small one (3, 120, 160) from -0.5 to 0.5."""
    small = np.asarray(Image.fromarray(frame).resize((WIDTH, HEIGHT), Image.Resampling.BOX))
    return torch.from_numpy(small.copy()).permute(2, 0, 1).float() / 255 - 0.5


def place_of(x: int, y: int) -> int:
    return y * ROWS // FRAME_HEIGHT * COLUMNS + x * COLUMNS // FRAME_WIDTH


def reply_of(place: int) -> str:
    """Return the reply that clicks on the middle of a place."""
    row, column = divmod(place, COLUMNS)
    x, y = (column + 0.5) * FRAME_WIDTH / COLUMNS, (row + 0.5) * FRAME_HEIGHT / ROWS
    return json.dumps({"skill_name": "interact_pixel", "arguments": {"intent": "ground", "x": int(x), "y": int(y)}})


class Vocabulary:
    """Instructions as vectors: one number for each word that a demonstration has."""

    def __init__(self, texts: Iterator[str]) -> None:
        self._numbers = {word: number for number, word in enumerate(sorted({w for t in texts for w in _split(t)}))}

    def __len__(self) -> int:
        return len(self._numbers)

    def of(self, texts: Sequence[str]) -> torch.Tensor:
        found = torch.zeros(len(texts), len(self))
        for row, text in enumerate(texts):
            found[row, [self._numbers[word] for word in _split(text) if word in self._numbers]] = 1.0
        return found


def _split(text: str) -> list[str]:
    return re.findall("[a-z]+", text.lower())


class Network(nn.Module):
    """Frame and words to a map of places: what is seen at each place, held against what is asked for."""

    def __init__(self, words: int, size: int = 48) -> None:
        super().__init__()
        sizes = ((5, 24, 2, 1), (24, 32, 1, 1), (32, size, 2, 1), (size, size, 1, 2), (size, size, 1, 4))
        self.see = nn.Sequential(*(_layer(*each) for each in sizes), nn.Conv2d(size, 64, 1))
        self.ask = nn.Linear(words, 64)
        self.usual = nn.Parameter(torch.zeros(ROWS * COLUMNS))
        across, down = torch.linspace(-1, 1, WIDTH), torch.linspace(-1, 1, HEIGHT)
        self.register_buffer("where", torch.stack(torch.meshgrid(down, across, indexing="ij")))

    def forward(self, frames: torch.Tensor, words: torch.Tensor) -> torch.Tensor:
        where = self.where.expand(len(frames), -1, -1, -1)
        seen = self.see(torch.cat([frames, where], dim=1))
        return torch.einsum("nchw,nc->nhw", seen, self.ask(words)).flatten(1) / 8 + self.usual


def _layer(inputs: int, outputs: int, stride: int, spread: int) -> nn.Module:
    convolution = nn.Conv2d(inputs, outputs, 3, stride, padding=spread, dilation=spread)
    return nn.Sequential(convolution, nn.GroupNorm(4, outputs), nn.ReLU())


class _Batches:
    """Demonstrations as what the network is trained on."""

    def __init__(self, demos: Sequence[Demo], words: Vocabulary) -> None:
        self._frames = torch.stack([demo.frame for demo in demos])
        self._asked = words.of([demo.instruction for demo in demos])
        self._clicked = functional.one_hot(torch.tensor([demo.place for demo in demos]), ROWS * COLUMNS).float()

    def loss(self, network: Network, chosen: torch.Tensor) -> torch.Tensor:
        """Return the cross entropy of the network's map and the solver's clicks."""
        seen, (clicked,) = _mirrored(self._frames[chosen], self._clicked[chosen])
        return functional.cross_entropy(
            network(seen * _light(seen), self._asked[chosen]), clicked, label_smoothing=0.05
        )


def clone(network: Network, words: Vocabulary, demos: Sequence[Demo], epochs: int) -> Iterator[int]:
    """Train the network to click where the solver did; yield the number of each epoch, from 1."""
    shown = _Batches(demos, words)
    optimiser = torch.optim.AdamW(network.parameters(), lr=2e-3, weight_decay=1e-2)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, epochs)
    for epoch in range(1, epochs + 1):
        network.train()
        for chosen in torch.randperm(len(demos)).split(BATCH):
            optimiser.zero_grad()
            shown.loss(network, chosen).backward()
            optimiser.step()
        schedule.step()
        yield epoch


def _mirrored(frames: torch.Tensor, *maps: torch.Tensor) -> tuple[torch.Tensor, list[torch.Tensor]]:
    """Return half of the frames as in a mirror, with maps of their places: instructions never say left or right."""
    turned = torch.rand(len(frames)) < 0.5
    flipped = [each.unflatten(1, (ROWS, COLUMNS)).flip(2).flatten(1) for each in maps]
    other = [torch.where(turned[:, None], new, old) for new, old in zip(flipped, maps, strict=True)]
    return torch.where(turned[:, None, None, None], frames.flip(3), frames), other


def _light(frames: torch.Tensor) -> torch.Tensor:
    """Return how much brighter or darker each frame is shown."""
    return 0.85 + 0.3 * torch.rand(len(frames), 1, 1, 1)


class EpisodePool:
    """The episodes of a pack. Each can be played by a click, again and again, in the processes of a pool."""

    def __init__(self, folder: Path, pool: ProcessPoolExecutor) -> None:
        self._pool = pool
        self._asked = [(str(folder), episode.id) for episode in Pack.load(folder).episodes]
        seen = list(pool.map(look, self._asked, chunksize=CHUNK))
        self.instructions = [instruction for instruction, _ in seen]
        self.frames = torch.stack([shrunk(frame) for _, frame in seen])

    def __len__(self) -> int:
        return len(self._asked)

    def play(self, places: torch.Tensor) -> torch.Tensor:
        """Return B of clicks, each followed by a report, for each row of places one after the other."""
        return torch.tensor(list(self._pool.map(play, self._asked, places.tolist(), chunksize=CHUNK)))


@cache
def environment(folder: str) -> gymnasium.Env:
    """Return the environment of a pack, one in each process."""
    return gymnasium.make("Vigil-v0", pack=folder, frames=False, render_mode="rgb_array", quality="fast").unwrapped


def look(asked: tuple[str, str]) -> tuple[str, np.ndarray]:
    """Return the instruction and the first frame of an episode of a pack."""
    env = environment(asked[0])
    observation, _ = env.reset(options={"episode_id": asked[1]})
    return observation["instruction"], np.asarray(env.render())


def play(asked: tuple[str, str], places: Sequence[int]) -> list[float]:
    """Play an episode of a pack once for each place with a click on it and a report; return B of each."""
    env, earned = environment(asked[0]), []
    for place in places:
        env.reset(options={"episode_id": asked[1]})
        env.step(reply_of(place))
        earned.append(float(env.step(REPORT)[1]))
    return earned


def improve(
    network: Network, words: Vocabulary, demos: Sequence[Demo], scenes: EpisodePool, rounds: int
) -> Iterator[int]:
    """Play all scenes and learn from what they earned so far, in turns; yield the number of each round.

    Demonstrations are trained on in the same rounds, so that what they taught is not lost.
    """
    shown = _Batches(demos, words)
    frames, asked = scenes.frames, words.of(scenes.instructions)
    earned, lost = torch.zeros(2, len(scenes), ROWS * COLUMNS)
    optimiser = torch.optim.AdamW(network.parameters(), lr=1.5e-3, weight_decay=1e-2)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, rounds * PASSES * -(-len(scenes) // BATCH))
    for number in range(1, rounds + 1):
        places = torch.distributions.Categorical(logits=map_of(network, words, scenes)).sample((DRAWS,)).T
        reward = scenes.play(places)
        earned.scatter_reduce_(1, places, reward, "amax")
        lost.scatter_reduce_(1, places, 1.0 - reward, "amax")
        network.train()
        for _ in range(PASSES):
            for chosen in torch.randperm(len(scenes)).split(BATCH):
                seen, (won, missed) = _mirrored(frames[chosen], earned[chosen], lost[chosen])
                loss = -_log_earned(network(seen * _light(seen), asked[chosen]), won, missed).mean()
                optimiser.zero_grad()
                (loss + shown.loss(network, torch.randint(len(demos), (BATCH,)))).backward()
                optimiser.step()
                schedule.step()
        yield number


def _log_earned(logits: torch.Tensor, won: torch.Tensor, missed: torch.Tensor) -> torch.Tensor:
    """Return the log probability of the places that earned B; where none did yet, of not trying again what did not."""
    logs = functional.log_softmax(logits, dim=1)
    earning = torch.logsumexp(logs.masked_fill(won == 0, -1e9), dim=1)
    avoiding = torch.log1p(-(logs.exp() * missed).sum(dim=1).clamp(max=0.999))
    return torch.where(won.any(dim=1), earning, avoiding)


def map_of(network: Network, words: Vocabulary, scenes: EpisodePool) -> torch.Tensor:
    """Return the network's map of each scene, as logits."""
    network.eval()
    with torch.no_grad():
        asked = words.of(scenes.instructions)
        return torch.cat([network(*each) for each in zip(scenes.frames.split(BATCH), asked.split(BATCH), strict=True)])


class Curve:
    """B on the test episodes as training goes on."""

    def __init__(self, scenes: EpisodePool, began: float) -> None:
        self._scenes, self._began = scenes, began
        self.points: list[dict[str, str | float]] = []

    def add(self, stage: str, step: int, places: torch.Tensor) -> None:
        """Play all test episodes once, each by a click on its place, and print the share that is won."""
        self._put(stage, step, float(self._scenes.play(places[:, None]).sum()), len(self._scenes))

    def add_solver(self, out: Path) -> None:
        """Add what the solver reaches on the same episodes, by `vigil run`."""
        vigil_command("run", "--pack", out / "tested", "--agent", "solver", "--log-dir", out / "solver")
        scored = subprocess.run(
            [sys.executable, "-c", "from vigil.cli import main; main()", "score", str(out / "solver"), "--json"],
            check=True,
            capture_output=True,
            text=True,
        )
        overall = json.loads(scored.stdout)["runs"][0]["overall"]
        self._put("solver", 0, overall["B"] * overall["episodes"], overall["episodes"])

    def _put(self, stage: str, step: int, won: float, of: int) -> None:
        low, high = wilson(won, of)
        minutes = (time.monotonic() - self._began) / 60
        self.points.append(
            {"stage": stage, "step": step, "minutes": minutes, "B": won / of, "low": low, "high": high, "episodes": of}
        )
        print(f"{minutes:5.1f} min  {stage:14} {step:3}  B {won / of:6.1%} [{low:.1%}, {high:.1%}] of {of}", flush=True)

    def write(self, out: Path) -> None:
        """Write the points as a table, and as a picture."""
        with (out / "curve.csv").open("w", newline="") as file:
            table = csv.DictWriter(file, list(self.points[0]))
            table.writeheader()
            table.writerows(self.points)
        draw(self.points, out / "curve.svg")


def draw(points: Sequence[dict[str, str | float]], file: Path) -> None:
    """Draw B over minutes, with its intervals, between chance and the solver."""
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    for stage, colour in (("cloned", "#0072b2"), ("improved on B", "#d55e00")):
        own = [point for point in points if point["stage"] == stage]
        minutes, rates = [float(p["minutes"]) for p in own], [100 * float(p["B"]) for p in own]
        axes.plot(minutes, rates, marker="o", markersize=3, color=colour, label=stage)
        lows, highs = ([100 * float(p[name]) for p in own] for name in ("low", "high"))
        axes.fill_between(minutes, lows, highs, color=colour, alpha=0.15, linewidth=0)
    for stage, style in (("chance", ":"), ("solver", "--")):
        rate = next(100 * float(point["B"]) for point in points if point["stage"] == stage)
        axes.axhline(rate, color="#555555", linestyle=style, linewidth=1, label=f"{stage} ({rate:.0f} %)")
    axes.set(xlabel="minutes since the start", ylabel="B on unseen houses (%)", ylim=(0, 103))
    axes.legend(frameon=False, fontsize=8)
    figure.savefig(file)


if GIVEN is not None:
    main(GIVEN)
