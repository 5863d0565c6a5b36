"""The pages in a real browser, driven by keys and clicks as a person would."""

import json
import re
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from tests.support.browser_page import Visitor
from tests.support.quick_runs import claim
from tests.support.tiny_pack import loose_pack, tiny_episode, tiny_house
from tests.support.web_server import Site, served
from vigil.authoring.review.reviews import read_reviews
from vigil.packs.pack import Pack
from vigil.protocol.profile import Profile
from vigil.protocol.prompt import rendered_sha256
from vigil.records.record_file import read_records
from vigil.runner.workers.messages import RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.export import export_site
from vigil.web.films.film import LAST_S, STEP_S
from vigil.web.library import Library
from vigil.web.play import PlaySettings, make_play, open_play_session
from vigil.web.review import ReviewSession, ReviewSet, make_review
from vigil.web.view import make_view

FILM = """async (at) => {
  const video = document.querySelector("video");
  video.src = URL.createObjectURL(await (await fetch("film.mp4")).blob());
  await video.play();
  video.pause();
  await new Promise((done) => { video.onseeked = done; video.currentTime = at; });
  const frame = new Image();
  frame.src = "frame.png";
  await frame.decode();
  const colours = (picture) => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 640, height: 480 });
    const context = canvas.getContext("2d");
    context.drawImage(picture, 0, 0);
    return [[100, 60], [320, 200], [540, 400]].flatMap(([x, y]) => [...context.getImageData(x, y, 1, 1).data]);
  };
  const { videoWidth: width, videoHeight: height, duration } = video;
  return { width, height, duration, film: colours(video), frame: colours(frame) };
}"""


def test_from_the_table_of_runs_to_an_episode(visitor: Visitor, view: Site) -> None:
    page = visitor.page
    page.goto(view.url)
    visitor.check("runs")
    page.click("text=sweep >> nth=0")
    visitor.check("run")
    page.locator("svg a rect.FR").first.click()
    page.wait_for_url("**label=FR**")
    page.locator(".episodes tbody a").first.focus()
    visitor.press("Enter")
    visitor.has("html[data-step='1']")
    visitor.check("episode")


def test_an_episode_is_stepped_by_keys(visitor: Visitor, view: Site, pack: Pack) -> None:
    page = visitor.page
    page.goto(f"{view.url}/runs/sweep/episodes/{pack.episodes[0].id}/1")
    visitor.has("html[data-step='1']")
    assert not page.is_visible("#hidden")
    visitor.press("ArrowRight", "ArrowRight")
    visitor.has("html[data-step='3']")
    assert visitor.text("#place") == "step 3 of 5"
    assert page.url.endswith("#step=3")
    visitor.press("End")
    assert visitor.text("#action") == "report success"
    visitor.press("h")
    assert page.is_visible("#hidden .plan")
    assert "false" in visitor.text("#verdict") or "report" in visitor.text("#verdict")
    visitor.check("hidden state")
    visitor.check_with_axe("hidden state")
    visitor.press("Home", " ")
    visitor.has("html[data-step='2']")
    visitor.press(" ", "h")
    assert not page.is_visible("#hidden")
    visitor.press("]")
    page.wait_for_url(f"**/{pack.episodes[1].id}/1*")


def test_a_link_leads_to_a_step(visitor: Visitor, view: Site, pack: Pack) -> None:
    visitor.page.goto(f"{view.url}/runs/sweep/episodes/{pack.episodes[0].id}/1#step=4&hidden")
    visitor.has("html[data-step='4']")
    assert visitor.page.is_visible("#hidden")


def test_a_saved_steps_picture_is_there_before_it_is_asked_for(chromium: Any, view: Site, pack: Pack) -> None:
    page = chromium.new_page()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(f"{view.url}/runs/sweep/episodes/{pack.episodes[0].id}/1")
    shown = set()
    for _ in range(3):
        page.wait_for_load_state("networkidle")
        before = set(asked)
        page.keyboard.press("ArrowRight")
        picture = page.evaluate(
            "async () => { const p = document.getElementById('picture'); await p.decode(); return p.src; }"
        )
        assert picture in before
        shown.add(picture)
    page.close()
    assert len(shown) == 3


