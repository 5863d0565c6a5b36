"""Figures in reports that show frames: trajectories, the pipeline of an episode, and the diagram of the protocol."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vigil.analysis.measures.rows import Run
from vigil.analysis.measures.study import Study
from vigil.analysis.plots.diagrams import (
    CONTRACT,
    SKIPPED_WORDS,
    FamilyExample,
    limits,
    pipeline_figure,
    protocol_figure,
)
from vigil.analysis.plots.style import paper_width_in
from vigil.analysis.plots.trajectory import AgentTrajectory, find_record, make_trajectory, trajectory_figure
from vigil.analysis.tables.paper_captions import PRIVILEGED_MARK
from vigil.analysis.tables.text import MARKS
from vigil.errors import RecordError, SettingError, did_you_mean
from vigil.packs.pack import Pack
from vigil.packs.private import check_revealed, is_private
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.protocol.observation import Observation
from vigil.runner.workers.frames import first_frames, frames_of_record
from vigil.scoring.saved_run import load_run_pack, pack_folder

FrameSource = tuple[Path | None, bool]
"""Asset database with which frames are drawn, and whether frames of a private pack may be drawn."""
CaptionedFigure = tuple[Figure, str]
_MOST_EXAMPLES = 10
"""Number of episodes of a family that are tried for the diagram, which shows one of them."""
_DETAIL = 1.5
"""A frame without its target shows more than a wall if the mean difference of neighbouring pixels is at least this."""
_TARGET_PX = 20_000
"""A target's state can be seen in print if the box around the target has at least this area (pixels)."""
_MOST_ROWS = 4
"""Maximum number of runs in a trajectory figure of a study."""
_SHOWN_FAMILIES: tuple[Family, ...] = ("SV", "AI")
"""Families for which a study shows the trajectories of one episode, as the paper does."""


def framed_figures(
    found: Study, pack: str | Path | None, episodes: Sequence[str], diagram: bool, frames: FrameSource
) -> dict[str, CaptionedFigure]:
    """Return the figures that need frames, with their captions. Each shows all runs that played the episode."""
    drawn: dict[str, CaptionedFigure] = {}
    for number, episode_id in enumerate(episodes, start=1):
        having = _having(found.runs, episode_id)
        drawn |= _of_episode(having, pack, episode_id, (f"trajectory_{number}", f"pipeline_{number}"), frames)
    if diagram and not found.runs:
        raise SettingError(
            "--diagram shows the eight families, but none of these runs is on a pack of the families. Add a run that "
            "is, or leave out --diagram."
        )
    if diagram:
        place = str(pack_folder(found.runs[0].header, pack))
        drawn["protocol"] = _captioned_protocol(place, frames)
    return drawn


def study_figures(found: Study, episodes: Sequence[str], frames: FrameSource) -> dict[str, CaptionedFigure]:
    """Return the paper's figures that need frames, for the main runs: protocol, pipeline, and two trajectories.

    Without `episodes`, the trajectories are of one episode of SV and one of AI, each played by most of the main runs.
    """
    shown = [entry.run for entry in found.shown_runs() if entry.run.n]
    anchors = [run for run in shown if run.label is not None and run.label.is_anchor] or shown
    if not anchors:
        return {}
    place = str(pack_folder(anchors[0].header))
    drawn = {"protocol": _captioned_protocol(place, frames)}
    for episode_id in episodes or _common_episodes(anchors):
        having = _having(anchors, episode_id)[:_MOST_ROWS]
        families = dict(zip(having[0].rows["episode_id"], having[0].rows["family"], strict=True))
        family = str(families[episode_id]).lower()
        names = tuple(
            name if name not in drawn else f"{name}_{len(drawn)}" for name in (f"trajectory_{family}", "pipeline")
        )
        drawn |= _of_episode(having, None, episode_id, (names[0], names[1]), frames)
    return {name: each for name, each in drawn.items() if not name.startswith("pipeline_")}


def tracks_of(
    runs: Sequence[Run], pack: str | Path | None, episode_id: str, epoch: int, frames: FrameSource
) -> tuple[Episode, list[AgentTrajectory]]:
    """Return an episode and the trajectory of each run in it. Raises RecordError if packs differ in the episode."""
    assets, reveals = frames
    loaded = [(run, load_run_pack(run.header, pack)) for run in runs]
    for _, found in loaded:
        check_revealed(found.name, is_private(found.manifest.meta), "A picture of its episodes", reveals=reveals)
    episode = loaded[0][1].episode(episode_id)
    if any(other.episode(episode_id) != episode for _, other in loaded):
        raise RecordError(f"Episode {episode_id!r} is not the same in the packs of these runs. Give runs of one pack.")
    tracks: list[AgentTrajectory] = []
    for run, found in loaded:
        record = find_record(run, found.episodes, (episode_id, epoch))
        drawn = frames_of_record(run.folder, run.header.spec, found, record, assets)
        tracks.append(make_trajectory(run.name, episode, record, drawn))
    return episode, tracks


