"""Makes the pictures of README.md, docs/readme/*, from the starter pack: `python -m tools.readme_pictures`.

It plays the pack with four agents and one episode with a fifth, into runs/readme, and takes the rest from the commands
`vigil export`, `vigil figure` and `vigil view`. The leaderboard is that of `tools.first_entries`. A second call plays
nothing that is there. Needs Chromium.

The fifth agent says and does what the solver does in a demonstration, but ends with the demonstration's false report:
its words are true up to the last line, in which it gives up on what it has done.
"""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from playwright.sync_api import sync_playwright

import vigil
from tools.web_pictures import command, page_of, save_screenshot, serving
from vigil import Observation, Pack, Profile, Reply
from vigil.authoring.demonstrations.play import Demonstrator
from vigil.authoring.drafting.drafts import Draft, DraftFacts
from vigil.authoring.streaming.stream import StreamItem
from vigil.base.json_lines import dump_line
from vigil.records.record import EPISODES_FILE, FRAMES_FOLDER, RunHeader
from vigil.runner.plan import run_spec
from vigil.runner.run_folder import new_nonce, write_header
from vigil.runner.workers.frames import FrameStore
from vigil.runner.workers.worker import play

ROOT = Path(__file__).parents[1]
OUT, RUNS = ROOT / "docs" / "readme", ROOT / "runs" / "readme"
PACK, EPISODE = "starter", "vigil_dishsponge_seed103"
AGENTS = ("solver", "premature", "never_report", "random")
DOUBTER = "doubter"
VIEWED_STEP = 8
FACTS = DraftFacts(category="", rooms=0, area_m2=0.0, distance_m=0.0, is_seen_by_turning=True)
"""What packs are balanced over; a demonstration takes nothing from it."""


class Doubter:
    """Gives the replies that it was given."""

    name = DOUBTER

    def __init__(self, replies: list[str]) -> None:
        self._all = replies
        self._replies: Iterator[str] = iter(())

    def start(self, instruction: str) -> None:
        """Start with the first reply."""
        del instruction
        self._replies = iter(self._all)

    def act(self, observation: Observation) -> Reply:
        """Return the next reply."""
        del observation
        return Reply(text=next(self._replies))


def doubting_replies(pack: Pack) -> list[str]:
    """Return the replies of the episode's demonstration, with its false report in place of the true one."""
    episode = next(each for each in pack.episodes if each.id == EPISODE)
    draft = Draft(kind="", episode=episode, actions=pack.solutions[EPISODE].actions, facts=FACTS)
    demonstrator = Demonstrator(Profile(), "fast")
    try:
        examples = demonstrator.examples(StreamItem(0, 0, draft, pack.house_of(episode)))
    finally:
        demonstrator.close()
    false = next(each.rejected for each in examples if each.fault == "false_fail")
    assert false is not None
    answers = [each.answer for each in examples if each.fault is None]
    return [*answers[:-1], false]


def play_doubter(pack: Pack) -> None:
    """Play the episode of the moving picture, and write it as a run."""
    folder = RUNS / DOUBTER
    if (folder / EPISODES_FILE).exists():
        return
    profile, now = Profile(), datetime.now(UTC)
    spec = run_spec(pack, profile, agent=DOUBTER, agent_kind="privileged", episode_ids=(EPISODE,))
    episode = next(each for each in pack.episodes if each.id == EPISODE)
    replies = doubting_replies(pack)
    store = FrameStore(folder / FRAMES_FOLDER)
    with vigil.make_env(pack, profile) as env:
        play(episode, env, Doubter(replies), on_reply=lambda observation, _: store.save(observation.rgb))
        record = env.record()
    header = RunHeader(run_id=DOUBTER, nonce=new_nonce(), spec=spec, package_version="", started=now, ended=now)
    write_header(folder, header)
    (folder / EPISODES_FILE).write_bytes(dump_line(header.stamp(record)))


def take_viewer() -> None:
    """Take the episode's page, with its hidden state."""
    with sync_playwright() as playwright, serving("view", str(RUNS)) as base:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        with page_of(browser) as page:
            page.goto(f"{base}/runs/{DOUBTER}/episodes/{EPISODE}/1#step={VIEWED_STEP}&hidden")
            save_screenshot(page, OUT / "viewer.jpg")
        browser.close()


def take_leaderboard(site: Path) -> None:
    """Take the first page of a leaderboard's site."""
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        with page_of(browser, (1280, 1000)) as page:
            page.goto((site / "index.html").absolute().as_uri())
            save_screenshot(page, OUT / "leaderboard.jpg")
        browser.close()


def main() -> None:
    """Make them all."""
    OUT.mkdir(parents=True, exist_ok=True)
    for agent in AGENTS:
        command("run", "--pack", PACK, "--agent", agent, "--log-dir", RUNS / agent)
    play_doubter(vigil.load_pack(PACK))
    command("export", RUNS / DOUBTER, "--episode", EPISODE, "--out", OUT / "episode.webp")
    command("figure", "outcome_partition", *(RUNS / agent for agent in AGENTS), "--out", OUT / "outcomes.png")
    take_viewer()
    entries = RUNS / "leaderboard"
    subprocess.run([sys.executable, "-m", "tools.first_entries", "--out", str(entries)], check=True, cwd=ROOT)
    take_leaderboard(entries / "site")


if __name__ == "__main__":
    main()