def test_what_a_model_wrote_runs_nowhere(
    visitor: Visitor, runs: Path, render_service: RenderService, tmp_path: Path
) -> None:
    evil = "</script><script>window.evil=1</script><img src=x onerror=window.evil=1>"
    pack = loose_pack(tmp_path / "pack", [tiny_episode(0, "DA", instruction=evil)], [tiny_house()])
    rows = [json.loads(line) for line in (runs / "sweep" / "episodes.jsonl").read_text().splitlines()]
    row = next(row for row in rows if row["episode_id"] == "tiny-DA-000")
    reply = {"skill_name": "report", "arguments": {"status": "success", "summary": evil}, "thought": evil}
    row["steps"][-1]["reply"]["text"] = json.dumps({**reply, "cognitive_state": evil})
    row["steps"][-1]["action"]["summary"] = evil
    row["prompt_sha256"] = rendered_sha256(evil, Profile())
    header = json.loads((runs / "sweep" / "run.json").read_text())
    header["spec"] |= {"pack_sha256": pack.sha256, "episode_ids": [row["episode_id"]], "agent": evil}
    run = tmp_path / "runs" / "evil"
    run.mkdir(parents=True)
    (run / "run.json").write_text(json.dumps(header))
    (run / "episodes.jsonl").write_text(json.dumps(row) + "\n")
    claim(run)
    library = Library([run], [pack.folder])
    (shown,) = library.runs()
    assert shown.table is not None
    assert not shown.table.left_out
    with served(make_view(library, render_service)) as site:
        visitor.page.goto(f"{site.url}/runs/evil/episodes/{row['episode_id']}/1#step=5&hidden")
        visitor.has("html[data-step='5']")
        assert visitor.text("#thought") == evil
        assert evil in visitor.text(".instruction")
        visitor.check("hostile episode")
        visitor.page.goto(f"{site.url}/runs/evil")
        visitor.check("hostile run")


def test_a_house_is_walked_by_keys(visitor: Visitor, view: Site) -> None:
    page = visitor.page
    page.goto(f"{view.url}/houses/tiny/tiny")
    # The pages draw houses with the default backend; what matters here is that each key is answered.
    visitor.has("html[data-moves='1']")
    visitor.press("ArrowLeft")
    visitor.has("html[data-moves='2']")
    page.fill("#find", "fridge")
    assert page.locator("#things tbody tr:visible").count() == 1
    assert visitor.faults == []


