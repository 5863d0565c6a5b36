"""Draws what a blind round shows, with the `vigil` that Python finds: this tree's, or in another process an older one.

    python tools/blind/drawing.py JOBS.json FOLDER

JOBS.json is a list of jobs. FOLDER gets the frame of each (640 x 480, PNG), named by its number from 0, and
`facts.json`, a list of what is true of each. Nothing but `vigil` is imported, and of that what older versions have too.
"""

import json
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from PIL import Image
from pydantic import TypeAdapter

from vigil.assets.database import AssetDatabase
from vigil.base.geometry import Pose
from vigil.errors import VigilError
from vigil.protocol.house import House
from vigil.protocol.observation import FRAME_HEIGHT, FRAME_WIDTH
from vigil.protocol.world import Setup
from vigil.sim import make_simulator
from vigil.sim.pictures.object_renders import render_with_placement
from vigil.sim.pictures.staged_scenes import SceneSubject, State
from vigil.sim.privileged import PrivilegedSimulator

FACTS = "facts.json"
BACKEND = "mujoco"
FRAME_PX = (FRAME_WIDTH, FRAME_HEIGHT)


@dataclass(frozen=True, slots=True)
class Portrait:
    """One thing where such things stand."""

    category: str
    variant: int
    state: State | None
    seed: int
    distance_m: float | None
    """Distance from the eye to the thing; None for the one at which the thing spans about 120 pixels."""
    kind: Literal["portrait"] = "portrait"


@dataclass(frozen=True, slots=True)
class StartView:
    """The start of an episode as an agent sees it."""

    house: str
    """Path of the pack's file."""
    start: dict[str, Any]
    setup: dict[str, Any]
    kind: Literal["start"] = "start"


Job = Portrait | StartView


@dataclass(frozen=True, slots=True)
class FrameFacts:
    """Facts about a frame."""

    box_px: tuple[float, float, float, float] | None = None
    """Left, top, right and bottom of a portrait's thing, as far as it is in the frame."""
    span_px: int | None = None
    """The longer side of that thing's box."""
    fault: str | None = None
    """Reason for a missing frame."""
    notes: list[str] = field(default_factory=list)
    """Assets of the house that this tree replaces by stand-ins."""


def draw(jobs: Iterable[Job], folder: Path) -> list[FrameFacts]:
    """Write the frame of each job to `folder`. Return facts about them, faults included."""
    folder.mkdir(parents=True, exist_ok=True)
    numbered = list(enumerate(jobs))
    facts: dict[int, FrameFacts] = {}
    pen = _Pen(make_simulator(BACKEND, assets=AssetDatabase.default()))
    try:
        for number, job in sorted(numbered, key=lambda each: each[1].house if isinstance(each[1], StartView) else ""):
            facts[number] = pen.drawn(job, frame_path(folder, number))
    finally:
        pen.simulator.close()
    return [facts[number] for number, _ in numbered]


def frame_path(folder: Path, number: int) -> Path:
    """Return where the frame of a job is written to."""
    return folder / f"{number:04}.png"


@dataclass(slots=True)
class _Pen:
    """Draws jobs one after another; a house stays loaded while jobs ask for it."""

    simulator: PrivilegedSimulator
    house: str | None = None

    def drawn(self, job: Job, path: Path) -> FrameFacts:
        """Write a job's frame, and return what is true of it, or why there is none."""
        try:
            return _portrait(job, path) if isinstance(job, Portrait) else self._start(job, path)
        except (VigilError, ValueError, KeyError) as error:
            self.house = None
            return FrameFacts(fault=f"{type(error).__name__}: {error}")

    def _start(self, job: StartView, path: Path) -> FrameFacts:
        if job.house != self.house:
            self.simulator.load(House.load(Path(job.house)))
            self.house = job.house
        self.simulator.reset(Pose.model_validate(job.start), Setup.model_validate(job.setup))
        Image.fromarray(self.simulator.frame()).save(path)
        return FrameFacts(notes=[str(note) for note in self.simulator.scene().notes])


def _portrait(job: Portrait, path: Path) -> FrameFacts:
    picture, view = render_with_placement(
        SceneSubject(job.category, job.variant, job.state), job.seed, job.distance_m, "default"
    )
    Image.fromarray(picture).save(path)
    left, top, right, bottom = np.clip(view.box_px, 0.0, np.tile(FRAME_PX, 2)).tolist()
    return FrameFacts(
        box_px=(left, top, right, bottom), span_px=round(view.span_px) if np.isfinite(view.span_px) else None
    )


def main() -> None:
    """Read the jobs and write their frames and facts."""
    jobs, folder = Path(sys.argv[1]), Path(sys.argv[2])
    read = TypeAdapter(list[Job]).validate_json(jobs.read_bytes())
    facts = draw(read, folder)
    (folder / FACTS).write_text(json.dumps([asdict(fact) for fact in facts]), encoding="utf-8")


if __name__ == "__main__":
    main()
