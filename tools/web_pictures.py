"""Takes the pictures of docs/web.md, docs/web/*, in headless Chromium: `python -m tools.web_pictures`.

It plays the starter pack with four agents, into runs/web, and shows those runs. A second call plays nothing that is
there.
"""

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

from vigil.base.json_lines import AppendFile, dump_line
from vigil.protocol.actions import Usage
from vigil.records.costs import Prices
from vigil.records.record import EPISODES_FILE, EpisodeRecord, read_header
from vigil.records.record_file import read_records
from vigil.runner.run_folder import write_header

ROOT = Path(__file__).parents[1]
OUT, RUNS = ROOT / "docs" / "web", ROOT / "runs" / "web"
AGENTS = ("solver", "premature", "never_report", "random")
EPISODE = "vigil_desklamp_seed106"
MICROWAVE_XY = (350, 150)
"""Where the picture of a person's play shows what the task is about."""
PORT = 8470
PATIENCE_MS = 120_000
"""Longest wait (ms) for a page: one that draws an episode's frames again is slow on a busy machine."""
WIDE, PHONE = (1280, 800), (390, 844)
JPEG_QUALITY = 82
PRICES = Prices(input=2.5, output=10)


def command(*arguments: str | Path) -> None:
    """Run a verb of `vigil`."""
    main = "from vigil.cli import main; main()"
    subprocess.run([sys.executable, "-c", main, *map(str, arguments)], check=True)


@contextmanager
def serving(*arguments: str) -> Iterator[str]:
    """Run a verb of `vigil`; yield its address once it listens."""
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
    """Open a page of a window's size."""
    viewport = {"width": size[0], "height": size[1]}
    context = browser.new_context(viewport=viewport, color_scheme=scheme)  # type: ignore[arg-type]
    context.set_default_timeout(PATIENCE_MS)
    yield context.new_page()
    context.close()


def save_screenshot(page: Page, path: Path) -> None:
    """Write what the window shows."""
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(300)
    Image.open(io.BytesIO(page.screenshot())).convert("RGB").save(path, quality=JPEG_QUALITY)
    print(path)


def take_view(browser: Browser) -> None:
    """Take runs, a run, an episode with its hidden state, and a house."""
    path = f"runs/never_report/episodes/{EPISODE}/1#step=4&hidden"
    with serving("view", str(RUNS)) as base:
        with page_of(browser) as page:
            page.goto(base)
            save_screenshot(page, OUT / "runs.jpg")
            page.goto(f"{base}/runs/random#partition")
            save_screenshot(page, OUT / "run.jpg")
            page.goto(f"{base}/{path}")
            save_screenshot(page, OUT / "episode.jpg")
        with page_of(browser, PHONE, "dark") as page:
            page.goto(f"{base}/{path}")
            save_screenshot(page, OUT / "episode_phone.jpg")
            page.goto(f"{base}/runs/random")
            save_screenshot(page, OUT / "run_phone.jpg")
        with page_of(browser, scheme="dark") as page:
            page.goto(f"{base}/houses/starter/kitchen-living_103")
            page.wait_for_selector("html[data-moves='1']")
            page.keyboard.press("ArrowRight")
            page.wait_for_selector("html[data-moves='2']")
            save_screenshot(page, OUT / "house.jpg")


def with_invented_usage(record: EpisodeRecord) -> EpisodeRecord:
    """Return a scripted agent's record with tokens that a model might have taken: made up, to show costs."""
    steps = []
    for step in record.steps:
        usage = Usage(input_tokens=2200 + 400 * min(step.index - 1, 20), output_tokens=90)
        steps.append(step.model_copy(update={"reply": step.reply.model_copy(update={"usage": usage})}))
    return record.model_copy(update={"steps": tuple(steps)})


@contextmanager
def unfinished_run(run: Path, rows: int) -> Iterator[Path]:
    """Yield a copy of a run as it was while it was played: its first rows, and its file held by who writes it."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / run.name
        copy.mkdir()
        write_header(copy, read_header(run).model_copy(update={"ended": None, "prices": PRICES}))
        with AppendFile(copy / EPISODES_FILE) as file:
            file.append(
                *(dump_line(with_invented_usage(record)) for record in read_records(run / EPISODES_FILE)[:rows])
            )
            yield copy


def take_unfinished_run(browser: Browser) -> None:
    """Take a run that goes on, with its costs."""
    with unfinished_run(RUNS / "random", 53) as run, serving("view", str(run)) as base:
        for name, size, scheme in (("following", WIDE, "light"), ("following_phone", PHONE, "dark")):
            with page_of(browser, size, scheme) as page:
                page.goto(f"{base}/runs/random")
                save_screenshot(page, OUT / f"{name}.jpg")


def take_packs(browser: Browser) -> None:
    """Take the strata of a pack, and its first frames."""
    with serving("view", "--pack", "starter") as base, page_of(browser) as page:
        page.goto(f"{base}/packs/vigil_mini_v6")
        save_screenshot(page, OUT / "pack.jpg")
        page.goto(f"{base}/packs/starter#samples")
        save_screenshot(page, OUT / "pack_frames.jpg")


def take_play(browser: Browser) -> None:
    """Take a person's play: the menu of intents."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("--player", "ada", "--limit", "3", "--family", "SM", "--log-dir", f"{folder}/run")
        with serving("play", *arguments) as base, page_of(browser) as page:
            page.goto(base)
            page.wait_for_selector("html[data-answers='1']")
            page.keyboard.press("Enter")
            page.wait_for_selector("html[data-answers='2']")
            page.click("#picture", position={"x": MICROWAVE_XY[0], "y": MICROWAVE_XY[1]})
            save_screenshot(page, OUT / "play.jpg")


def take_review(browser: Browser) -> None:
    """Take the auditor's page."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("--reviewer", "ada", "--file", f"{folder}/reviews.jsonl")
        with serving("review", *arguments) as base, page_of(browser) as page:
            page.goto(f"{base}/episodes/{EPISODE}")
            page.keyboard.press("ArrowRight")
            save_screenshot(page, OUT / "review.jpg")


def main() -> None:
    """Take them all."""
    OUT.mkdir(parents=True, exist_ok=True)
    for agent in AGENTS:
        command("run", "--pack", "starter", "--agent", agent, "--save-frames", "--log-dir", RUNS / agent)
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        take_view(browser)
        take_unfinished_run(browser)
        take_packs(browser)
        take_play(browser)
        take_review(browser)
        browser.close()


if __name__ == "__main__":
    main()