def protocol_of(pack: str | Path, frames: FrameSource) -> Figure:
    """Return the diagram of the families, with first frames of episodes of a pack."""
    assets, reveals = frames
    loaded = Pack.load(pack)
    check_revealed(loaded.name, is_private(loaded.manifest.meta), "A picture of its episodes", reveals=reveals)
    examples: dict[Family, FamilyExample] = {}
    clarity: dict[Family, float] = {}

    def candidates() -> Iterator[Episode]:
        """Yield episodes of a family until one of them is clear."""
        for family in FAMILIES:
            for episode in [each for each in loaded.episodes if each.family == family][:_MOST_EXAMPLES]:
                if clarity.get(family, 0.0) < 1.0:
                    yield episode

    for episode, observation, target in first_frames(loaded, candidates(), assets):
        clear = _clarity(observation, target)
        if clear > clarity.get(episode.family, -1.0):
            clarity[episode.family] = clear
            examples[episode.family] = FamilyExample(episode, observation.rgb, _middle(target))
    return protocol_figure(examples)


def _clarity(observation: Observation, target: np.ndarray) -> float:
    """Return how clear an example is, at least 1 if it is clear enough: how large its target is, or how much the frame
    shows if the target is out of view. `target` are the target's pixels, (n, 2)."""
    if len(target):
        return float(np.ptp(target, axis=0).prod()) / _TARGET_PX
    return float(np.abs(np.diff(observation.rgb.astype(float), axis=1)).mean()) / _DETAIL


def _middle(pixels: np.ndarray) -> tuple[float, float] | None:
    """Return the one of these pixels (n, 2) that is nearest to their mean; None if there are none."""
    if not len(pixels):
        return None
    x, y = pixels[np.linalg.norm(pixels - pixels.mean(axis=0), axis=1).argmin()]
    return float(x), float(y)


def _having(runs: Sequence[Run], episode_id: str) -> list[Run]:
    having = [run for run in runs if episode_id in set(run.rows["episode_id"])]
    if not having:
        known = sorted({str(known) for run in runs for known in run.rows["episode_id"]})
        raise SettingError(f"No run has a scored record of episode {episode_id!r}.{did_you_mean(episode_id, known)}")
    return having


def _captioned_protocol(pack: str | Path, frames: FrameSource) -> CaptionedFigure:
    caption = (
        "The eight families in two tiers. Each has the first frame and the instruction of an example, and its limits "
        "on steps and on invalid replies."
    )
    return protocol_of(pack, frames), caption if paper_width_in() is None else f"{caption} {CONTRACT}"


def _of_episode(
    runs: Sequence[Run], pack: str | Path | None, episode_id: str, names: tuple[str, str], frames: FrameSource
) -> dict[str, CaptionedFigure]:
    """Return two figures under `names`: the trajectories in an episode, and the pipeline of the best run in it.

    The names of runs of privileged agents have the mark that they have in tables.
    """
    episode, tracks = tracks_of(runs, pack, episode_id, 1, frames)
    privileged = [run.model.is_privileged for run in runs]
    tracks = [
        replace(one, name=one.name + MARKS["privileged"]) if sees else one
        for one, sees in zip(tracks, privileged, strict=True)
    ]
    at = min(
        range(len(tracks)),
        key=lambda i: (not tracks[i].outcome.B, not tracks[i].outcome.W, privileged[i], tracks[i].name),
    )
    shown = (
        f"Trajectories on episode {episode_id}. {_MARKS} There is such a line wherever the goal holds, and at the last "
        "step. The bar at the left and the last step have the colour of the outcome."
        f"{_states(tracks[at])} {_sight(privileged)}"
    )
    piped = (
        f"The pipeline of an evaluated episode: {episode_id} (family {episode.family}) by {tracks[at].name}. "
        f"{_MARKS} {SKIPPED_WORDS}. {limits(episode).capitalize()}.{_states(tracks[at])} {_sight([privileged[at]])}"
    )
    return {
        names[0]: (trajectory_figure(episode, tracks), shown),
        names[1]: (pipeline_figure(episode, tracks[at]), piped),
    }


_MARKS = (
    "Each frame is what the agent saw before the step below the frame; rings mark its clicks. The line below the step "
    "says whether the goal holds after it (green: yes), which the agent is not shown."
)


def _states(one: AgentTrajectory) -> str:
    """Return the sentences that explain W where an episode asks for a state, else an empty text."""
    if not one.outcome.expected:
        return ""
    return (
        " Here W=1 (state in view) says only that the state of the object is in view at the end and was never changed, "
        f"whatever is reported. B also needs the right label ({one.outcome.expected})."
    )


def _sight(privileged: Sequence[bool]) -> str:
    """Return the sentences of a caption that say which agents see what is called hidden."""
    if not any(privileged):
        return "Agents never see the hidden state."
    return PRIVILEGED_MARK if all(privileged) else f"{PRIVILEGED_MARK} The others never see the hidden state."


def _common_episodes(runs: Sequence[Run]) -> list[str]:
    """Return, for each shown family, the episode that the largest number of runs have scored."""
    found = []
    for family in reversed(_SHOWN_FAMILIES):
        counts: dict[str, int] = {}
        for run in runs:
            for episode_id in sorted(set(run.rows["episode_id"][run.rows["family"] == family])):
                counts[episode_id] = counts.get(episode_id, 0) + 1
        if counts:
            found.append(min(counts, key=lambda name: (-counts[name], name)))
    return found
