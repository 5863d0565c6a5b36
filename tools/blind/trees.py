"""Draws with this tree, or with an older one in a process of its own."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

from pydantic import TypeAdapter

from tools.blind import drawing
from tools.blind.drawing import FACTS, FrameFacts, Job
from vigil.sim.pictures import object_renders

PORTRAIT = Path("vigil", "sim", "pictures", "object_renders.py")


def draw_with(tree: Path | None, jobs: Sequence[Job], folder: Path) -> list[FrameFacts]:
    """Write the frame of each job to `folder`, drawn by the source tree at `tree`, or by this one.

    Raises SystemExit when `tree` holds no source or cannot draw at all.
    """
    if tree is None:
        return drawing.draw(jobs, folder)
    folder.mkdir(parents=True, exist_ok=True)
    with _prepared_source(tree) as source:
        asked = folder / "jobs.json"
        asked.write_text(json.dumps([asdict(job) for job in jobs]), encoding="utf-8")
        words = [sys.executable, drawing.__file__, str(asked), str(folder)]
        done = subprocess.run(words, env={**os.environ, "PYTHONPATH": str(source)}, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"The tree at {str(tree)!r} cannot draw:\n{done.stderr}")
    return TypeAdapter(list[FrameFacts]).validate_json((folder / FACTS).read_bytes())


@contextmanager
def _prepared_source(tree: Path) -> Iterator[Path]:
    """Give a copy of a tree's source for a while, which takes portraits as this tree does: from the same poses."""
    source = tree / "src"
    if not (source / PORTRAIT).is_file():
        raise SystemExit(
            f"There is no {str(source / PORTRAIT)!r}. Give the root of a checkout, as `git worktree add` makes it."
        )
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "src"
        shutil.copytree(source, copy, ignore=shutil.ignore_patterns("data", "__pycache__"))
        shutil.copy(object_renders.__file__, copy / PORTRAIT)
        yield copy


def commit_of(tree: Path) -> str:
    """Return the commit of a source tree; its folder's name when it is none of git's."""
    words = ["git", "-C", str(tree), "rev-parse", "HEAD"]
    done = subprocess.run(words, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else tree.resolve().name