def test_a_person_plays_by_keys_and_mouse(visitor: Visitor, pack: Pack, tmp_path: Path) -> None:
    page = visitor.page
    settings = PlaySettings(
        player="ada", pack=pack.folder, log_dir=tmp_path / "run", backend="fake", families=("AI",), limit=1
    )
    play_session = open_play_session(settings)
    traffic: list[str] = []
    try:
        with served(make_play(play_session)) as site:
            page.on("response", lambda response: traffic.append(response.url))
            page.goto(site.url)
            visitor.has("html[data-answers='1']")
            visitor.check("lobby")
            visitor.press("Enter")
            visitor.has("html[data-answers='2']")
            visitor.check("game")
            visitor.press("ArrowRight")
            visitor.has("html[data-answers='3']")
            visitor.press("r")
            visitor.has("html[data-answers='4']")
            page.click("#picture", position={"x": 120, "y": 90})
            assert page.is_visible("#menu")
            visitor.check("menu")
            visitor.press("ArrowDown", "Enter")
            visitor.has("html[data-answers='5']")
            visitor.press("c", "ArrowLeft", "Shift+ArrowUp", "Enter", "6")
            visitor.has("html[data-answers='6']")
            visitor.press("q")
            visitor.has("html[data-answers='7']")
            page.click("[data-do=backward]")
            visitor.has("html[data-answers='8']")
            visitor.press("e", "ArrowDown")
            visitor.check("report form")
            page.fill("#summary", "It does not open.")
            page.click("#report-form button[type=submit]")
            visitor.has("html[data-answers='9']")
            assert page.is_visible("#over")
            visitor.check("the end")
    finally:
        play_session.close()
    (record,) = read_records(tmp_path / "run" / "episodes.jsonl")
    actions = [step.action.model_dump(exclude_none=True) for step in record.steps if step.action]
    clicked = 640 * 120 // page.viewport_size["width"] if page.viewport_size["width"] < 600 else 120
    assert [action["skill_name"] for action in actions] == [
        "navigate",
        "look",
        "interact_pixel",
        "interact_pixel",
        "interact_pixel",
        "navigate",
        "report",
    ]
    assert actions[2]["intent"] == "open_access"
    assert abs(actions[2]["x"] - clicked) < 40
    assert actions[3] == {"skill_name": "interact_pixel", "intent": "pick", "x": 304, "y": 238}
    assert actions[4]["intent"] == "drop"
    assert actions[6] == {"skill_name": "report", "status": "fail", "summary": "It does not open."}
    assert {re.sub(r"^http://[^/]+", "", url) for url in traffic} <= {
        *("/", "/state", "/next", "/reply", "/static/play.js", "/static/vigil.css", "/static/icon.svg")
    }


