"""Films of an episode: what they show, that players take them, and what is said where PyAV is not installed."""

import io
import sys

import av
import numpy as np
import pytest
from PIL import Image
from web_server import Site

from vigil.agents.picture import encode
from vigil.errors import SettingError
from vigil.pack import Pack
from vigil.web.film import LAST_S, STEP_S, VIDEO_FPS, FilmFrame, film_frames_of, gif, mp4

RED, BLUE = (200, 30, 30), (30, 60, 190)


def shot(colour: tuple[int, int, int], *, action: str = "forward 1", click: list[int] | None = None) -> FilmFrame:
    frame = np.full((480, 640, 3), colour, np.uint8)
    return FilmFrame(encode(frame).data, "Open the fridge.", action, click)


def pictures(film: bytes) -> list[np.ndarray]:
    with av.open(io.BytesIO(film)) as opened:
        return [frame.to_ndarray(format="rgb24") for frame in opened.decode(video=0)]


def test_an_mp4_is_h264_that_browsers_take() -> None:
    film = mp4([shot(RED), shot(BLUE)])
    assert film[4:12] == b"ftypisom"
    assert film.index(b"moov") < film.index(b"mdat")  # a browser may begin before it has all
    with av.open(io.BytesIO(film)) as opened:
        (stream,) = opened.streams
        context = stream.codec_context
        assert (context.name, context.pix_fmt, context.width, context.height) == ("h264", "yuv420p", 640, 568)


def test_each_step_stays_its_time_and_keeps_its_colours() -> None:
    seen = pictures(mp4([shot(RED), shot(BLUE)]))
    assert len(seen) == round((STEP_S + LAST_S) * VIDEO_FPS)
    for picture, colour in ((seen[0], RED), (seen[-1], BLUE)):
        assert np.abs(picture[240, 320].astype(int) - colour).max() <= 6
    change = round(STEP_S * VIDEO_FPS)
    assert seen[change - 1][240, 320, 0] > 150 > seen[change][240, 320, 0]


def test_the_same_frames_give_the_same_bytes() -> None:
    shots = [shot(RED, click=[100, 200]), shot(BLUE)]
    assert mp4(shots) == mp4(shots)
    assert gif(shots) == gif(shots)


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
    image = Image.open(io.BytesIO(gif([shot(BLUE, action=words)])))
    strip = np.asarray(image.convert("RGB"))[362:]
    assert (strip[:, :8] == strip[0, 0]).all()
    assert (strip[:, -8:] == strip[0, 0]).all()


def test_without_frames_there_is_no_film() -> None:
    story = {"episode": "e1", "instruction": "Look.", "steps": [{"index": 1, "action": "look up 15°", "click": None}]}
    with pytest.raises(SettingError, match="'e1' has no frame"):
        film_frames_of(story, [None])


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
    assert len(pictures(answer.body)) == round((4 * STEP_S + LAST_S) * VIDEO_FPS)
    assert view.get(f"{episode}/export.avi").status in (404, 422)
