"""Pages of runs that go on: what they say while rows are added, and when nobody adds any more."""

import re
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from markupsafe import escape

from tests.support.browser_page import Visitor
from tests.support.web_server import Site, served
from vigil.base.json_lines import dump_line
from vigil.packs.pack import Pack
from vigil.protocol.actions import Usage
from vigil.records.costs import Prices
from vigil.records.record import EpisodeRecord, ErrorFact, read_header
from vigil.records.record_file import RecordLog, read_records
from vigil.runner.run_folder import write_header
from vigil.web.drawing import RenderService
from vigil.web.library import Library
from vigil.web.view import NEWEST_EPISODES, make_view

PRICES = Prices(input=1, output=10)


class GoingRun:
    """A run whose rows are written one by one, by a process that holds its file."""

    def __init__(self, source: Path, folder: Path, usage: Usage | None = None) -> None:
        folder.mkdir(parents=True)
        self.folder = folder
        self.log = RecordLog(folder / "episodes.jsonl")
        self.header = read_header(source).model_copy(update={"run_id": folder.name, "ended": None})
        write_header(folder, self.header)
        rows = read_records(source / "episodes.jsonl")
        self.waiting = [_told(record, usage) for record in rows]

    def play(self, count: int = 1, error: str = "") -> list[EpisodeRecord]:
        played = [self.header.stamp(self.waiting.pop(0)) for _ in range(count)]
        if error:
            fact = ErrorFact(boundary="model", message=error)
            played = [each.model_copy(update={"end": "error", "error": fact, "steps": ()}) for each in played]
        for record in played:
            self.log.append(record)
        return played

    def note(self, **fields: object) -> None:
        self.header = self.header.model_copy(update=fields)
        write_header(self.folder, self.header)


def _told(record: EpisodeRecord, usage: Usage | None) -> EpisodeRecord:
    steps = [step.model_copy(update={"reply": step.reply.model_copy(update={"usage": usage})}) for step in record.steps]
    return record.model_copy(update={"steps": tuple(steps)})


@pytest.fixture
def going(runs: Path, tmp_path: Path) -> Iterator[GoingRun]:
    run = GoingRun(runs / "random", tmp_path / "runs" / "going")
    yield run
    run.log.close()


@pytest.fixture
def site(going: GoingRun, pack: Pack, render_service: RenderService) -> Iterator[Site]:
    with served(make_view(Library([going.folder.parent], [pack.folder]), render_service)) as site:
        yield site


def state(text: str) -> str:
    found = re.search(r'id="live"[^>]* data-state="([^"]*)"', text)
    assert found
    return found.group(1)


def tally(text: str) -> dict[str, str]:
    found = re.search(r'<dl class="tally">(.*?)</dl>', text, re.DOTALL)
    assert found
    cells = re.findall(r"<dt>(.*?)</dt><dd[^>]*>(.*?)</dd>", found.group(1))
    return {re.sub("<[^>]*>", "", name): re.sub("<[^>]*>", "", value) for name, value in cells}


def newest(text: str) -> list[str]:
    table = re.search(r'<table class="newest">(.*?)</table>', text, re.DOTALL)
    return re.findall(r'data-key="(\S+) 1"', table.group(1)) if table else []


def test_the_counts_grow_with_the_rows(going: GoingRun, site: Site, pack: Pack) -> None:
    before = site.get("/runs/going/status").text
    assert (state(before), tally(before)["played"]) == ("in progress", f"0 of {len(pack.episodes)}")
    played = going.play(3)
    (failed,) = going.play(error="no answer")
    text = site.get("/runs/going/status").text
    found = tally(text)
    assert (found["played"], found["errors"]) == (f"4 of {len(pack.episodes)}", "1")
    assert sum(int(found[label]) for label in ("B", "FR", "NR", "IL", "Other")) == 3
    assert newest(text) == [failed.episode_id, *(record.episode_id for record in reversed(played))]
    assert "error at the model" in text
    assert "Rates by family" in text
    assert "How episodes ended" in text