def test_an_auditor_reviews_by_keys(
    visitor: Visitor, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    page = visitor.page
    session = ReviewSession(
        ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    with served(make_review(session, render_service)) as site:
        page.goto(site.url)
        visitor.check("queue")
        page.click("#go")
        visitor.has("html[data-step='1']")
        visitor.press("ArrowRight")
        assert visitor.text("#step") == "step 1 of 1: report success"
        visitor.press("2")
        visitor.has("html[data-saved='1']")
        visitor.press("e")
        page.fill("#words", "Walk to the <b>table</b>.")
        visitor.press("Enter")
        visitor.has("html[data-saved='2']")
        assert visitor.text("#instruction") == "Walk to the <b>table</b>."
        visitor.check("review")
        first = page.url
        visitor.press("a")
        page.wait_for_url(lambda url: url != first)
        visitor.press("x")
        page.fill("#words", "Too dark.")
        visitor.press("Enter")
        visitor.has("html[data-saved='1']")
    verdicts = [(review.episode_id, review.verdict) for review in read_reviews(session.path)]
    one, two = session.queue[0].id, session.queue[1].id
    assert verdicts == [(one, "target_size"), (one, "edit"), (one, "approve"), (two, "reject")]


def test_an_exported_run_works_from_files(
    visitor: Visitor, runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    index = export_site(Library([runs], [pack.folder]).run("sweep"), tmp_path / "site", render_service)
    visitor.page.goto(f"{index.as_uri()}#family=PG")
    assert visitor.page.locator(".episodes tbody tr:visible").count() == 2
    visitor.check("exported run")
    visitor.page.click(".episodes tbody tr:visible a")
    visitor.has("html[data-step='1']")
    visitor.press("ArrowRight", "h")
    visitor.has("html[data-step='2']")
    visitor.check("exported episode")
    visitor.check_with_axe("exported episode")


def test_an_exported_run_is_hosted_under_a_path(
    visitor: Visitor, runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    export_site(Library([runs], [pack.folder]).run("sweep"), tmp_path / "some" / "place", render_service)
    asked: list[tuple[int, str]] = []
    visitor.page.on("response", lambda answer: asked.append((answer.status, answer.url)))
    with hosted(tmp_path) as base:
        visitor.page.goto(f"{base}/some/place/")
        visitor.page.locator("svg a rect.FR").first.click()
        visitor.page.wait_for_url("**label=FR")
        visitor.page.click(".episodes tbody tr:visible a")
        visitor.has("html[data-noted='1']")
        assert "equal to the recorded frame" in visitor.text("#frame-note")
        while visitor.page.locator("#after").count():
            before = visitor.page.url
            visitor.press("]")
            visitor.page.wait_for_url(lambda url, before=before: url.partition("#")[0] != before.partition("#")[0])
            visitor.has("html[data-noted='1']")
        visitor.page.click(".crumbs a")
        visitor.has("table.episodes")
        visitor.check("hosted site")
    pages = {url.partition("#")[0].removeprefix(f"{base}/some/place/") for status, url in asked if "data:" not in url}
    assert {status for status, _ in asked} <= {200, 304}
    first, *rest = (f"episodes/{episode.id}.1.html" for episode in sorted(pack.episodes, key=lambda each: each.id))
    assert pages <= {"", "index.html", first, *rest}
    assert len(pages) > 3


@contextmanager
def hosted(folder: Path) -> Iterator[str]:
    """Any web server there is."""
    handler = partial(SimpleHTTPRequestHandler, directory=str(folder))
    handler.log_message = lambda *_: None  # type: ignore[attr-defined]
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def test_the_browser_plays_the_mp4(visitor: Visitor, view: Site, pack: Pack, tmp_path: Path) -> None:
    episode = f"/runs/sweep/episodes/{pack.episodes[0].id}/1"
    (tmp_path / "film.mp4").write_bytes(view.get(f"{episode}/export.mp4").body)
    (tmp_path / "frame.png").write_bytes(view.get(f"{episode}/frames/2.png").body)
    (tmp_path / "index.html").write_text('<link rel="icon" href="data:,"><video muted></video>')
    with hosted(tmp_path) as base:
        visitor.page.goto(base)
        told = visitor.page.evaluate(FILM, 1.5 * STEP_S)
    assert (told["width"], told["height"]) == (1120, 616)
    assert abs(told["duration"] - (5 * STEP_S + LAST_S)) < 0.15
    assert max(abs(one - other) for one, other in zip(told["film"], told["frame"], strict=True)) <= 8
    assert visitor.faults == []


def test_a_frame_that_is_not_the_recorded_one_is_said_so(
    visitor: Visitor, runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(runs / "sweep", tmp_path / "run", ignore=shutil.ignore_patterns("frames")))
    rows = folder / "episodes.jsonl"
    second = read_records(rows)[0].steps[1].frame_sha256
    rows.write_text(rows.read_text().replace(str(second), "0" * 64))
    with served(make_view(Library([folder], [pack.folder]), render_service)) as site:
        visitor.page.goto(f"{site.url}/runs/run/episodes/{pack.episodes[0].id}/1")
        visitor.has("html[data-noted='1']")
        assert visitor.text("#frame-note").startswith("Drawn again from the recorded actions; equal")
        assert not visitor.page.locator("#frame-note.warn").count()
        visitor.press("ArrowRight")
        visitor.has("html[data-noted='2']")
        assert "NOT equal to the recorded frame" in visitor.text("#frame-note.warn")
        visitor.check("frame that differs")


def test_a_frame_that_cannot_be_drawn_says_why(
    visitor: Visitor, runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(runs / "random", tmp_path / "run"))
    header = json.loads((folder / "run.json").read_text())
    header["spec"]["asset_database_sha256"] = "0" * 64
    (folder / "run.json").write_text(json.dumps(header))
    claim(folder)
    with served(make_view(Library([folder], [pack.folder]), render_service)) as site:
        visitor.page.goto(f"{site.url}/runs/run/episodes/{pack.episodes[0].id}/1")
        visitor.has("html[data-noted='1']")
        assert "--assets" in visitor.text("#no-frame")
        assert visitor.page.is_visible("#no-frame")
        visitor.faults = [fault for fault in visitor.faults if "400 (Bad Request)" not in fault]  # the picture itself
        visitor.check("frame that cannot be drawn")
