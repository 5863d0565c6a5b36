"""Makes blind rounds: portraits of things, things in the hand, starts of episodes, pairs of two renderers."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tools.blind import sampling
from tools.blind.drawing import BACKEND, FrameFacts, Job, frame_path
from tools.blind.forms import DrawnBy, RoundKind
from tools.blind.sampling import EpisodeCandidate, PickMoment
from tools.blind.sheets import BlindRound, RoundItem, crop_around
from tools.blind.trees import commit_of, draw_with
from vigil.assets.database import AssetDatabase
from vigil.protocol.observation import Quality
from vigil.sim import make_simulator
from vigil.sim.privileged import PrivilegedSimulator

LEFT_OUT_AT_MOST = 3
"""Starts that an older tree cannot show, for each that is wanted, before its round is given up."""


@dataclass(frozen=True, slots=True)
class DrawnFrame:
    """A frame, and what is true of it; no frame when there is a fault."""

    frame: Image.Image | None
    fact: FrameFacts


def object_round(kind: RoundKind, seed: int, count: int, before: Path | None = None) -> BlindRound:
    """Return a round `near`, `far` or `state`, drawn by the older tree at `before` where one is given."""
    jobs = sampling.portraits(kind, seed, count)
    shown, left_out = [], []
    for job, drawing in zip(jobs, _drawings(before, jobs), strict=True):
        truth = {"category": job.category, "variant": job.variant, "state": job.state}
        if drawing.frame is None or drawing.fact.box_px is None:
            left_out.append({**truth, "why": drawing.fact.fault})
            continue
        picture = crop_around(drawing.frame, drawing.fact.box_px)
        shown.append(RoundItem([picture], {**truth, "span_px": drawing.fact.span_px}))
    return BlindRound(kind, seed, shown, left_out, {"drawn": _name(before), **_older(before)})


def held_round(seed: int, count: int, packs: Sequence[str]) -> BlindRound:
    """Return a round of frames before and after a pick; what is held is what the simulator says.

    Raises PackMismatch, and SystemExit when the packs have too few picks.
    """
    left = iter(sampling.picks(sampling.candidates(packs), seed))
    simulators: dict[Quality, PrivilegedSimulator] = {
        quality: make_simulator(BACKEND, assets=AssetDatabase.default(), quality=quality)
        for quality in sampling.QUALITIES
    }
    shown, left_out = [], []
    try:
        for is_held, quality in sampling.held_cases(count, seed):
            for pick in left:
                frame = _moment(simulators[quality], pick, is_held)
                if frame is not None:
                    shown.append(RoundItem([frame], {**pick.candidate.truth, "quality": quality, "held": is_held}))
                    break
                left_out.append({**pick.candidate.truth, "why": "what is in the hand is not what the solution says"})
    finally:
        for simulator in simulators.values():
            simulator.close()
    _require(len(shown), count, "picks")
    return BlindRound("held", seed, shown, left_out)


def _moment(simulator: PrivilegedSimulator, pick: PickMoment, is_held: bool) -> Image.Image | None:
    """Return the frame before or after a pick; None when the hand does not match."""
    simulator.load(pick.candidate.house)
    simulator.reset(pick.candidate.episode.start, pick.candidate.episode.setup)
    for action in pick.actions if is_held else pick.actions[:-1]:
        simulator.step(action)
    if (simulator.world([]).held is not None) != is_held:
        return None
    return Image.fromarray(simulator.frame())


def start_round(seed: int, count: int, packs: Sequence[str], before: Path | None = None) -> BlindRound:
    """Return the start frames of episodes; with an older tree each drawn by both, all in random order."""
    found = _starts("starts", seed, count, packs, before)
    shown = [
        RoundItem([frame], {**candidate.truth, "drawn": drawn})
        for candidate, frames in found.frames
        for drawn, frame in frames.items()
    ]
    order = np.random.default_rng([seed, 3]).permutation(len(shown))
    return BlindRound("starts", seed, [shown[number] for number in order], found.left_out, _older(before))


def pair_round(seed: int, count: int, packs: Sequence[str], before: Path) -> BlindRound:
    """Return start frames of episodes as an older tree and this one draw them, sides by lot."""
    found = _starts("pairs", seed, count, packs, before)
    shown = []
    for is_older_left, (candidate, frames) in zip(sampling.sides(count, seed), found.frames, strict=True):
        order: tuple[DrawnBy, DrawnBy] = ("before", "after") if is_older_left else ("after", "before")
        shown.append(RoundItem([frames[name] for name in order], {**candidate.truth, "left": order[0]}))
    return BlindRound("pairs", seed, shown, found.left_out, _older(before))


@dataclass(frozen=True, slots=True)
class _Found:
    frames: list[tuple[EpisodeCandidate, dict[DrawnBy, Image.Image]]]
    left_out: list[dict[str, Any]]


def _starts(kind: RoundKind, seed: int, count: int, packs: Sequence[str], before: Path | None) -> _Found:
    """Return `count` starts in random order, each as every tree draws it.

    Starts that the older tree cannot show, or shows only with stand-ins, are left out and replaced by others.
    """
    left = sampling.in_random_order(sampling.candidates(packs), kind, seed)
    found = _Found([], [])
    while missing := count - len(found.frames):
        if len(found.left_out) > LEFT_OUT_AT_MOST * count:
            raise SystemExit(f"Too few of these starts can be shown, for instance: {found.left_out[-1]}. Give --pack.")
        batch = [candidate for _, candidate in zip(range(missing), left, strict=False)]
        _require(len(found.frames) + len(batch), count, "episodes")
        jobs = [candidate.start for candidate in batch]
        older = _drawings(before, jobs) if before else [None] * len(jobs)
        for candidate, now, then in zip(batch, _drawings(None, jobs), older, strict=True):
            why = _fault(now, then)
            if why is not None or now.frame is None:
                found.left_out.append({**candidate.truth, "why": why})
                continue
            frames: dict[DrawnBy, Image.Image] = {"after": now.frame}
            if then is not None and then.frame is not None:
                frames["before"] = then.frame
            found.frames.append((candidate, frames))
    return found


def _fault(now: DrawnFrame, then: DrawnFrame | None) -> str | None:
    """Return why a start is not shown; None when it is shown."""
    if now.fact.fault or then is None:
        return now.fact.fault
    stand_ins = sorted({*then.fact.notes} - {*now.fact.notes})
    return then.fact.fault or "; ".join(stand_ins) or None


def _drawings(tree: Path | None, jobs: Sequence[Job]) -> list[DrawnFrame]:
    with tempfile.TemporaryDirectory() as folder:
        facts = draw_with(tree, jobs, Path(folder))
        return [DrawnFrame(_opened(Path(folder), number, fact), fact) for number, fact in enumerate(facts)]


def _opened(folder: Path, number: int, fact: FrameFacts) -> Image.Image | None:
    if fact.fault:
        return None
    with Image.open(frame_path(folder, number)) as image:
        return image.convert("RGB")


def _name(before: Path | None) -> DrawnBy:
    return "after" if before is None else "before"


def _older(before: Path | None) -> dict[str, Any]:
    return {} if before is None else {"before": commit_of(before)}


def _require(found: int, count: int, what: str) -> None:
    if found < count:
        raise SystemExit(f"Only {found} of {count} {what} are there; give other packs, or ask for fewer.")
