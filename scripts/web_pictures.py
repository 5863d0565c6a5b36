"""Takes the pictures of docs/web.md in headless Chromium.

for agent in solver premature never_report random; do
    vigil run --pack starter --agent $agent --save-frames --log-dir runs/$agent; done
python scripts/web_pictures.py runs docs/web
"""

import argparse
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from vigil.actions import Usage
from vigil.costs import Prices
from vigil.jsonl import AppendFile, dump_line
from vigil.record import EPISODES_FILE, EpisodeRecord, read_header
from vigil.record_file import read_records
from vigil.runner.run_folder import write_header

PORT = 8470
WIDE, PHONE = (1280, 800), (390, 844)
JPEG_QUALITY = 82
PRICES = Prices(input=2.5, output=10)


@contextmanager
def serving(*arguments: str) -> Iterator[str]:
    """Runs a verb of `vigil`; yields its address once it listens."""
    command = [sys.executable, "-c", "from vigil.cli import main; main()", *arguments, "--no-open", "--port", str(PORT)]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        while "Serving" not in (line := server.stdout.readline()):
            if not line:
                raise SystemExit(f"vigil {' '.join(arguments)} ended with {server.wait()}")
        yield f"http://127.0.0.1:{PORT}"
    finally:
        server.terminate()
        server.wait()


@contextmanager
def page_of(browser: Browser, size: tuple[int, int] = WIDE, scheme: str = "light") -> Iterator[Page]:
    """Opens a page of a window's size."""
    viewport = {"width": size[0], "height": size[1]}
    context = browser.new_context(viewport=viewport, color_scheme=scheme)  # type: ignore[arg-type]
    yield context.new_page()
    context.close()


def keep(page: Page, path: Path) -> None:
    """Writes what the window shows."""
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(300)
    Image.open(io.BytesIO(page.screenshot())).convert("RGB").save(path, quality=JPEG_QUALITY)
    print(path)


def take_view(browser: Browser, runs: Path, episode: str, out: Path) -> None:
    """Takes runs, a run, an episode with its hidden state, and a house."""
    path = f"runs/never_report/episodes/{episode}/1#step=4&hidden"
    with serving("view", str(runs)) as base:
        with page_of(browser) as page:
            page.goto(base)
            keep(page, out / "runs.jpg")
            page.goto(f"{base}/runs/random#partition")
            keep(page, out / "run.jpg")
            page.goto(f"{base}/{path}")
            keep(page, out / "episode.jpg")
        with page_of(browser, PHONE, "dark") as page:
            page.goto(f"{base}/{path}")
            keep(page, out / "episode_phone.jpg")
            page.goto(f"{base}/runs/random")
            keep(page, out / "run_phone.jpg")
        with page_of(browser, scheme="dark") as page:
            page.goto(f"{base}/houses/starter/kitchen-living_103")
            page.wait_for_selector("html[data-moves='1']")
            page.keyboard.press("ArrowRight")
            page.wait_for_selector("html[data-moves='2']")
            keep(page, out / "house.jpg")


def as_of_a_model(record: EpisodeRecord) -> EpisodeRecord:
    """Returns a scripted agent's record with tokens that a model might have taken: made up, to show costs."""
    steps = []
    for step in record.steps:
        usage = Usage(input_tokens=2200 + 400 * min(step.index - 1, 20), output_tokens=90)
        steps.append(step.model_copy(update={"reply": step.reply.model_copy(update={"usage": usage})}))
    return record.model_copy(update={"steps": tuple(steps)})


@contextmanager
def going_on(run: Path, rows: int) -> Iterator[Path]:
    """Yields a copy of a run as it was while it was played: its first rows, and its file held by who writes it."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / run.name
        copy.mkdir()
        write_header(copy, read_header(run).model_copy(update={"ended": None, "prices": PRICES}))
        with AppendFile(copy / EPISODES_FILE) as file:
            file.append(*(dump_line(as_of_a_model(record)) for record in read_records(run / EPISODES_FILE)[:rows]))
            yield copy


def take_going(browser: Browser, runs: Path, out: Path) -> None:
    """Takes a run that goes on, with its costs."""
    with going_on(runs / "random", 53) as run, serving("view", str(run)) as base:
        for name, size, scheme in (("following", WIDE, "light"), ("following_phone", PHONE, "dark")):
            with page_of(browser, size, scheme) as page:
                page.goto(f"{base}/runs/random")
                keep(page, out / f"{name}.jpg")


def take_packs(browser: Browser, out: Path) -> None:
    """Takes the strata of a pack, and its first frames."""
    with serving("view", "--pack", "starter") as base, page_of(browser) as page:
        page.goto(f"{base}/packs/vigil_mini_v1_2")
        keep(page, out / "pack.jpg")
        page.goto(f"{base}/packs/starter#samples")
        keep(page, out / "pack_frames.jpg")


def take_play(browser: Browser, out: Path) -> None:
    """Takes a person's play: the menu of intents."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("--player", "ada", "--limit", "3", "--family", "SM", "--log-dir", f"{folder}/run")
        with serving("play", *arguments) as base, page_of(browser) as page:
            page.goto(base)
            page.wait_for_selector("html[data-answers='1']")
            page.keyboard.press("Enter")
            page.wait_for_selector("html[data-answers='2']")
            page.click("#picture", position={"x": 402, "y": 228})
            keep(page, out / "play.jpg")


def take_review(browser: Browser, episode: str, out: Path) -> None:
    """Takes the auditor's page."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("--reviewer", "ada", "--file", f"{folder}/reviews.jsonl")
        with serving("review", *arguments) as base, page_of(browser) as page:
            page.goto(f"{base}/episodes/{episode}")
            page.keyboard.press("ArrowRight")
            keep(page, out / "review.jpg")


def main() -> None:
    """Takes them all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, help="folder of the four runs")
    parser.add_argument("out", type=Path)
    parser.add_argument("--episode", default="vigil_dresser_seed106", help="of the starter pack")
    given = parser.parse_args()
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        take_view(browser, given.runs, given.episode, given.out)
        take_going(browser, given.runs, given.out)
        take_packs(browser, given.out)
        take_play(browser, given.out)
        take_review(browser, given.episode, given.out)
        browser.close()


if __name__ == "__main__":
    main()
