"""Another site, open in the same browser, that tries to read and to post to the pages on loopback."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from tests.support.web_server import Site, served
from vigil.packs.pack import Pack
from vigil.runner.workers.messages import RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.play import PlaySession, PlaySettings, make_play, open_play_session
from vigil.web.review import ReviewSession, ReviewSet, make_review

ATTACK = """async ([base, path, body]) => {
  const told = [];
  const attempt = async (name, deed) => {
    try { told.push([name, await deed()]); } catch { told.push([name, "refused"]); }
  };
  const post = (headers, mode) => () =>
    fetch(base + path, { method: "POST", mode, headers, body, credentials: "include" }).then((answer) => answer.type === "opaque" ? "opaque" : answer.text());
  await attempt("json", post({ "Content-Type": "application/json" }, "cors"));
  await attempt("text", post({ "Content-Type": "text/plain" }, "cors"));
  await attempt("blind text", post({ "Content-Type": "text/plain" }, "no-cors"));
  await attempt("blind form", post({ "Content-Type": "application/x-www-form-urlencoded" }, "no-cors"));
  await attempt("beacon", () => navigator.sendBeacon(base + path, new Blob([body], { type: "text/plain" })) && "opaque");
  await attempt("read", () => fetch(base + "/").then((answer) => answer.text()));
  await attempt("read state", () => fetch(base + "/state").then((answer) => answer.text()));
  const load = (tag, url) => () => new Promise((done, fail) => {
    const node = Object.assign(document.createElement(tag), { src: url, onload: () => done("loaded"), onerror: fail });
    document.body.append(node);
  });
  await attempt("script", load("script", base + "/static/play.js"));
  await attempt("picture", load("img", base + "/static/icon.svg"));
  for (const kind of ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data"]) {
    const hole = Object.assign(document.createElement("iframe"), { name: "hole" + kind.length });
    const form = Object.assign(document.createElement("form"), { method: "POST", action: base + path, enctype: kind, target: hole.name });
    const field = Object.assign(document.createElement("input"), { name: body.slice(0, -1) + ', "x": "', value: '"}' });
    form.append(field);
    document.body.append(hole, form);
    form.submit();
  }
  await new Promise((done) => setTimeout(done, 400));
  return told;
}"""  # noqa: E501


class Page(BaseHTTPRequestHandler):
    """An empty page of another site."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>evil</title><body></body>")

    def log_message(self, format: str, *args: Any) -> None:
        """Says nothing."""


@pytest.fixture
def elsewhere() -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Page)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@contextmanager
def attacked(chromium: Any, elsewhere: str, site: Site, path: str, body: dict[str, Any]) -> Iterator[None]:
    """Attacks a site from another page of a browser in which the site itself is open too."""
    context = chromium.new_context()
    try:
        context.new_page().goto(site.url)
        page = context.new_page()
        page.goto(elsewhere)
        told = dict(page.evaluate(ATTACK, [site.url, path, json.dumps(body)]))
        assert set(told.values()) <= {"refused", "opaque"}, told
        assert told["json"] == told["text"] == told["read"] == told["script"] == told["picture"] == "refused"
        yield
    finally:
        context.close()


@pytest.fixture
def play_session(pack: Pack, tmp_path: Path) -> Iterator[PlaySession]:
    settings = PlaySettings(player="ada", pack=pack.folder, log_dir=tmp_path / "run", backend="fake", limit=1)
    play_session = open_play_session(settings)
    yield play_session
    play_session.close()


def test_another_site_cannot_play(chromium: Any, elsewhere: str, play_session: PlaySession) -> None:
    with served(make_play(play_session)) as site:
        begun = json.loads(site.post("/next", "{}").body)
        reply = '{"skill_name": "report", "arguments": {"status": "fail", "summary": "mine"}}'
        with attacked(chromium, elsewhere, site, "/reply", {"moment": begun["moment"], "text": reply}):
            now = json.loads(site.get("/state").body)
            assert now["is_on"]
            assert now["moment"] == begun["moment"]


def test_another_site_cannot_begin_an_episode(chromium: Any, elsewhere: str, play_session: PlaySession) -> None:
    with served(make_play(play_session)) as site, attacked(chromium, elsewhere, site, "/next", {}):
        assert json.loads(site.get("/state").body)["is_on"] is False


def test_another_site_cannot_review(
    chromium: Any, elsewhere: str, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    session = ReviewSession(
        ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    path = f"/episodes/{session.queue[0].id}/verdict"
    with (
        served(make_review(session, render_service)) as site,
        attacked(chromium, elsewhere, site, path, {"verdict": "approve"}),
    ):
        assert not session.path.exists()


@pytest.mark.parametrize("name", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "localhost.evil", ""])
def test_a_name_that_was_bound_anew_is_refused(name: str, play_session: PlaySession) -> None:
    """The page of a stranger whose name now leads to loopback is of the same origin for the browser."""
    with served(make_play(play_session)) as site:
        assert site.get("/", Host=name).status in (400, 421)
        assert site.get("/state", Host=name).status in (400, 421)
        answer = site.post("/next", "{}", Host=name, Origin=f"http://{name}")
        assert answer.status in (400, 403, 421)
        assert json.loads(site.get("/state").body)["is_on"] is False


def test_a_page_of_another_port_is_another_site(play_session: PlaySession) -> None:
    with served(make_play(play_session)) as site:
        for origin in ("http://127.0.0.1:1", "http://localhost", f"https://evil.example:{site.port}", "null"):
            assert site.post("/next", "{}", Origin=origin).status in (403, 415), origin
        for kind in ("cross-site", "same-site"):
            assert site.post("/next", "{}", Sec_Fetch_Site=kind).status == 403
            assert site.get("/state", Sec_Fetch_Site=kind, Sec_Fetch_Mode="cors").status == 403
            assert site.get("/", Sec_Fetch_Site=kind, Sec_Fetch_Mode="navigate").status == 200
        assert site.post("/next", "{}", Origin=site.url, Sec_Fetch_Site="same-origin").status == 200
