"""What pages say to people: names of models, packs apart, words for what can be done, help that fits the device."""

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.browser_page import DESKTOP, PHONE
from tests.support.quick_runs import claim
from tests.support.tiny_pack import tiny_pack
from tests.support.web_server import Site, served
from vigil.packs.names import version_words
from vigil.packs.pack import Pack
from vigil.protocol.actions import INTENTS, STATUSES
from vigil.records.record import read_header
from vigil.runner.run_folder import write_header
from vigil.runner.workers.messages import RenderSettings
from vigil.web import phrases
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.play import PlaySettings, make_play, open_play_session
from vigil.web.view import make_view

LONG = "openai-api/local/Qwen/Qwen3-VL-235B-A22B-Thinking-FP8"


@pytest.fixture
def two_packs(
    runs: Path, pack: Pack, run_maker: Callable[..., Path], render_service: RenderService, tmp_path: Path
) -> Iterator[Site]:
    """Runs of two packs; the second is of a model with a long name."""
    other = tiny_pack(tmp_path / "packs" / "other", 4)
    folder = run_maker(tmp_path / "runs" / "long", other, "sweep", frames=False)
    header = read_header(folder)
    spec = header.spec.model_copy(update={"agent": LONG, "agent_kind": "model"})
    write_header(folder, header.model_copy(update={"spec": spec}))
    claim(folder)
    library = Library([runs, tmp_path / "runs"], [pack.folder, other.folder])
    with served(make_view(library, render_service, render_settings=RenderSettings("fake"))) as site:
        yield site


def test_runs_are_ranked_among_those_of_their_pack(two_packs: Site) -> None:
    text = two_packs.get("/?sort=B&dir=desc").text
    parts = text.split("<tbody")[1:]
    ranked = [sorted(re.findall(r'class="name"><a href="/runs/(\w+)"', part)) for part in parts]
    assert sorted(ranked) == [["long"], ["random", "sweep"]]
    chosen = re.findall(r'name="([ab])" value="(\w+)"[^>]*checked', text)
    assert {name for _, name in chosen} == {"random", "sweep"}  # of one pack


def test_one_pack_needs_no_heading(view: Site) -> None:
    assert 'class="group"' not in view.get("/").text


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_long_name_takes_three_lines_at_most(two_packs: Site, chromium: Any, size: dict[str, int]) -> None:
    page = chromium.new_page(viewport=size)
    page.goto(two_packs.url + "/")
    lines = page.evaluate(
        """() => { const link = document.querySelector('a[href="/runs/long"]');
        return new Set([...link.getClientRects()].map((box) => Math.round(box.top))).size }"""
    )
    assert lines <= 3
    assert page.text_content('a[href="/runs/long"]') == LONG
    if size == DESKTOP:
        assert (
            page.evaluate(
                "(() => { const box = document.querySelector('.scroll'); return box.scrollWidth - box.clientWidth })()"
            )
            <= 0
        )
    page.close()


def test_every_intent_and_status_has_words_for_people() -> None:
    assert set(phrases.INTENTS) == set(INTENTS)
    assert set(phrases.STATUSES) == set(STATUSES)
    said = " ".join((*phrases.INTENTS.values(), *phrases.STATUSES.values()))
    assert not re.search(r"ground|access|_|[Aa]gent", said)


def test_help_on_keys_is_for_those_who_have_keys(chromium: Any, pack: Pack, tmp_path: Path) -> None:
    settings = PlaySettings(pack=pack.folder, player="ada", backend="fake", log_dir=tmp_path / "run")
    play_session = open_play_session(settings)
    try:
        with served(make_play(play_session)) as site:
            for size, has_keys in ((DESKTOP, True), (PHONE, False)):
                page = chromium.new_page(viewport=size)
                page.goto(site.url + "/")
                page.wait_for_selector("#begin", state="visible")
                shown = page.inner_text("#lobby")
                assert ("Shift" in shown) is has_keys
                assert ("tap" in shown) is not has_keys
                assert (page.locator("kbd:visible").count() > 0) is has_keys
                assert "open_access" not in shown
                page.close()
            menu = site.get("/").text
            assert "put here what I hold" in menu
            assert "open access" not in menu
    finally:
        play_session.close()


def test_the_viewer_shows_keys_only_to_those_who_have_keys(chromium: Any, view: Site, pack: Pack) -> None:
    for size, has_keys in ((DESKTOP, True), (PHONE, False)):
        page = chromium.new_page(viewport=size)
        page.goto(view.url + f"/runs/sweep/episodes/{pack.episodes[0].id}/1")
        page.wait_for_selector("text=Show hidden state")
        assert (page.locator("kbd:visible").count() > 0) is has_keys
        page.close()


def test_a_picture_says_that_it_is_being_drawn(view: Site) -> None:
    text = view.get("/packs/tiny").text
    assert text.count('<span class="drawn"><img') == text.count("<img") > 0


def test_the_facts_of_a_step_say_what_they_are_about(chromium: Any, view: Site, pack: Pack) -> None:
    page = chromium.new_page(viewport=DESKTOP)
    page.goto(view.url + f"/runs/sweep/episodes/{pack.episodes[0].id}/1#step=1&hidden")
    page.wait_for_selector("#now dt", state="attached")
    names = page.locator("#now dt").all_text_contents()
    assert names[:2] == ["what the action did", "goal after this step"]
    assert not {"effect", "after it", "target then"} & set(names)
    page.close()


def test_a_note_below_a_table_keeps_away_from_it(chromium: Any, view: Site) -> None:
    page = chromium.new_page(viewport=DESKTOP)
    page.goto(view.url + "/compare?a=random&b=sweep")
    gap = page.evaluate(
        """() => { const box = document.querySelector(".scroll"), note = box.nextElementSibling;
        return note.getBoundingClientRect().top - box.getBoundingClientRect().bottom }"""
    )
    assert gap >= 8
    page.close()


@pytest.mark.parametrize(("name", "version"), [("vigil_mini_v6", "6"), ("vigil_smoke_v6", "6"), ("mine", "7")])
def test_a_version_is_the_one_in_the_name(name: str, version: str) -> None:
    assert version_words(name, "7") == version


def test_a_copied_pack_is_no_other_group(two_packs: Site, runs: Path, tmp_path: Path) -> None:
    shutil.copytree(runs / "random", tmp_path / "runs" / "again")
    assert two_packs.get("/").text.count('class="group"') == 2
