"""No request, however odd, makes a server of the pages fail: no answer of 500 and above, no traceback in its log."""

import shutil
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from fastapi import FastAPI

from tests.support.web_fuzz import TOKEN, Route, errors_logged, fire, hostile_requests
from tests.support.web_server import served
from vigil.packs.pack import Pack
from vigil.runner.workers.messages import RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.play import PlaySession, PlaySettings, make_play, open_play_session
from vigil.web.review import ReviewSession, ReviewSet, make_review
from vigil.web.site import Address
from vigil.web.view import make_view

HERE = {"position": [2.5, 0.0, 1.0], "rotation": 0.0, "horizon": 30.0, "standing": True}
AHEAD = {"skill_name": "navigate", "mode": "forward", "magnitude": 40}


def bombard(app: FastAPI, routes: Sequence[Route], count: int, token: str = "") -> Counter[int | None]:
    """Sends all hostile requests to an application and returns how often it answered with each status."""
    failures: list[str] = []
    statuses: Counter[int | None] = Counter()
    with served(app) as site, errors_logged() as told:
        for shot in hostile_requests(routes, site.port, count=count, seed=7, token=token):
            status = fire(site.port, shot)
            statuses[status] += 1
            if (status or 0) >= 500 or told.lines:
                failures.append(f"{status} {shot.name}: {' | '.join(told.lines)}")
                told.lines.clear()
        assert site.get("/").status in (200, 401)
    assert not failures, f"{len(failures)} failures:\n" + "\n".join(failures[:20])
    return statuses


@pytest.fixture
def small(runs: Path, tmp_path: Path) -> Path:
    """Two runs of two episodes each."""
    for name in ("sweep", "random"):
        shutil.copytree(runs / name, tmp_path / "few" / name)
    return tmp_path / "few"


@pytest.fixture
def play_session(pack: Pack, tmp_path: Path) -> Iterator[PlaySession]:
    play_session = open_play_session(
        PlaySettings(player="ada", pack=pack.folder, log_dir=tmp_path / "run", backend="fake")
    )
    yield play_session
    play_session.close()


def view_routes(pack: Pack) -> list[Route]:
    episode = f"/runs/{{sweep}}/episodes/{{{pack.episodes[0].id}}}/{{1}}"
    return [
        Route("GET", "/", takes_query=True),
        Route("GET", "/static/{vigil.css}"),
        Route("GET", "/runs/{sweep}", takes_query=True),
        Route("GET", "/runs/{sweep}/status"),
        Route("GET", "/compare", takes_query=True),
        Route("GET", episode),
        Route("GET", f"{episode}/frames/{{1}}.png"),
        Route("GET", f"{episode}/frames/{{1}}.json"),
        Route("GET", "/packs"),
        Route("GET", "/packs/{tiny}"),
        Route("GET", f"/packs/{{tiny}}/starts/{{{pack.episodes[0].id}}}.png"),
        Route("GET", "/houses"),
        Route("GET", "/houses/{tiny}/{tiny}"),
        Route("GET", "/houses/{tiny}/{tiny}/plan.svg"),
        Route("POST", "/houses/{tiny}/{tiny}/walk", {"pose": HERE, "action": AHEAD}),
        Route("POST", "/houses/{tiny}/{tiny}/name", {"pose": HERE, "x": 3, "y": 4}),
    ]


def test_view_stands_whatever_it_is_asked(pack: Pack, small: Path, render_service: RenderService) -> None:
    app = make_view(Library([small], [pack.folder]), render_service, render_settings=RenderSettings("fake"))
    statuses = bombard(app, view_routes(pack), 150)
    assert {200, 303, 400, 403, 404, 405, 415, 421, 422} <= set(statuses)


def test_a_token_is_asked_for_whatever_comes(pack: Pack, small: Path, render_service: RenderService) -> None:
    app = make_view(Library([small], [pack.folder]), render_service, Address(token=TOKEN), RenderSettings("fake"))
    assert {200, 401} <= set(bombard(app, [Route("GET", "/runs/{sweep}")], 50, TOKEN))
    assert {401} <= set(bombard(app, [Route("GET", "/runs/{sweep}")], 50))


def test_play_stands_whatever_it_is_asked(play_session: PlaySession) -> None:
    routes = [
        Route("GET", "/"),
        Route("GET", "/state"),
        Route("POST", "/next", {}),
        Route("POST", "/reply", {"moment": 0, "text": "{}"}),
    ]
    assert {200, 400, 403, 404, 405, 415, 421, 422} <= set(bombard(make_play(play_session), routes, 150))


def test_review_stands_whatever_it_is_asked(pack: Pack, render_service: RenderService, tmp_path: Path) -> None:
    session = ReviewSession(
        ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    episode = f"/episodes/{{{pack.episodes[0].id}}}"
    said = {"verdict": "edit", "instruction": "Go there.", "target_size": None, "text": ""}
    routes = [
        Route("GET", "/"),
        Route("GET", episode),
        Route("GET", f"{episode}/solution/{{1}}.png"),
        Route("GET", f"{episode}/around/{{3}}.png"),
        Route("POST", f"{episode}/verdict", said),
    ]
    assert {200, 400, 403, 404, 405, 415, 421, 422} <= set(bombard(make_review(session, render_service), routes, 150))
