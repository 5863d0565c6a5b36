"""The pages in a real browser: a run of 1,000 episodes opened, a step changed, a played step.

    vigil run --pack vigil_balanced_1000 --agent sweep --log-dir runs/sweep1000
    vigil run --pack starter --agent never_report --save-frames --log-dir runs/saved
    python -m benchmarks.web runs/sweep1000 runs/saved

Each time is what a person waits for: from the key or the address until the new picture is decoded and painted.
"""

import argparse
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
from playwright.sync_api import Browser, Page, sync_playwright

REPEATS = 5
PORT = 8460
KEY = """async (key) => {
  const begun = performance.now();
  document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  await document.getElementById("picture").decode();
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  return performance.now() - begun;
}"""
PLAYED = """async (key) => {
  const picture = document.getElementById("picture");
  const begun = performance.now();
  const changed = new Promise((done) => picture.addEventListener("load", done, { once: true }));
  document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  await changed;
  await picture.decode();
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  return performance.now() - begun;
}"""


@contextmanager
def serving(*arguments: str) -> Iterator[str]:
    """A `vigil` server of its own process; yield its address once it listens."""
    command = [sys.executable, "-c", "from vigil.cli import main; main()", *arguments, "--no-open", "--port", str(PORT)]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        while "Serving" not in server.stdout.readline():
            if server.poll() is not None:
                raise SystemExit(f"{' '.join(arguments)} ended with {server.returncode}")
        yield f"http://127.0.0.1:{PORT}"
    finally:
        server.terminate()
        server.wait()


def seconds(url: str) -> float:
    begun = time.perf_counter()
    with urllib.request.urlopen(url) as answer:
        answer.read()
    return time.perf_counter() - begun


def opened(page: Page, url: str) -> float:
    """Return how long a page takes to load and to be laid out, seconds."""
    begun = time.perf_counter()
    page.goto(url, wait_until="load")
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    return time.perf_counter() - begun


def print_times(what: str, times: list[float], unit: str, bound: float) -> None:
    figures = f"best {min(times):7.3g}  median {statistics.median(times):7.3g}  worst {max(times):7.3g}"
    print(f"{what:<48} {figures} {unit}  (bound {bound:g} {unit})", flush=True)


def open_run(browser: Browser, run: Path) -> None:
    cold, table, warm = [], [], []
    for _ in range(REPEATS):
        with serving("view", str(run)) as base:
            page = browser.new_page()
            cold.append(opened(page, f"{base}/runs/{run.name}"))
            table.append(seconds(f"{base}/"))
            warm.append(opened(page, f"{base}/runs/{run.name}"))
            page.close()
    print_times("run opened, nothing read before", cold, "s", 1.0)
    print_times("run opened again", warm, "s", 1.0)
    print_times("table of runs", table, "s", 1.0)


def change_steps(browser: Browser, run: Path) -> None:
    with serving("view", str(run)) as base:
        page = browser.new_page()
        page.goto(f"{base}/runs/{run.name}")
        links = page.locator(".episodes tbody a").evaluate_all("links => links.map((link) => link.href)")
        nexts, jumps = [], []
        for link in links[:10]:
            page.goto(link)
            page.wait_for_load_state("networkidle")
            jumps.append(page.evaluate(KEY, "End"))
            page.evaluate(KEY, "Home")
            for _ in range(5):
                nexts.append(page.evaluate(KEY, "ArrowRight"))
                page.wait_for_timeout(100)
        page.close()
    print_times("next step, saved frames", nexts, "ms", 100)
    print_times("jump to a step not yet loaded, saved frames", jumps, "ms", 100)


def play_steps(browser: Browser, pack: str) -> None:
    times, first = [], []
    with (
        tempfile.TemporaryDirectory() as folder,
        serving("play", "--player", "bench", "--pack", pack, "--limit", "5", "--log-dir", f"{folder}/run") as base,
    ):
        page = browser.new_page()
        page.goto(base)
        page.wait_for_selector("html[data-answers='1']")
        for _ in range(3):
            begun = time.perf_counter()
            answers = page.evaluate("document.documentElement.dataset.answers")
            page.keyboard.press("Enter")
            page.wait_for_function("(old) => document.documentElement.dataset.answers !== old", arg=answers)
            first.append(1000 * (time.perf_counter() - begun))
            times += [page.evaluate(PLAYED, key) for key in ("ArrowLeft", "ArrowRight", "f")]
            page.keyboard.press("e")
            page.keyboard.press(" ")
            answers = page.evaluate("document.documentElement.dataset.answers")
            page.click("#report-form button[type=submit]")
            page.wait_for_function("(old) => document.documentElement.dataset.answers !== old", arg=answers)
        page.close()
    print_times(f"played step, {pack}", times, "ms", 250)
    print(f"{'(an episode begun: house loaded, first picture)':<48} {', '.join(f'{each:.0f}' for each in first)} ms")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("thousand", type=Path, help="a run of 1,000 episodes")
    parser.add_argument("saved", type=Path, help="a run with saved frames")
    parser.add_argument("--pack", default="vigil_balanced_1000", help="what is played")
    arguments = parser.parse_args()
    print(f"load average at the start: {psutil.getloadavg()[0]:.1f}")
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        open_run(browser, arguments.thousand)
        change_steps(browser, arguments.saved)
        play_steps(browser, arguments.pack)
        browser.close()


if __name__ == "__main__":
    main()