def test_nothing_is_sent_when_nothing_has_changed(going: GoingRun, site: Site) -> None:
    for path in ("/runs/going/status", "/"):
        first = site.get(path)
        assert site.get(path, If_None_Match=first.headers["etag"]).status == 304
        going.play()
        second = site.get(path, If_None_Match=first.headers["etag"])
        assert second.status == 200
        assert f'data-tag="{escape(second.headers["etag"])}"' in second.text


def test_a_run_that_nobody_writes_is_interrupted_until_it_goes_on(going: GoingRun, site: Site) -> None:
    going.play()
    assert state(site.get("/runs/going").text) == "in progress"
    assert 'data-state="in progress"' in site.get("/").text
    going.log.close()
    text = site.get("/runs/going").text
    assert state(text) == "interrupted"
    assert "no process writes to it" in text
    going.log = RecordLog(going.folder / "episodes.jsonl")
    going.note(ended=None)
    assert state(site.get("/runs/going").text) == "in progress"
    going.play(len(going.waiting))
    going.log.close()
    going.note(ended=going.header.started)
    text = site.get("/runs/going/status").text
    assert state(text) == "ended"
    assert newest(text) == []


def test_a_look_at_an_interrupted_run_does_not_keep_it_from_going_on(going: GoingRun, site: Site) -> None:
    going.log.close()
    for _ in range(20):
        assert state(site.get("/runs/going").text) == "interrupted"
        going.log = RecordLog(going.folder / "episodes.jsonl")
        going.log.close()
    going.log = RecordLog(going.folder / "episodes.jsonl")


def cost(library: Library, render_service: RenderService) -> str:
    with served(make_view(library, render_service)) as site:
        text = site.get("/runs/going").text
    found = re.search(r"Cost so far: ([^<]*)\.</p>", text)
    return found.group(1) if found else ""


