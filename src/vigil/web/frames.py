"""Frames of a recorded episode, from saved files or drawn again. Each frame is compared with the recorded hash."""

from dataclasses import dataclass
from typing import Any, Literal

from vigil.agents.frame_encoding import decode_frame
from vigil.errors import RecordError, SettingError, VigilError
from vigil.protocol.actions import PhysicalAction
from vigil.protocol.episode import Episode
from vigil.records.probe_file import read_probes
from vigil.records.reasoning_file import reasoning_by_step
from vigil.records.record import EpisodeRecord, Key
from vigil.runner.workers.frames import frame_sha256
from vigil.runner.workers.messages import EpisodeMoment, RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.library import LibraryPack, LibraryRun
from vigil.web.timeline import timeline_of

Origin = Literal["saved", "redrawn"]
ORIGINS: dict[Origin, str] = {
    "saved": "As saved with the run",
    "redrawn": "Drawn again from the recorded actions",
}


@dataclass(frozen=True, slots=True)
class Frame:
    """The frame that the agent saw before a step's reply, and whether it is the recorded frame."""

    data: bytes
    """The bytes of the PNG file."""
    origin: Origin
    is_recorded: bool | None
    """Whether the frame's pixels have the recorded hash; None if the record has no hash."""

    @property
    def facts(self) -> dict[str, Any]:
        """The facts about the frame that the viewer shows."""
        return {"is_recorded": self.is_recorded, "note": self.note}

    @property
    def note(self) -> str:
        """A sentence about the origin of the picture."""
        if self.is_recorded is None:
            return f"{ORIGINS[self.origin]}; the record does not hold a hash to compare it with."
        if self.is_recorded:
            return f"{ORIGINS[self.origin]}; equal to the recorded frame, pixel by pixel."
        if self.origin == "saved":
            return "The saved file is NOT the recorded frame: its pixels have another hash."
        return (
            "Drawn again from the recorded actions; NOT equal to the recorded frame: another renderer or version draws "
            "a little differently. `vigil verify` compares what counts."
        )


def episode_of(run: LibraryRun, key: Key) -> tuple[Episode, EpisodeRecord, LibraryPack]:
    """Return an episode of a run with its record and its pack. Raises KeyError or RecordError."""
    if run.table is None or run.pack is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    if key not in run.table.rows:
        raise KeyError(key)
    return run.table.episodes[key[0]], run.table.record(key), run.pack


def episode_timeline(run: LibraryRun, episode: Episode, record: EpisodeRecord) -> dict[str, Any]:
    """Return the timeline of a record of a run."""
    if run.header is None or run.table is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    timeline = timeline_of(episode, record, run.header.spec.profile, run.table.rows[record.key].outcome)
    reasoning = reasoning_by_step(run.folder, record)
    timeline["steps"] = [{**step, "reasoning": reasoning.get(step["index"], "")} for step in timeline["steps"]]
    timeline["hidden"]["beliefs"] = [
        {"step": probe.step, "framing": probe.framing, "sure": probe.answer.sure, "done": probe.answer.done}
        for probe in read_probes(run.folder, run.header.sha256).of(record)
        if probe.answer is not None
    ]
    return timeline


def frame_of(run: LibraryRun, key: Key, step: int, render_service: RenderService) -> Frame:
    """Return the frame before a step's reply: as saved, or drawn again. Raises VigilError or KeyError."""
    episode, record, pack = episode_of(run, key)
    if not 1 <= step <= len(record.steps):
        raise KeyError(step)
    recorded = record.steps[step - 1].frame_sha256
    saved = _saved_frame(run, recorded)
    return saved or _compared_with_record(
        render_service.picture(_moment_of(run, episode, record, pack, step)), "redrawn", recorded
    )


def frames_of(run: LibraryRun, key: Key, render_service: RenderService) -> list[Frame | None]:
    """Return all frames of an episode, with None for each frame that was not saved and cannot be drawn."""
    _, record, _ = episode_of(run, key)
    found: list[Frame | None] = []
    for step in record.steps:
        try:
            found.append(frame_of(run, key, step.index, render_service))
        except VigilError:
            found.append(None)
    return found


def _saved_frame(run: LibraryRun, recorded: str | None) -> Frame | None:
    """Return a saved frame; None if it was not saved or its file is not a picture."""
    try:
        data = run.frames.file(recorded)
        return None if data is None else _compared_with_record(data, "saved", recorded)
    except RecordError:
        return None


def _compared_with_record(data: bytes, origin: Origin, recorded: str | None) -> Frame:
    return Frame(data, origin, None if recorded is None else frame_sha256(decode_frame(data)) == recorded)


def _moment_of(run: LibraryRun, episode: Episode, record: EpisodeRecord, pack: LibraryPack, step: int) -> EpisodeMoment:
    if run.header is None:
        raise RecordError(f"Run {run.slug!r} cannot be read: {run.fault}")
    spec = run.header.spec
    if spec.asset_database_sha256 is not None and run.assets is None:
        raise SettingError(
            f"Run {run.slug!r} was played with an asset database of SHA-256 {spec.asset_database_sha256[:12]}...; its "
            "frames can be drawn again when that file is given with --assets."
        )
    done = [each.action for each in record.steps[: step - 1]]
    return EpisodeMoment(
        render_settings=RenderSettings(spec.simulator, spec.render_quality, run.assets),
        house=pack.house_path(episode.house.name),
        house_sha256=episode.house.sha256,
        start=episode.start,
        setup=episode.setup,
        actions=tuple(action for action in done if isinstance(action, PhysicalAction)),
    )
