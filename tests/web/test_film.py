"""Films of an episode: what they show, that players take them, and what is said where PyAV is not installed."""

import io
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image

from tests.support.tiny_pack import FRIDGE, MUG, SIDE, tiny_house
from tests.support.web_server import Site
from vigil.agents.frame_encoding import encode_frame
from vigil.assets.database import AssetDatabase
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.scene.plan import MARGIN_M
from vigil.web.films import film as film_module
from vigil.web.films.film import LAST_S, STEP_S, VIDEO_FPS, FilmFrame, film_frames_of, gif, mp4, webp
from vigil.web.films.plan import (
    AGENT,
    CAPTION_PX,
    LEGEND_PX,
    PANEL_PX,
    PATH,
    RING_M,
    SOFT,
    TARGET,
    FilmPlan,
)
from vigil.web.library import Library
from vigil.web.plan import floor_plan_of
from vigil.web.timeline import episode_of, episode_timeline

RED, BLUE = (200, 30, 30), (30, 60, 190)


@pytest.fixture
def few_ticks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes videos of two frames a second: encoding is what takes long."""
    monkeypatch.setattr(film_module, "VIDEO_FPS", 2)


MOVED_FRIDGE = "1.1,-0.1 1.8,-0.1 1.8,-0.8 1.1,-0.8"
"""Corners of a box like the fridge's, a metre further."""


def shot(
    colour: tuple[int, int, int], *, action: str = "forward 1", thought: str = "", click: list[int] | None = None
) -> FilmFrame:
    frame = np.full((480, 640, 3), colour, np.uint8)
    return FilmFrame(encode_frame(frame).data, "Open the fridge.", action, click, thought)


def moment(x: float, z: float, yaw: float = 0.0) -> dict[str, Any]:
    """A world of a timeline, with the fridge of the tiny house as what the goal is about."""
    return {"x": x, "y": -z, "yaw": yaw, "objects": {FRIDGE: {"corners": "0.1,-0.1 0.8,-0.1 0.8,-0.8 0.1,-0.8"}}}


def colours_in(picture: Image.Image) -> set[tuple[int, ...]]:
    return {tuple(colour) for colour in np.unique(np.asarray(picture).reshape(-1, 3), axis=0).tolist()}


def pictures(film: bytes) -> list[np.ndarray]:
    with av.open(io.BytesIO(film), "r") as opened:
        return [frame.to_ndarray(format="rgb24") for frame in opened.decode(video=0)]


@pytest.mark.usefixtures("few_ticks")
def test_an_mp4_is_h264_that_browsers_take() -> None:
    film = mp4([shot(RED), shot(BLUE)])
    assert film[4:12] == b"ftypisom"
    assert film.index(b"moov") < film.index(b"mdat")  # a browser may begin before it has all
    with av.open(io.BytesIO(film), "r") as opened:
        (stream,) = opened.streams.video
        context = stream.codec_context
        assert (context.name, context.pix_fmt, context.width, context.height) == ("h264", "yuv420p", 1120, 616)


def test_each_step_stays_its_time_and_keeps_its_colours() -> None:
    seen = pictures(mp4([shot(RED), shot(BLUE)]))
    assert len(seen) == round((STEP_S + LAST_S) * VIDEO_FPS)
    for picture, colour in ((seen[0], RED), (seen[-1], BLUE)):
        assert np.abs(picture[240, 320].astype(int) - colour).max() <= 6
    change = round(STEP_S * VIDEO_FPS)
    assert seen[change - 1][240, 320, 0] > 150 > seen[change][240, 320, 0]


@pytest.mark.usefixtures("few_ticks")
def test_the_same_frames_give_the_same_bytes() -> None:
    shots = [shot(RED, click=[100, 200]), shot(BLUE)]
    assert mp4(shots) == mp4(shots)
    assert gif(shots) == gif(shots)
    assert webp(shots) == webp(shots)


def test_a_webp_shows_each_slide_in_its_colours() -> None:
    image = Image.open(io.BytesIO(webp([shot(RED), shot(BLUE)])))
    assert (image.format, image.size, getattr(image, "n_frames", 1)) == ("WEBP", (840, 462), 2)
    for number, colour in enumerate((RED, BLUE)):
        image.seek(number)
        assert np.abs(np.asarray(image.convert("RGB"))[180, 240].astype(int) - colour).max() <= 6


@pytest.mark.usefixtures("few_ticks")
def test_the_click_is_marked_where_it_was() -> None:
    plain, marked = mp4([shot(BLUE)]), mp4([shot(BLUE, click=[100, 200])])
    difference = np.abs(pictures(plain)[0].astype(int) - pictures(marked)[0]).max(axis=2)
    rows, columns = np.nonzero(difference > 60)
    assert abs(rows.mean() - 200) < 2
    assert abs(columns.mean() - 100) < 2
    assert rows.max() < 480


@pytest.mark.parametrize(
    "words", ["x" * 3000, "one\ntwo\x00\x1b[31m", "fünf Öfen — 開ける", ""], ids=["long", "lines", "wide", "none"]
)
def test_any_text_fits_into_the_strip(words: str) -> None:
    image = Image.open(io.BytesIO(gif([shot(BLUE, action=words, thought=words)])))
    strip = np.asarray(image.convert("RGB"))[362:]
    assert (strip[:, :8] == strip[0, 0]).all()
    assert (strip[:, -8:] == strip[0, 0]).all()