def test_costs_are_those_of_the_tokens_in_the_records(
    runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    usage = Usage(input_tokens=100_000, output_tokens=10_000)
    going = GoingRun(runs / "random", tmp_path / "runs" / "going", usage)
    library = Library([tmp_path / "runs"], [pack.folder], prices=PRICES)
    plain = Library([tmp_path / "runs"], [pack.folder])
    replies = sum(len(record.steps) for record in going.play(2))
    told = f"{100_000 * replies:,} input and {10_000 * replies:,} output tokens"
    assert cost(plain, render_service) == f"{told}; --prices says what they cost"
    assert cost(library, render_service) == f"{0.2 * replies:,.2f} at {PRICES}: {told}"
    going.note(prices=Prices(input=2, output=0))  # what the run was given counts, not what its reader is given
    assert cost(library, render_service).startswith(f"{0.2 * replies:,.2f} at 2 (input) and 0 (output)")
    going.log.close()


def test_an_episode_that_is_played_again_has_cost_twice(
    runs: Path, pack: Pack, render_service: RenderService, tmp_path: Path
) -> None:
    going = GoingRun(runs / "random", tmp_path / "runs" / "going", Usage(input_tokens=7, output_tokens=0))
    record = going.header.stamp(going.waiting[0])
    fact = ErrorFact(boundary="model", message="gone")
    cut = record.model_copy(update={"end": "error", "error": fact, "steps": record.steps[:2]})
    with (going.folder / "episodes.jsonl").open("ab") as file:
        file.write(dump_line(cut) + dump_line(record))
    library = Library([tmp_path / "runs"], [pack.folder])
    assert cost(library, render_service) == (
        f"{7 * (2 + len(record.steps))} input and 0 output tokens; 14 input and 0 output tokens of them for "
        "attempts that ended as errors and were played again; --prices says what they cost"
    )
    going.log.close()
    with closing(RecordLog(going.folder / "episodes.jsonl")) as log:
        assert (log.tokens.total.input, log.tokens.superseded.input) == (7 * (2 + len(record.steps)), 14)


def test_no_cost_is_told_of_agents_without_tokens(going: GoingRun, site: Site) -> None:
    going.play()
    assert "Cost so far" not in site.get("/runs/going").text
    going.note(prices=PRICES)
    assert "Cost so far: not known: no reply in the records reports its tokens." in site.get("/runs/going").text


def wait_for(visitor: Visitor, selector: str, text: str) -> None:
    """Waits until the page says so, without being loaded again."""
    says = "([where, text]) => document.querySelector(where).textContent.includes(text)"
    visitor.page.wait_for_function(says, arg=[selector, text])


def test_a_page_follows_without_taking_focus_or_scroll(going: GoingRun, site: Site, visitor: Visitor) -> None:
    page = visitor.page
    first, *_ = going.play(2)
    page.goto(f"{site.url}/runs/going")
    visitor.check("a run that goes on")
    link = page.locator(f".newest a[href*='{first.episode_id}']")
    link.focus()
    page.evaluate("window.scrollTo(0, 120)")
    page.evaluate("document.querySelector('.newest').parentElement.scrollLeft = 30")
    before = page.evaluate("[scrollY, document.querySelector('.newest').parentElement.scrollLeft]")
    going.play(3)
    wait_for(visitor, ".tally dd", "5 of")
    assert first.episode_id in page.evaluate("document.activeElement.href")
    assert page.evaluate("document.querySelector('.newest').parentElement.scrollLeft") == before[1]
    assert page.locator(".newest tbody tr").count() == 5
    assert page.is_visible("#more")
    assert "3 new episodes" in visitor.text("#more")
    visitor.check("after three more")
    visitor.press("Enter")
    page.wait_for_url(f"**/episodes/{first.episode_id}/1*")


def test_a_focused_row_stays_when_newer_ones_push_it_out(going: GoingRun, site: Site, visitor: Visitor) -> None:
    going.note(spec=going.header.spec.model_copy(update={"epochs": 2}))
    going.waiting += [record.model_copy(update={"epoch": 2}) for record in going.waiting]
    first, *_ = going.play(1)
    visitor.page.goto(f"{site.url}/runs/going")
    visitor.page.locator(".newest tbody a").first.focus()
    going.play(7)
    wait_for(visitor, ".tally dd", "8 of")
    assert visitor.page.locator(".newest tbody tr").count() == NEWEST_EPISODES
    going.play(1)
    wait_for(visitor, ".tally dd", "9 of")
    assert first.episode_id in visitor.page.evaluate("document.activeElement.href")


def test_a_page_stops_asking_when_its_run_has_ended(going: GoingRun, site: Site, visitor: Visitor) -> None:
    page = visitor.page
    going.play(1)
    page.goto(f"{site.url}/runs/going")
    going.play(len(going.waiting))
    going.note(ended=going.header.started)
    wait_for(visitor, "b.state", "Ended")
    asked = page.evaluate("document.documentElement.dataset.asked")
    page.wait_for_timeout(3000)
    assert page.evaluate("document.documentElement.dataset.asked") == asked
    visitor.check("ended")


def test_the_table_of_runs_follows_and_keeps_what_was_chosen(
    going: GoingRun, runs: Path, pack: Pack, render_service: RenderService, visitor: Visitor
) -> None:
    with served(make_view(Library([going.folder, runs], [pack.folder]), render_service)) as site:
        page = visitor.page
        going.play(1)
        page.goto(f"{site.url}/?sort=name&dir=asc")
        page.check("input[name=a][value=sweep]")
        page.check("input[name=b][value=going]")
        going.play(3)
        wait_for(visitor, "tr[data-key=going]", f"4/{len(pack.episodes)}")
        assert page.is_checked("input[name=a][value=sweep]")
        assert page.evaluate("document.activeElement.value") == "going"
        assert page.is_checked("input[name=b][value=going]")
        visitor.check("runs")


def test_a_page_says_when_its_server_is_gone(
    going: GoingRun, pack: Pack, render_service: RenderService, chromium: object
) -> None:
    page = chromium.new_page()  # type: ignore[attr-defined]
    with served(make_view(Library([going.folder], [pack.folder]), render_service)) as site:
        page.goto(f"{site.url}/runs/going")
    page.wait_for_selector("#unheard:not([hidden])")
    assert "no answer from the server" in page.text_content("#unheard")
    page.close()
