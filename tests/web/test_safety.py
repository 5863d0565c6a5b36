"""What the pages must not do: read elsewhere, run a model's text, answer strangers."""

import json
import shutil
from pathlib import Path

import pytest

from tests.support.quick_runs import claim
from tests.support.web_server import Site, served
from vigil.errors import SettingError
from vigil.packs.pack import Pack
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.site import Address
from vigil.web.view import make_view

EVIL = "</script><script>window.evil=1</script><img src=x onerror=window.evil=1>"
SECRET = "the secret of another folder"
ESCAPES = (
    "/static/../../pack.py",
    "/static/..%2f..%2fpack.py",
    "/static/%2e%2e/%2e%2e/pack.py",
    "/static/..%5c..%5cpack.py",
    "/static//etc/passwd",
    "/runs/../../../../etc/passwd",
    "/runs/..%2f..%2fsecret",
    "/runs/%2e%2e",
    "/runs/sweep/episodes/..%2f..%2f..%2fsecret/1",
    "/runs/sweep/episodes/tiny-DA-000/1/frames/..%2f..%2f..%2frun.json",
    "/houses/tiny/..%2f..%2fmanifest",
    "/houses/tiny/../manifest.json",
    "/houses/..%2ftiny/tiny",
    "/packs/..%2ftiny",
    "/packs/tiny/starts/..%2f..%2fmanifest.png",
)


def test_paths_lead_nowhere_else(view: Site) -> None:
    for path in ESCAPES:
        answer = view.get(path)
        assert answer.status in (400, 404, 422), (path, answer.status)
        assert b"root:" not in answer.body
        assert b"import" not in answer.body


@pytest.fixture
def trap(runs: Path, tmp_path: Path) -> Path:
    """A folder of runs whose links and hashes point out of it."""
    secret = tmp_path / "elsewhere"
    shutil.copytree(runs / "sweep", secret / "sweep")
    (secret / "secret.png").write_text(SECRET)
    root = tmp_path / "root"
    shutil.copytree(runs / "sweep", root / "frames_link")
    row = json.loads((root / "frames_link" / "episodes.jsonl").read_text().splitlines()[0])
    sha256 = row["steps"][0]["frame_sha256"]
    picture = root / "frames_link" / "frames" / sha256[:2] / f"{sha256}.png"
    picture.unlink()
    picture.symlink_to(secret / "secret.png")
    shutil.copytree(runs / "sweep", root / "rows_link")
    (root / "rows_link" / "episodes.jsonl").unlink()
    (root / "rows_link" / "episodes.jsonl").symlink_to(secret / "sweep" / "episodes.jsonl")
    (root / "whole_link").symlink_to(secret / "sweep")
    shutil.copytree(runs / "sweep", root / "bad_hash")
    rows = (root / "bad_hash" / "episodes.jsonl").read_text().replace(sha256, "../../../elsewhere/secret")
    (root / "bad_hash" / "episodes.jsonl").write_text(rows)
    return root


def test_links_out_of_a_folder_are_not_followed(trap: Path, pack: Pack, render_service: RenderService) -> None:
    library = Library([trap], [pack.folder])
    with served(make_view(library, render_service)) as site:
        found = {run.slug: run for run in library.runs()}
        assert set(found) == {"frames_link", "rows_link", "bad_hash"}
        assert "link that leads out of" in found["rows_link"].fault
        answers = [
            site.get(f"/runs/{slug}/episodes/{pack.episodes[0].id}/1/frames/1.png")
            for slug in ("frames_link", "bad_hash")
        ]
        assert all(SECRET not in answer.text for answer in answers)
        assert answers[0].body.startswith(b"\x89PNG")
        assert answers[1].status == 404
        assert "frame_sha256: String should match" in found["bad_hash"].notes[0]
        for path in ("/", "/runs/rows_link"):
            assert SECRET not in site.get(path).text


