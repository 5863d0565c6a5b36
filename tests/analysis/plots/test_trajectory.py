"""Trajectories and diagrams: which steps are shown, what is said about them, and that they draw."""

import io

import numpy as np
import pytest
from matplotlib.patches import FancyBboxPatch
from PIL import Image

from tests.support.builders import episode
from tests.support.published_runs import EpisodeScript, Write, make_episodes, record_of, small_records
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.plots.diagrams import FamilyExample, pipeline_figure, protocol_figure
from vigil.analysis.plots.style import figure_bytes
from vigil.analysis.plots.trajectory import (
    AgentTrajectory,
    action_caption,
    find_record,
    key_steps,
    make_trajectory,
    step_caption,
    trajectory_animation,
    trajectory_figure,
    verdict_caption,
)
from vigil.errors import RecordError
from vigil.protocol.actions import InteractPixel, InvalidAction, Look, Navigate, Report
from vigil.records.record import Shard
from vigil.records.shards import shard_episodes

AI = episode("AI")


def one(plot: EpisodeScript, name: str = "agent") -> AgentTrajectory:
    record = record_of(plot).model_copy(update={"episode_id": AI.id})
    frames = [np.full((480, 640, 3), 10 * index % 250, np.uint8) for index in range(len(record.steps))]
    return make_trajectory(name, AI, record, frames)


LONG = one(EpisodeScript("AI", True, "success", wait=12), "a-rather-long-model-name-32B (T)")
SHORT = one(EpisodeScript("AI", False, "success"))
SILENT = one(EpisodeScript("AI", True, "NR", wait=3))


def test_telling_steps_have_first_attainment_and_last():
    assert key_steps(SHORT, 6) == [0, 1]
    found = key_steps(LONG, 5)
    assert len(found) == 5
    assert found == sorted(set(found))
    assert {0, 1, 13} <= set(found)


def test_words_for_actions():
    assert action_caption(Navigate(mode="turn_left", magnitude=90)) == "turn left 90°"
    assert action_caption(Navigate(mode="forward", magnitude=2.5)) == "forward 2.5 steps"
    assert action_caption(Look(direction="up", magnitude=30)) == "look up 30°"
    assert action_caption(InteractPixel(intent="open_access", x=3, y=4)) == "open access (3, 4)"
    assert action_caption(InteractPixel(intent="drop")) == "drop"
    assert action_caption(Report(status="invalid", summary="", raw_status="done")) == "report: done"
    step = SHORT.record.steps[0].model_copy(
        update={"action": None, "invalid": InvalidAction(kind="protocol_failure", reason="not_json")}
    )
    assert step_caption(step) == "invalid: not json"


def test_verdicts_say_how_it_ended():
    assert verdict_caption(LONG).splitlines() == ["W=1  B=1", "verified success"]
    assert verdict_caption(SHORT).splitlines() == ["W=0  B=0", "false report", "false success"]
    assert verdict_caption(SILENT).splitlines() == ["W=1  B=0", "no report"]


def test_a_track_needs_a_frame_a_step():
    with pytest.raises(RecordError, match="1 frames for the 2 steps"):
        make_trajectory("agent", AI, SHORT.record, SHORT.frames[:1])


def test_figures_draw_and_animations_have_all_steps():
    tracks = [LONG, SHORT, SILENT]
    assert figure_bytes(trajectory_figure(AI, tracks), "png").startswith(b"\x89PNG")
    assert figure_bytes(pipeline_figure(AI, LONG), "svg").startswith(b"<?xml")
    shown = Image.open(io.BytesIO(trajectory_animation(AI, [SILENT, SHORT], "gif")))
    assert getattr(shown, "n_frames", 1) == len(SILENT.frames)
    assert trajectory_animation(AI, [SHORT], "webp")[8:12] == b"WEBP"


@pytest.mark.parametrize("shown", [SHORT, SILENT, LONG], ids=["two", "the whole budget", "fourteen"])
def test_pictures_of_the_pipeline_stay_above_its_boxes(shown: AgentTrajectory):
    figure = pipeline_figure(AI, shown)
    figure.canvas.draw()
    (boxes,) = figure.axes
    pictures = boxes.child_axes
    top = max(patch.get_window_extent().y1 for patch in boxes.patches if isinstance(patch, FancyBboxPatch))
    assert len(pictures) == min(5, len(shown.record.steps))
    assert all(picture.get_window_extent().y0 > top + 20 for picture in pictures)


def test_long_instructions_stay_inside_the_pipeline():
    wordy = AI.model_copy(update={"instruction": "Open the drawers of the dresser, take the clock out. " * 8})
    figure = pipeline_figure(wordy, SHORT)
    figure.canvas.draw()
    width = figure.bbox.width
    assert all(text.get_window_extent().x1 <= width for text in figure.axes[0].texts)


def test_the_protocol_draws_without_every_family():
    assert figure_bytes(protocol_figure({"AI": FamilyExample(AI, LONG.frames[0], (320.0, 240.0))}), "pdf").startswith(
        b"%PDF"
    )


def test_a_record_is_found_by_episode_and_epoch(write: Write):
    (run,) = read_runs([write("run", {"AI-000": small_records()["AI-000"]})])
    assert find_record(run, make_episodes(2), ("AI-000", 1)).episode_id == "AI-000"
    for wanted in (("AI-001", 1), ("AI-000", 2)):
        with pytest.raises(RecordError, match="no scored record"):
            find_record(run, make_episodes(2), wanted)


def test_a_record_of_a_shard_is_found(write: Write):
    part = shard_episodes([one for one in make_episodes(2) if one.id in small_records()], Shard(index=1, of=2))
    records = {one.id: small_records()[one.id] for one in part}
    (run,) = read_runs([write("run", records, planned=sorted(small_records()), shard=Shard(index=1, of=2))])
    assert find_record(run, make_episodes(2), (part[0].id, 1)).episode_id == part[0].id
