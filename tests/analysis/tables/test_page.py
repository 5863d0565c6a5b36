"""The page in a browser: on a screen, on a phone, in the dark and on paper."""

from pathlib import Path
from typing import Any

import pytest

from tests.support.browser_page import CONTRAST
from tests.support.published_runs import (
    counts_of,
    make_episodes,
    records_of,
    scripts_of,
    write_anchor,
    write_pack,
    write_run,
)
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import study
from vigil.analysis.report import html_report, make_report

PAPER = {"width": 1031, "height": 703}
"""A landscape A4 page within its margins, in CSS pixels."""
LONG_ID, LONG_NAME = "20261122T175442_1a2b3c4d", "openrouter/qwen/qwen3-vl-235b-a22b-thinking"
UNFOLD = (
    "() => { dispatchEvent(new Event('beforeprint')); return document.querySelectorAll('details:not([open])').length; }"
)
TOO_WIDE = """() => [...document.querySelectorAll("section")]
  .filter((section) => section.querySelector("table").offsetWidth > section.clientWidth).map((section) => section.id)"""


@pytest.fixture(scope="module")
def report_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    write_pack(folder / "pack", make_episodes())
    runs = [write_anchor(folder / model, folder / "pack", model) for model in ("GPT-5.4", "Claude-Sonnet-4")]
    records = records_of(scripts_of(counts_of("GPT-5.4")))
    runs.append(write_run(folder / LONG_ID, folder / "pack", LONG_NAME, records, thinking=True))
    page = folder / "report.html"
    page.write_text(html_report(make_report(study(read_runs(runs)))), encoding="utf-8")
    return page


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_word_stands_out_from_its_ground(report_page: Path, chromium: Any, scheme: str):
    page = chromium.new_page(color_scheme=scheme)
    page.goto(report_page.as_uri())
    assert page.evaluate(UNFOLD) == 0
    assert page.evaluate(CONTRAST) == []
    page.close()


@pytest.mark.parametrize("width", [1280, 390])
def test_only_tables_scroll_sideways(report_page: Path, chromium: Any, width: int):
    page = chromium.new_page(viewport={"width": width, "height": 800})
    page.goto(report_page.as_uri())
    assert page.evaluate(UNFOLD) == 0
    assert page.evaluate("document.documentElement.scrollWidth") == width
    if width == 1280:
        assert page.evaluate(TOO_WIDE) == []
    page.close()


def test_no_table_is_cut_off_on_paper(report_page: Path, chromium: Any):
    page = chromium.new_page(viewport=PAPER)
    page.emulate_media(media="print")
    page.goto(report_page.as_uri())
    assert page.evaluate(UNFOLD) == 0
    assert page.evaluate(TOO_WIDE) == []
    page.close()


def test_a_link_unfolds_what_it_leads_to(report_page: Path, chromium: Any):
    page = chromium.new_page(viewport=PAPER)
    page.goto(report_page.as_uri())
    assert not page.is_visible("#family_rates table")
    page.click('nav a[href="#family_rates"]')
    page.wait_for_selector("#family_rates table", state="visible")
    page.goto(f"{report_page.as_uri()}?again#term-holm")
    page.wait_for_selector("#term-holm", state="visible")
    page.close()
