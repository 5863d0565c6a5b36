"""The pages of packs: the list, the strata, the first frames and the card."""

import re
from pathlib import Path

from tests.support.browser_page import Visitor
from tests.support.tiny_pack import tiny_pack
from tests.support.web_server import Site, served
from vigil.agents.frame_encoding import decode_frame
from vigil.authoring.packing.dataset_card import CARD
from vigil.packs.pack import Pack, find_pack, frozen_episodes, manifest_of, manifest_sha256, packaged_names
from vigil.runner.workers.messages import RenderSettings
from vigil.scoring.target_strata import sort_by_size
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.packs import SAMPLES, card_html, family_rows, level_strata, other_strata
from vigil.web.view import make_view


def test_the_packaged_packs_and_those_that_were_given_are_listed(view: Site, pack: Pack) -> None:
    text = view.get("/packs").text
    for name in packaged_names():
        assert f'href="/packs/{name}">{manifest_of(name).name}</a>' in text
    assert 'href="/packs/tiny"' in text
    assert pack.sha256[:12] in text


def test_a_pack_of_the_same_name_as_a_packaged_one_has_its_own_page(
    tmp_path: Path, render_service: RenderService
) -> None:
    tiny_pack(tmp_path / "starter", 4)
    with served(make_view(Library([], [tmp_path / "starter"]), render_service)) as site:
        assert "4 episodes in 1 houses" in site.get("/packs/starter").text
        assert "80 episodes in 24 houses" in site.get("/packs/starter-2").text
        assert site.get("/packs/starter-3").status == 404


def test_a_page_of_a_pack_has_strata_samples_and_a_link_to_houses(view: Site, pack: Pack) -> None:
    text = view.get("/packs/tiny").text
    rows = re.findall(r'<tr><th scope="row"><a href="#(\w+)">\w+</a>.*?<td class="num">(\d+)</td>', text)
    assert rows == [(family, "2") for family in ("PG", "DA", "SV", "AI")]
    starts = re.findall(r'<img src="(/packs/tiny/starts/[^"]+)"[^>]*loading="lazy"', text)
    assert len(starts) == len(pack.episodes) <= SAMPLES * 4
    assert 'href="/houses/tiny/tiny"' in text
    drawn = view.get(starts[0])
    assert drawn.headers["content-type"] == "image/png"
    assert "max-age" in drawn.headers["cache-control"]
    assert decode_frame(drawn.body).shape == (480, 640, 3)
    assert view.get("/packs/tiny/starts/nothing.png").status == 404
    assert view.get("/packs/nothing").status == 404


def test_a_page_of_a_pack_draws_nothing_itself(pack: Pack) -> None:
    class NoDrawing(RenderService):
        def __init__(self) -> None:
            """Starts no process."""

        def picture(self, moment: object) -> bytes:
            raise AssertionError("drawn while the page was made")

    with served(make_view(Library([], [pack.folder]), NoDrawing(), None, RenderSettings("fake"))) as site:
        assert site.get("/packs/tiny").status == 200
        assert site.get("/packs/vigil_balanced_1000_v6").status == 200


def test_strata_are_those_of_the_manifest_where_it_has_them() -> None:
    for name in packaged_names():
        manifest = manifest_of(name)
        rows = family_rows(frozen_episodes(name, manifest_sha256(find_pack(name))), manifest.meta)
        assert {row["family"]: row["episodes"] for row in rows} == manifest.families
        assert all(sum(row["kinds"].values()) in (0, row["episodes"]) for row in rows)
        if "strata" in manifest.meta:
            assert sum(other_strata(manifest.meta)["rooms of the house"].values()) == manifest.episodes


def test_sizes_stand_in_their_order() -> None:
    named = {"3 to 4 m": 4, "over 4 m": 3, "under 3 m": 2}
    assert list(sort_by_size(named)) == ["under 3 m", "3 to 4 m", "over 4 m"]
    assert list(sort_by_size(dict.fromkeys(("large", "medium", "small"), 1))) == ["small", "medium", "large"]
    assert list(sort_by_size({"turn_on": 1, "pick": 2})) == ["pick", "turn_on"]
    assert list(sort_by_size({"1": 1, "10": 1, "2": 1})) == ["1", "2", "10"]  # rooms


def test_levels_stand_among_the_strata_where_a_pack_has_them() -> None:
    packs = Library([], ["vigil_mini", "starter"]).packs
    assert level_strata(packs["vigil_mini_v6"]) == {
        "level of difficulty": {"easy": 24, "medium": 24, "hard": 16, "extreme": 16}
    }
    assert level_strata(packs["starter"]) == {}


def test_a_card_is_text_whatever_is_in_it(tmp_path: Path) -> None:
    assert card_html(tmp_path) is None
    (tmp_path / CARD).write_text(
        "---\nlicense: x\n---\n# Title\n\n<script>window.evil=1</script> [a](javascript:evil)\n\n| a |\n|---|\n| 1 |\n"
    )
    html = str(card_html(tmp_path))
    assert "<script" not in html
    assert "<td>1</td>" in html
    assert "<h3>Title</h3>" in html
    assert "license" not in html
    assert 'href="javascript' not in html
    outside = tmp_path / "pack"
    outside.mkdir()
    (outside / CARD).symlink_to(tmp_path / CARD)
    assert card_html(outside) is None


def test_packs_in_a_browser(visitor: Visitor, view: Site) -> None:
    page = visitor.page
    page.goto(f"{view.url}/packs")
    visitor.check("packs")
    visitor.tab_to("a[href='/packs/tiny']")
    visitor.press("Enter")
    page.wait_for_url("**/packs/tiny")
    page.locator(".samples img").first.scroll_into_view_if_needed()
    page.wait_for_function("() => document.querySelector('.samples img').naturalWidth === 640")
    visitor.check("a pack")
    page.goto(f"{view.url}/packs/vigil_smoke_v6#card")
    page.wait_for_selector(".card-text table")
    assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]
