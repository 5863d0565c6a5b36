"""Builds the wheel and the source distribution into dist/, and plays from the wheel in empty environments.

    python scripts/release_check.py python3.11 python3.12 python3.13     (make release-check)

For each interpreter that is there, once with the lowest versions of the direct dependencies that pyproject.toml
allows and once with the newest of all: packages come from the index, nothing from this checkout. Interpreters that
do not start are named and left out. Needs `uv`. What is played is shown with its time; the first fault ends it.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

ROOT = Path(__file__).parents[1]
RESOLUTIONS = ("lowest-direct", "highest")
MODEL = "openai/stand-in"
EVALUATED = "from inspect_ai.log import *; assert read_eval_log(list_eval_logs('logs')[0]).status == 'success'"
"""Inspect ends with 0 whatever came of the evaluation."""
REPLY = {"action": {"skill_name": "report", "skill_params": {"status": "success"}}}
COMMANDS = (
    ["vigil", "--version"],
    ["vigil", "run", "--pack", "vigil_smoke", "--agent", "solver", "--log-dir", "run"],
    ["vigil", "verify", "run"],
    ["vigil", "report", "run", "--out", "report"],
    ["vigil", "export", "run", "--out", "site"],
    ["vigil", "pack", "info", "starter"],
    ["vigil", "houses", "generate", "--seed", "1", "--rooms", "2", "--out", "house.json"],
    ["vigil", "houses", "show", "house.json", "--out", "house.png"],
    ["vigil", "run", "--pack", "vigil_smoke", "--model", "openai/gpt-4o", "--dry-run"],
    ["inspect", "eval", "vigil/vigil", "--model", MODEL, "-T", "preflight=false", "--limit", "1", "--display", "none"],
    ["python", "-c", EVALUATED],
)


def main() -> None:
    """Read the command line, build, and check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pythons", nargs="+", metavar="PYTHON")
    parser.add_argument("--resolution", choices=RESOLUTIONS, action="append", help="Both without it.")
    parser.add_argument("--keep", type=Path, help="Where the environments are made and stay, for looking into them.")
    given = parser.parse_args()
    wheel = build()
    os.environ["OPENAI_BASE_URL"], os.environ["OPENAI_API_KEY"] = serve_stand_in(), "none"
    there = {python: found for python in given.pythons if (found := interpreter(python))}
    for python in sorted(set(given.pythons) - there.keys()):
        print(f"{python} does not start and is left out.")
    if not there:
        sys.exit("None of the interpreters starts. Name one by its path, such as /usr/bin/python3.11.")
    for python in there.values():
        for resolution in given.resolution or RESOLUTIONS:
            with tempfile.TemporaryDirectory() as folder:
                check(
                    wheel,
                    python,
                    resolution,
                    given.keep / f"{Path(python).name}-{resolution}" if given.keep else Path(folder),
                )


class ScriptedSimulator(BaseHTTPRequestHandler):
    """Answers each request for a chat completion with the same report."""

    def do_POST(self) -> None:
        """Answer."""
        self.rfile.read(int(self.headers["Content-Length"]))
        message = {"role": "assistant", "content": json.dumps(REPLY)}
        choice = {"index": 0, "finish_reason": "stop", "message": message}
        answer = {"id": "1", "object": "chat.completion", "created": 0, "model": "stand-in", "choices": [choice]}
        body = json.dumps(answer).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of requests."""


def serve_stand_in() -> str:
    """Serve a stand-in for a model until this process ends. Return its address."""
    server = HTTPServer(("127.0.0.1", 0), ScriptedSimulator)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/v1"


def interpreter(name: str) -> str | None:
    """Return the path of an interpreter; None when it does not start, as a version manager's stand-in does not."""
    if shutil.which(name) is None:
        return None
    words = [name, "-c", "import sys; print(sys.executable)"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else None


def build() -> Path:
    """Build both distributions, the wheel from the other. Return the wheel."""
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    uv("build", "--quiet", "--out-dir", str(ROOT / "dist"), str(ROOT))
    (wheel,) = (ROOT / "dist").glob("*.whl")
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
    return wheel


def check(wheel: Path, python: str, resolution: str, folder: Path) -> None:
    """Install the wheel into a new environment in a folder and play there."""
    print(f"{python}, {resolution} versions")
    environment, place = folder / "venv", folder / "work"
    place.mkdir(parents=True)
    began = time.perf_counter()
    uv("venv", "--quiet", "--python", python, str(environment))
    uv("pip", "install", "--quiet", "--python", str(environment), "--resolution", resolution, str(wheel))
    print(f"  installed in {time.perf_counter() - began:.0f} s")
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    for words in COMMANDS:
        began = time.perf_counter()
        program = environment / "bin" / words[0]
        done = subprocess.run([program, *words[1:]], cwd=place, env=clean, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{' '.join(words)}: ended with {done.returncode}\n{done.stdout}{done.stderr}")
        print(f"  {time.perf_counter() - began:5.1f} s  {' '.join(words)}")


def uv(*words: str) -> None:
    """Call uv: the one beside this interpreter, else the one on PATH."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    program = shutil.which("uv", path=path)
    if program is None:
        sys.exit("uv is not installed: `make release-check` installs it; by hand, `pip install uv`.")
    done = subprocess.run([program, *words], check=False)
    if done.returncode:
        sys.exit(f"uv {' '.join(words)} ended with {done.returncode}.")


if __name__ == "__main__":
    main()
