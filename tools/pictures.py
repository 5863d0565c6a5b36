"""Writes docs/gallery.md, and draws its pictures of the starter pack: `python -m tools.pictures`.

The other pictures of the gallery are drawn by the commands that the page names.
"""

from pathlib import Path

import numpy as np
from PIL import Image

from vigil.assets.database import AssetDatabase
from vigil.authoring.solving.primitive_actions import reply_of
from vigil.env import Env
from vigil.packs.pack import Pack
from vigil.protocol.actions import Action, InteractPixel
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES
from vigil.protocol.profile import Profile
from vigil.sim import make_simulator

OUT = Path(__file__).parents[1] / "docs"
FOLDER = OUT / "pictures"
QUALITY = 88
TRIED = 8
EDGE = 20
"""Least difference in brightness (of 255) between neighbouring pixels on an edge."""
CATALOG = (
    "<!-- parsed only: draws for minutes -->\n"
    "```sh\nvigil render --catalog --variants 1 --out docs/pictures/catalog\n```"
)
SHEET = (
    "<!-- parsed only: draws for minutes -->\n"
    "```sh\nvigil pack sheet vigil_balanced_1000 --count 80 --out docs/packs\n```"
)
CHANGES = ("open_access", "close_access", "activate", "deactivate", "pick", "place")


def main() -> None:
    """Write docs/gallery.md and docs/pictures."""
    pack = Pack.load("starter")
    env = Env(make_simulator("mujoco", assets=AssetDatabase.default()), pack.house_of, Profile())
    FOLDER.mkdir(parents=True, exist_ok=True)
    lines = [
        "# Gallery",
        "",
        "This page shows episodes, states, objects and houses. It names the command that made each picture; `make "
        "pictures` makes all of them.",
        "",
        "## Where an episode of each family starts",
        "",
        "For each family of tasks, this section shows the instruction and the first frame of one episode of the "
        "starter pack. An agent sees exactly the same frame. `python -m tools.pictures` draws these pictures. Some "
        f"episodes start in front of a wall. So the command looks at the first {TRIED} episodes of each family, and "
        "draws the one whose frame shows the most.",
        "",
    ]
    for family, spec in FAMILIES.items():
        episode, frame = _fullest_start(pack, env, family)
        Image.fromarray(frame).save(FOLDER / f"start_{family}.jpg", quality=QUALITY)
        lines += [
            f"**{family}, {spec.name}.** Instruction: *{episode.instruction}*",
            "",
            f"![The first frame of an episode of {spec.name}](pictures/start_{family}.jpg)",
            "",
        ]
    lines += [
        "## What interactions change",
        "",
        "Each picture shows two frames: one before and one after an action of a recorded solution. `python -m "
        "tools.pictures` draws these pictures too.",
        "",
    ]
    for intent in CHANGES:
        episode, before, after = _clearest(pack, env, intent)
        pair = Image.new("RGB", (1290, 480), "white")
        pair.paste(Image.fromarray(before), (0, 0))
        pair.paste(Image.fromarray(after), (650, 0))
        pair.save(FOLDER / f"change_{intent}.jpg", quality=QUALITY)
        lines += [
            f"**`{intent}`**, in the episode with the instruction: *{episode.instruction}*",
            "",
            f"![Before and after {intent}](pictures/change_{intent}.jpg)",
            "",
        ]
    lines += _other_sections()
    (OUT / "gallery.md").write_text("\n".join(lines).rstrip() + "\n")


def _other_sections() -> list[str]:
    """Return the part of the page whose pictures other commands draw."""
    lines = [
        "## Objects",
        "",
        "These pictures show one variant of each category, in each of its states ([assets](assets.md)):",
        "",
        CATALOG,
        "",
    ]
    lines += [
        f"![Catalogue, part {path.stem[-1]}](pictures/catalog/{path.name})" for path in _files("pictures/catalog")
    ]
    lines += [
        "",
        "## Houses",
        "",
        "Each picture shows the house that is generated from a seed ([houses](houses.md)); `python -m "
        "tools.house_pictures` makes them.",
        "",
    ]
    for path in _files("houses", "*_plan.jpg"):
        *kind, seed, _ = path.stem.split("_")
        lines += [f"**`--rooms {kind[0]} --seed {seed}`**", "", f"![Plan and bird's-eye view](houses/{path.name})", ""]
    lines += [
        "## Packs",
        "",
        "These sheets show ten episodes of each family with their first frames "
        "([packs](packs.md#eighty-of-the-thousand)).",
        "",
        SHEET,
        "",
    ]
    lines += [f"[{family}](packs/{family}.webp)" + " ·" * (family != "CR") for family in FAMILIES]
    lines += ["", "![Ten episodes of Approach and Interact](packs/AI.webp)", "", "## Endings", ""]
    lines += [
        "[Concepts](concepts.md) shows how episodes end; `python -m tools.concepts` makes its pictures.",
        "",
        "## Pages",
        "",
    ]
    return [
        *lines,
        "[The pages](web.md) has pictures of the web pages; `python -m tools.web_pictures` makes them.",
        "",
    ]


def _files(folder: str, pattern: str = "*.jpg") -> list[Path]:
    return sorted((OUT / folder).glob(pattern))


def _fullest_start(pack: Pack, env: Env, family: str) -> tuple[Episode, np.ndarray]:
    """Return the episode, among the family's first, whose start frame has most edges, with that frame."""
    found = []
    for episode in [episode for episode in pack.episodes if episode.family == family][:TRIED]:
        observation = env.reset(episode)
        assert observation is not None
        brightness = observation.rgb.astype(int).mean(axis=2)
        edges = np.abs(np.diff(brightness, axis=1)) > EDGE
        found.append((int(edges.sum()), episode, observation.rgb))
    return max(found, key=lambda example: example[0])[1:]


def _clearest(pack: Pack, env: Env, intent: str) -> tuple[Episode, np.ndarray, np.ndarray]:
    """Return the episode, among the first with that intent, in which the frame changes most, with its two frames."""
    found = []
    for episode in pack.episodes:
        actions = pack.solutions[episode.id].actions
        if any(_has(action, intent) for action in actions):
            before, after = _frames_around(env, episode, actions, intent)
            found.append((int((np.abs(before.astype(int) - after).max(axis=2) > 30).sum()), episode, before, after))
        if len(found) == TRIED:
            break
    if not found:
        raise SystemExit(f"No solution of pack {pack.name!r} has an action of intent {intent!r}.")
    return max(found, key=lambda example: example[0])[1:]


def _frames_around(
    env: Env, episode: Episode, actions: tuple[Action, ...], intent: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames before and after the first action of that intent."""
    observation = env.reset(episode)
    for action in actions:
        assert observation is not None
        before = observation.rgb if _has(action, intent) else None
        observation = env.step(reply_of(action))
        if before is not None:
            assert observation is not None
            return before, observation.rgb
    raise SystemExit(f"Episode {episode.id!r}: its solution has no action of intent {intent!r}.")


def _has(action: Action, intent: str) -> bool:
    return isinstance(action, InteractPixel) and action.intent == intent


if __name__ == "__main__":
    main()
