"""The commands and programs of a page are run, in their order, in a folder with runs, houses and a pack.

Runs are played without an engine, and end after a few episodes; models are a server on loopback that looks up and then
reports. What would be served is set up, and not served.
"""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from glob import glob
from pathlib import Path

import pytest

from scripts.markdown_pages import Block
from tests.support.chat_server import LOOK, REPORT, ChatAnswer, serving
from tests.support.commands import Vigil, command_runner
from tests.support.doc_commands import (
    PAGES,
    ROOT,
    SHELL,
    Command,
    Mark,
    blocks_of,
    commands_of,
    is_script,
    marks_of,
    name_of,
)
from tests.support.doc_workspace import write_workspace
from tests.support.inspect_marks import INSPECT
from tests.support.waiting import HANGS_AFTER_S
from vigil.cli import web

pytestmark = INSPECT
SECONDS = HANGS_AFTER_S
"""How long a program of a page may take."""


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_workspace(tmp_path_factory.mktemp("workspace"))


@pytest.fixture(scope="module")
def model_address() -> Iterator[str]:
    with serving(lambda asked: ChatAnswer(REPORT if asked.turn > 1 else LOOK)) as server:
        yield server.url


@pytest.fixture
def vigil(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vigil:
    return command_runner(monkeypatch, capsys)


@pytest.fixture
def folder(prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of what is prepared, as the folder of the commands; no key of a model, and no server that stays."""
    found = tmp_path / "there"
    shutil.copytree(prepared, found, symlinks=True)
    monkeypatch.chdir(found)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), *filter(None, sys.path)]))
    for name in [name for name in os.environ if name.endswith(("_API_KEY", "_BASE_URL", "_TOKEN"))]:
        monkeypatch.delenv(name)
    monkeypatch.setattr(web, "listen", lambda address: socket.socket())
    monkeypatch.setattr(web, "serve", lambda *site: None)
    return found


def is_run(block: Block) -> bool:
    """Whether a block holds something that is run or written here."""
    kinds = {mark.kind for mark in marks_of(block) if not mark.start}
    return (
        block.language in (*SHELL, "python", "json") and not is_script(block) and not kinds & {"parsed only", "run by"}
    )


RUN = {
    name_of(page): page
    for page in PAGES
    if any(is_run(block) and (block.language != "json" or marks_of(block)) for block in blocks_of(page))
}


@pytest.mark.parametrize("name", RUN)
def test_what_a_page_shows_runs(name: str, folder: Path, vigil: Vigil, model_address: str) -> None:
    names = {"__name__": "__main__"}
    for block in filter(is_run, blocks_of(RUN[name])):
        saved = [mark for mark in marks_of(block) if mark.kind == "saved as"]
        for mark in saved:
            (folder / mark.text).write_text(block.text, encoding="utf-8")
        if block.language == "python" and not saved:
            before = "\n" * (block.line - 1)  # so that a traceback names the page's own line
            exec(compile(before + block.text, RUN[name], "exec"), names)
        elif block.language in SHELL:
            for command in commands_of(RUN[name], block):
                if command.is_run:
                    _run(command, vigil, model_address)


def _run(command: Command, vigil: Vigil, model_address: str) -> None:
    words = [found for word in command.words for found in (sorted(glob(word)) or [word])]
    expected = int((command.mark("exits with") or Mark("exits with 0", "", "")).kind.split()[-1])
    if words and words[0] == "vigil":
        said = vigil(*_made_quick(words[1:], model_address))
        assert said.code == expected, f"{command.place}: {command.text}\n{said.out}{said.err}"
    elif words:
        done = subprocess.run(
            [sys.executable, *words[1:]], capture_output=True, text=True, timeout=SECONDS, check=False
        )
        assert done.returncode == expected, f"{command.place}: {command.text}\n{done.stdout}{done.stderr}"


def _made_quick(words: list[str], model_address: str) -> list[str]:
    """Return the words of a command; runs get options that make them short, and diagrams a small pack."""
    if words[:2] == ["figure", "protocol"]:
        return [*words, "--pack", "vigil_smoke"]  # the last one counts
    if words[0] != "run" or "--dry-run" in words:
        return words
    if "--model" in words:
        words = [*words, "--base-url", model_address]  # the last one counts
    short = {"--backend": "fake", "--limit": "2", "--workers": "1"}
    return [*words, *(word for option, value in short.items() if option not in words for word in (option, value))]