@pytest.fixture
def hostile(runs: Path, tmp_path: Path) -> Path:
    """A run in which every text that a model writes holds a script."""
    folder = tmp_path / "runs" / "<script>window.evil=1<"
    shutil.copytree(runs / "random", folder)
    lines = []
    reply = {"skill_name": "report", "arguments": {"status": EVIL, "summary": EVIL}, "thought": EVIL}
    for line in (folder / "episodes.jsonl").read_text().splitlines():
        row = json.loads(line)
        step = {**row["steps"][0], "invalid": None, "effect": None, "index": 1}
        step["reply"] = {"text": json.dumps({**reply, "cognitive_state": {EVIL: EVIL}}), "finish_reason": EVIL}
        step["action"] = {"skill_name": "report", "status": "invalid", "summary": EVIL, "raw_status": EVIL}
        lines.append(json.dumps({**row, "steps": [step], "end": "report"}))
    (folder / "episodes.jsonl").write_text("\n".join(lines) + "\n")
    header = json.loads((folder / "run.json").read_text())
    header["spec"]["agent"] = header["renderer"] = EVIL
    (folder / "run.json").write_text(json.dumps(header))
    claim(folder)
    return folder.parent


def test_a_models_text_is_never_html(hostile: Path, pack: Pack, render_service: RenderService) -> None:
    library = Library([hostile], [pack.folder])
    (run,) = library.runs()
    with served(make_view(library, render_service)) as site:
        episode = f"/runs/{run.slug}/episodes/{pack.episodes[0].id}/1"
        for path in (
            "/",
            f"/runs/{run.slug}",
            episode,
            f"{episode}/export.html",
            f"/compare?a={run.slug}&b={run.slug}",
        ):
            answer = site.get(path)
            assert answer.status == 200, path
            assert "<script>window.evil" not in answer.text, path
            assert "<img src=x" not in answer.text, path


def test_a_hostile_instruction_and_names_in_the_address_are_text(view: Site) -> None:
    answer = view.get("/runs/%3Cscript%3Ewindow.evil=1%3C%2Fscript%3E")
    assert answer.status == 404
    assert "<script>window" not in answer.text
    assert "<script>window" not in view.get("/?family=%3Cscript%3Ewindow.evil%3C/script%3E").text


def test_every_answer_carries_the_policy(view: Site) -> None:
    for path in ("/", "/runs/sweep", "/nothing", "/static/vigil.css"):
        policy = view.get(path).headers["content-security-policy"]
        assert "script-src 'self'" in policy
        assert "unsafe" not in policy
    assert view.get("/openapi.json").status == 404
    assert view.get("/docs").status == 404


def test_other_sites_and_names_are_refused(view: Site) -> None:
    assert view.get("/", Host="evil.example").status == 421
    walk = "/houses/tiny/tiny/walk"
    assert view.post(walk, "{}", Origin="http://evil.example").status == 403
    assert view.post(walk, "{}", Origin="null").status in (403, 415)
    assert view.ask("POST", walk, b"{}", {"Content-Type": "text/plain"}).status == 415
    assert view.post(walk, "x" * 300_000).status == 415


def test_another_address_needs_a_token(pack: Pack, runs: Path, render_service: RenderService) -> None:
    library = Library([runs], [pack.folder])
    for token in ("", "short"):
        with pytest.raises(SettingError, match="--token"):
            make_view(library, render_service, Address("0.0.0.0", token=token))
    with served(make_view(library, render_service, Address("0.0.0.0", token="correct horse"))) as site:
        assert site.get("/").status == 401
        assert site.get("/static/vigil.css").status == 401
        assert site.get("/?token=wrong").status == 401
        assert site.get("/", Cookie="vigil_token=wrong").status == 401
        opened = site.get("/?token=correct+horse&family=PG")
        assert opened.status == 303
        assert opened.headers["location"] == "/?family=PG"
        assert "httponly" in opened.headers["set-cookie"].lower()
        cookie = opened.headers["set-cookie"].partition(";")[0]
        assert site.get("/", Cookie=cookie).status == 200
        assert site.get("/", Authorization="Bearer correct horse").status == 200
        assert site.get("//evil.example/?token=correct+horse").headers.get("location", "/").startswith("/")
        assert not site.get("//evil.example/?token=correct+horse").headers.get("location", "/x").startswith("//")