def test_without_frames_there_is_no_film() -> None:
    story = {"episode": "e1", "instruction": "Look.", "steps": [{"index": 1, "action": "look up 15°", "click": None}]}
    with pytest.raises(SettingError, match="'e1' has no frame"):
        film_frames_of(story, [None])


def test_the_plan_shows_the_way_so_far_and_whether_the_goal_holds() -> None:
    plan = FilmPlan(floor_plan_of(tiny_house(), AssetDatabase.default()))
    way = [moment(1.0, 1.0), moment(2.0, 1.0), moment(2.0, 2.0)]
    start, end = plan.panel(way[:1], False), plan.panel(way, True)
    assert {AGENT, TARGET, SOFT} <= colours_in(start)
    assert PATH not in colours_in(start.crop((0, CAPTION_PX, PANEL_PX, PANEL_PX - LEGEND_PX)))
    assert PATH in colours_in(end.crop((0, CAPTION_PX, PANEL_PX, PANEL_PX - LEGEND_PX)))
    assert TARGET in colours_in(end.crop((0, 0, PANEL_PX, CAPTION_PX)))
    assert TARGET not in colours_in(start.crop((0, 0, PANEL_PX, CAPTION_PX)))
    assert plan.panel([], None).size == (PANEL_PX, PANEL_PX)


def test_a_thing_too_small_for_the_plan_is_ringed() -> None:
    plan = FilmPlan(floor_plan_of(tiny_house(), AssetDatabase.default()))
    small = moment(1.0, 1.0) | {"objects": {MUG: {"corners": "2.0,-2.0 2.08,-2.0 2.08,-2.08 2.0,-2.08"}}}
    drawn = np.asarray(plan.panel([small], False))[CAPTION_PX : PANEL_PX - LEGEND_PX].astype(int)
    rows, columns = np.nonzero(np.abs(drawn - TARGET).max(axis=2) < 20)
    assert min(np.ptp(rows), np.ptp(columns)) > 1.5 * RING_M * PANEL_PX / (SIDE + 2 * MARGIN_M + 1)


def test_a_target_has_its_outline_on_the_plan_until_it_is_moved() -> None:
    floor = floor_plan_of(tiny_house(), AssetDatabase.default())
    (fridge,) = (thing for thing in floor.things if thing.id == FRIDGE)
    triangle = replace(fridge, corners=np.array([(0.1, 0.1), (0.8, 0.1), (0.1, 0.8)]))
    plan = FilmPlan(replace(floor, things=(triangle,)))
    here = moment(3.0, 3.0)
    gone, moved = ({**here, "objects": objects} for objects in ({}, {FRIDGE: {"corners": MOVED_FRIDGE}}))
    empty = np.asarray(plan.panel([gone], None))
    still, elsewhere = (
        int((np.asarray(plan.panel([world], None)) != empty).any(axis=2).sum()) for world in (here, moved)
    )
    assert 0.4 * elsewhere < still < 0.7 * elsewhere, "half of a square"


def test_the_last_slide_tells_the_verdict_and_none_before_it(pack: Pack, runs: Path) -> None:
    library = Library([runs], [pack.folder])
    library.runs()
    shown = library.run("sweep")
    episode, record, _ = episode_of(shown, (pack.episodes[0].id, 1))
    story, frame = episode_timeline(shown, episode, record), shot(BLUE).frame
    shots = film_frames_of(story, [frame] * len(record.steps))
    assert [each.verdict is not None for each in shots] == [False] * len(record.steps) + [True]
    failed = {**story, "hidden": {**story["hidden"], "verdict": None}}
    assert len(film_frames_of(failed, [frame] * len(record.steps))) == len(record.steps)


@pytest.mark.usefixtures("few_ticks")
def test_a_verdict_is_written_over_the_frame_alone() -> None:
    verdict = {"W": True, "B": False, "label": "FR", "why": ["The goal holds at the end.", "FR: it reported failure."]}
    plain, told = (pictures(mp4([each]))[0] for each in (shot(BLUE), replace(shot(BLUE), verdict=verdict)))
    rows, columns = np.nonzero(np.abs(plain.astype(int) - told).max(axis=2) > 60)
    assert rows.max() < 480
    assert columns.max() < 640


def test_without_pyav_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(SettingError, match=r"pip install 'vigil-bench\[video\]'"):
        mp4([shot(RED)])


def test_the_page_offers_the_film(view: Site, pack: Pack) -> None:
    episode = f"/runs/sweep/episodes/{pack.episodes[0].id}/1"
    assert f'href="{episode}/export.mp4"' in view.get(episode).text
    answer = view.get(f"{episode}/export.mp4")
    assert (answer.status, answer.headers["content-type"]) == (200, "video/mp4")
    assert f'filename="{pack.episodes[0].id}.1.mp4"' in answer.headers["content-disposition"]
    assert len(pictures(answer.body)) == round((5 * STEP_S + LAST_S) * VIDEO_FPS)
    assert view.get(f"{episode}/export.avi").status in (404, 422)
