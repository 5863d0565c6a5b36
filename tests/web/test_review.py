"""The auditor's pages: verdicts on disk at once, two reviewers compared, drafts reviewed and built into a pack."""

import json
import re
from pathlib import Path

import pytest

from tests.support.web_server import Site, served
from vigil.authoring.drafting.drafts import Draft, DraftFacts, DraftsFile, FamilyDone, Header
from vigil.authoring.packing.assemble import assemble
from vigil.authoring.packing.requests import PackRequest
from vigil.authoring.review.reviews import read_reviews
from vigil.errors import SettingError
from vigil.packs.files import HOUSES
from vigil.packs.pack import Pack, find_pack
from vigil.protocol.house import House
from vigil.runner.workers.messages import RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.review import ReviewSession, ReviewSet, make_review


def judge(site: Site, episode_id: str, verdict: str, **more: str) -> dict:
    answer = site.post(f"/episodes/{episode_id}/verdict", json.dumps({"verdict": verdict, **more}))
    assert answer.status == 200, answer.text
    return json.loads(answer.body)


def test_a_verdict_is_on_disk_when_the_page_says_so(pack: Pack, render_service: RenderService, tmp_path: Path) -> None:
    session = ReviewSession(
        ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    first, second = session.queue[0].id, session.queue[1].id
    with served(make_review(session, render_service)) as site:
        assert judge(site, first, "approve")["judgement"] == "approve"
        assert [review.verdict for review in read_reviews(session.path)] == ["approve"]
        before = session.path.read_bytes()
        session.path.write_bytes(before + b'{"at": "2026')  # what a crash leaves
        assert judge(site, second, "edit", instruction="Say it so.")["instruction"] == "Say it so."
        assert session.path.read_bytes().startswith(before)
        assert judge(site, first, "reject", text="No.") == {
            "judgement": "reject",
            "instruction": None,
            "target_size": None,
            "notes": ["No."],
        }
        for body in ({"verdict": "edit"}, {"verdict": "note"}, {"verdict": "praise"}, {"verdict": "approve", "x": 1}):
            assert site.post(f"/episodes/{first}/verdict", json.dumps(body)).status in (400, 422)
        assert site.post("/episodes/nothing/verdict", '{"verdict": "approve"}').status == 404
    assert [review.verdict for review in read_reviews(session.path)] == ["approve", "edit", "reject"]


def test_who_reviews_gets_no_page_of_runs_or_packs(pack: Pack, render_service: RenderService, tmp_path: Path) -> None:
    session = ReviewSession(ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada")
    first = f"/packs/tiny/starts/{pack.episodes[0].id}.png"
    with served(make_review(session, render_service)) as site:
        for path in ("/packs", "/packs/tiny", first, "/runs/run", "/runs/run/status", "/houses", "/compare"):
            assert site.get(path).status == 404, path


def test_two_reviewers_are_compared(pack: Pack, render_service: RenderService, tmp_path: Path) -> None:
    path = tmp_path / "reviews.jsonl"
    desks = {
        name: ReviewSession(ReviewSet.of_pack(pack), path, name, render_settings=RenderSettings("fake"))
        for name in ("ada", "bob")
    }
    said = {"ada": ["approve", "approve", "reject", "reject"], "bob": ["approve", "reject", "reject", "reject"]}
    text = ""
    for name, session in desks.items():
        with served(make_review(session, render_service)) as site:
            for episode, verdict in zip(session.queue, said[name], strict=False):
                judge(site, episode.id, verdict)
            text = site.get("/").text
    assert "4 of 8 judged by bob" in text
    assert "4 episodes judged by both, 3 with the same verdict; Cohen's κ 0.50" in text
    disputed = text.partition("Agreement with ada")[2].partition("</section>")[0]
    assert re.findall(r'href="/episodes/([^"]+)"', disputed) == [desks["bob"].queue[1].id]


def test_the_queue_takes_the_families_in_turn(pack: Pack, render_service: RenderService, tmp_path: Path) -> None:
    session = ReviewSession(
        ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    with served(make_review(session, render_service)) as site:
        shown = re.findall(r'<th scope="row" class="name"><a href="/episodes/tiny-(\w\w)-', site.get("/").text)
    assert shown == ["PG", "DA", "SV", "AI"] * 2


def test_the_solution_is_a_strip_of_pictures(pack: Pack, render_service: RenderService, tmp_path: Path) -> None:
    session = ReviewSession(
        ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    path = f"/episodes/{session.queue[0].id}"
    with served(make_review(session, render_service)) as site:
        data = json.loads(re.findall(r'id="data">(.*?)</script>', site.get(path).text)[0])
        assert data["steps"] == [{"words": "report success", "click": None}]
        assert site.get(f"{path}/solution/1.png").body.startswith(b"\x89PNG")
        assert site.get(f"{path}/around/7.png").body.startswith(b"\x89PNG")
        for missing in ("solution/0.png", "solution/2.png", "around/8.png", "solution/..%2f..%2fmanifest.png"):
            assert site.get(f"{path}/{missing}").status in (404, 422), missing


@pytest.fixture(scope="module")
def drafts(tmp_path_factory: pytest.TempPathFactory) -> DraftsFile:
    """Drafts of one family, made of the starter pack's episodes."""
    starter = Pack.load(find_pack("starter"))
    chosen = [episode for episode in starter.episodes if episode.family == "PG"][:4]
    file = DraftsFile(tmp_path_factory.mktemp("drafts") / "drafts.jsonl")
    facts = DraftFacts(category="Mug", rooms=1, area_m2=20.0, distance_m=1.0, is_seen_by_turning=True)
    with file.writing(Header(author="test", seed=0, simulator="fake", per_house=1, tried=1)) as writer:
        for episode in chosen:
            provenance = episode.provenance.model_copy(update={"reviewed": None})
            fresh = episode.model_copy(update={"provenance": provenance})
            draft = Draft(kind="", episode=fresh, actions=starter.solutions[episode.id].actions, facts=facts)
            house = House.load(starter.folder / HOUSES / f"{episode.house.name}.json")
            writer.add(house, [draft, FamilyDone(family="PG", house=house.name, kept=1, rejected={}, seconds=0.0)])
    return file


def test_reviewed_drafts_become_a_pack(drafts: DraftsFile, render_service: RenderService, tmp_path: Path) -> None:
    session = ReviewSession(
        ReviewSet.of_drafts(drafts.path), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    rejected, edited, *others = (episode.id for episode in session.queue)
    with served(make_review(session, render_service)) as site:
        assert "Review of drafts.jsonl" in site.get("/").text
        page = site.get(f"/episodes/{edited}")
        assert page.status == 200, page.text
        assert site.get(f"/episodes/{edited}/solution/1.png").body.startswith(b"\x89PNG")
        judge(site, rejected, "reject", text="Ambiguous.")
        judge(site, edited, "edit", instruction="Point at it, please.")
        judge(site, edited, "target_size", target_size="small")
        for name in (edited, *others):
            judge(site, name, "approve")
    wish = PackRequest("reviewed", 3, families=("PG",))
    built, bad = assemble(tmp_path / "pack", [drafts], read_reviews(session.path), wish, lambda chosen: {})
    assert not bad
    assert {episode.id for episode in built.episodes} == {edited, *others}
    assert built.episode(edited).instruction == "Point at it, please."
    assert built.episode(edited).target_size == "small"
    assert {episode.provenance.reviewed for episode in built.episodes} == {"approved"}


def test_drafts_that_are_not_there_are_named(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"no\.jsonl' does not exist"):
        ReviewSet.of_drafts(tmp_path / "no.jsonl")
    file = DraftsFile(tmp_path / "empty.jsonl")
    with file.writing(Header(author="test", seed=0, simulator="fake", per_house=1, tried=1)):
        pass
    with pytest.raises(SettingError, match="does not have drafts yet"):
        ReviewSet.of_drafts(file.path)
