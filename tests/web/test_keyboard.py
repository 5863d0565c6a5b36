"""Every page by the keyboard alone: each control is reached by Tab, is seen to have the focus, and works."""

from pathlib import Path

from tests.support.browser_page import Visitor
from tests.support.web_server import Site, served
from vigil.authoring.review.reviews import read_reviews
from vigil.packs.pack import Pack
from vigil.records.record_file import read_records
from vigil.runner.workers.messages import RenderSettings
from vigil.web.drawing import RenderService
from vigil.web.play import PlaySettings, make_play, open_play_session
from vigil.web.review import ReviewSession, ReviewSet, make_review


def test_runs_are_sorted_filtered_opened_and_compared(visitor: Visitor, view: Site) -> None:
    page = visitor.page
    page.goto(view.url)
    visitor.press("Tab", "Enter")  # the first stop skips what stands above the content
    assert page.evaluate("location.hash") == "#main"
    visitor.tab_to("thead a[href*='sort=FR']")
    visitor.press("Enter")
    page.wait_for_url("**sort=FR**")
    assert page.locator("th[aria-sort='descending']").count() == 1
    visitor.tab_to("nav.chips a[href*='family=SV']")
    visitor.press("Enter")
    page.wait_for_url("**family=SV**")
    visitor.tab_to("input[name=a]")
    visitor.press("ArrowDown")
    visitor.tab_to("input[name=b]")
    visitor.press("ArrowUp")
    visitor.tab_to("form button")
    visitor.press("Enter")
    page.wait_for_url("**/compare?**")
    visitor.check("comparison")
    visitor.tab_to("main a[href^='/compare']:not(.chips a)")
    before = page.url
    visitor.press("Enter")
    page.wait_for_url(lambda url: url != before)


def test_a_segment_leads_to_an_episode_and_its_hidden_state(visitor: Visitor, view: Site) -> None:
    page = visitor.page
    page.goto(f"{view.url}/runs/sweep")
    visitor.tab_to("svg a")
    visitor.press("Enter")
    page.wait_for_url("**label=**")
    visitor.tab_to(".episodes tbody a", 200)
    visitor.press("Enter")
    visitor.has("html[data-step='1']")
    visitor.tab_to("#next")
    visitor.press("Enter")
    visitor.has("html[data-step='2']")
    visitor.tab_to("#scrub")
    visitor.press("ArrowRight")
    visitor.has("html[data-step='3']")
    visitor.tab_to("#strip button[data-step='5']")
    visitor.press("Enter")
    visitor.has("html[data-step='5']")
    visitor.tab_to("summary")
    visitor.press("Enter")
    assert page.is_visible("#reply")
    visitor.tab_to("#reveal")
    visitor.press(" ")
    assert page.is_visible("#hidden")
    assert page.is_visible("#verdict")
    visitor.tab_to("a[href$='export.mp4']")
    visitor.check("episode")


def test_a_house_is_walked_and_searched(visitor: Visitor, view: Site) -> None:
    page = visitor.page
    page.goto(f"{view.url}/houses")
    visitor.tab_to("a[href='/houses/tiny/tiny']", 400)
    visitor.press("Enter")
    visitor.has("html[data-moves='1']")
    before = page.get_attribute("#picture", "src")
    visitor.press("ArrowLeft")
    visitor.has("html[data-moves='2']")
    assert page.get_attribute("#picture", "src") != before
    visitor.tab_to("[data-key=f]")
    visitor.press("Enter")
    visitor.has("html[data-moves='3']")
    visitor.tab_to("#find")
    page.keyboard.type("fridge")
    visitor.tab_to("#things button")
    visitor.press("Enter")
    assert page.locator(".plan .found").get_attribute("data-id") == "Fridge|1|2"
    visitor.check("house")


def test_an_episode_is_played(visitor: Visitor, pack: Pack, tmp_path: Path) -> None:
    page = visitor.page
    play_session = open_play_session(
        PlaySettings(
            player="ada", pack=pack.folder, log_dir=tmp_path / "run", backend="fake", families=("AI",), limit=1
        )
    )
    try:
        with served(make_play(play_session)) as site:
            page.goto(site.url)
            visitor.has("html[data-answers='1']")
            assert page.evaluate("document.activeElement.id") == "begin"
            visitor.press("Enter")
            visitor.has("html[data-answers='2']")
            visitor.tab_to("[data-do=forward]")
            visitor.press("Enter")
            visitor.has("html[data-answers='3']")
            visitor.tab_to("#turn")
            page.keyboard.press("Control+A")
            page.keyboard.type("45")
            visitor.tab_to("#drop")  # keys that move are letters for whoever writes a number
            visitor.press("ArrowLeft")
            visitor.has("html[data-answers='4']")
            visitor.press("c", "ArrowDown", "Enter", "ArrowDown", "ArrowDown", "Enter")
            visitor.has("html[data-answers='5']")
            visitor.tab_to("#open-report")
            visitor.press("Enter")
            visitor.press("ArrowDown", "ArrowDown")
            visitor.tab_to("#summary")
            page.keyboard.type("Unsafe: e, w, a and s are letters here.")
            visitor.press("Tab", "Enter")
            visitor.has("html[data-answers='6']")
            assert page.is_visible("#over")
            visitor.check("end")
    finally:
        play_session.close()
    (record,) = read_records(tmp_path / "run" / "episodes.jsonl")
    actions = [step.action.model_dump(exclude_none=True) for step in record.steps if step.action]
    assert actions == [
        {"skill_name": "navigate", "mode": "forward", "magnitude": 1.0},
        {"skill_name": "navigate", "mode": "turn_left", "magnitude": 45.0},
        {"skill_name": "interact_pixel", "intent": "close_access", "x": 320, "y": 256},
        {"skill_name": "report", "status": "unsafe", "summary": "Unsafe: e, w, a and s are letters here."},
    ]


def test_an_episode_is_reviewed(visitor: Visitor, pack: Pack, render_service: RenderService, tmp_path: Path) -> None:
    page = visitor.page
    session = ReviewSession(
        ReviewSet.of_pack(pack), tmp_path / "reviews.jsonl", "ada", render_settings=RenderSettings("fake")
    )
    with served(make_review(session, render_service)) as site:
        page.goto(site.url)
        visitor.tab_to("#go")
        visitor.press("Enter")
        visitor.has("html[data-step='1']")
        visitor.tab_to("#note")
        visitor.press("Enter")
        page.keyboard.type("a note, x and e and 1 in it")
        visitor.press("Enter")
        visitor.has("html[data-saved='1']")
        visitor.press("n", "Escape")
        assert not page.is_visible("#form")
        visitor.tab_to("#reject")
        visitor.press("Enter")
        page.keyboard.type("Two mugs.")
        visitor.tab_to("#form button[type=submit]")
        first = page.url
        visitor.press("Enter")
        page.wait_for_url(lambda url: url != first)
        visitor.press("k")
        page.wait_for_url(first)
        visitor.has("html[data-step='1']")
        assert visitor.text("#judgement") == "reject"
    said = [(review.verdict, review.text) for review in read_reviews(session.path)]
    assert said == [("note", "a note, x and e and 1 in it"), ("reject", "Two mugs.")]
