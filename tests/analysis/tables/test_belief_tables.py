"""Tables and figures of beliefs, on runs with the beliefs of agents whose beliefs are known."""

from dataclasses import replace

import numpy as np
import pytest

from tests.analysis.plots.test_paper_figures import assert_is_printable
from tests.support.published_runs import Write, small_records
from tools.known_beliefs import AGENTS, study_of
from vigil.analysis.measures.metrics import broken_run_identities
from vigil.analysis.measures.rows import Run, read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.plots.belief_figures import BELIEF_FIGURES, belief_curve, belief_reliability
from vigil.analysis.plots.style import PAPER_WIDTHS_IN, PaperWidth, on_paper
from vigil.analysis.report import html_report, make_report, markdown_report
from vigil.analysis.tables.belief_tables import HEADING, belief_tables
from vigil.protocol.profile import Profile
from vigil.protocol.profiles.rows import PROFILE_NAMES


@pytest.fixture
def believing(write: Write) -> Study:
    runs = read_runs([write(agent.name, agent=f"openai/{agent.name}") for agent in AGENTS[:2]])
    studied = [study_of(agent, 40, np.random.default_rng(2)) for agent in AGENTS[:2]]
    return study([replace(run, beliefs=(one,)) for run, one in zip(runs, studied, strict=True)], with_paper=False)


def test_runs_without_probes_have_no_section(write: Write) -> None:
    plain = study(read_runs([write("plain")]), with_paper=False)
    assert belief_tables(plain) == {}
    assert HEADING not in markdown_report(make_report(plain, ()))
    assert [draw(plain) for draw in BELIEF_FIGURES.values()] == [None] * 3


def test_the_section_has_the_tables_and_the_figures(believing: Study) -> None:
    report = make_report(believing, ("svg",))
    page = markdown_report(report)
    assert f"## {HEADING}" in page
    assert set(BELIEF_FIGURES) <= report.figures.keys()
    assert HEADING in html_report(report)
    partition = belief_tables(believing)["belief_partition"]
    for row, beliefs in zip(partition.rows[1::2], (entry.run.beliefs[0] for entry in believing.entries), strict=True):
        shares = [row.cells[part][0] for part in beliefs.parts]
        nr = 100 * sum(play.outcome.label == "NR" for play in beliefs.plays) / len(beliefs.plays)
        assert sum(shares) == pytest.approx(nr)


@pytest.fixture
def many(believing: Study) -> Study:
    """Two runs of each agent: ten lines in a figure."""
    rng, (entry, _) = np.random.default_rng(3), believing.entries
    runs = [
        replace(entry.run, name=f"{agent.name} {number}", beliefs=(study_of(agent, 40, rng),))
        for number in (1, 2)
        for agent in AGENTS
    ]
    return replace(believing, entries=tuple(replace(entry, run=run) for run in runs))


@pytest.mark.parametrize("width", PAPER_WIDTHS_IN)
def test_the_figures_of_beliefs_fit_a_paper(many: Study, width: PaperWidth) -> None:
    with on_paper(width):
        for name, draw in BELIEF_FIGURES.items():
            figure = draw(many)
            assert figure is not None, name
            assert_is_printable(figure, width)


def test_every_line_and_mark_of_many_runs_is_drawn_in_its_own_way(many: Study) -> None:
    curve, reliability = belief_curve(many), belief_reliability(many)
    assert curve is not None
    assert reliability is not None
    lines = [line for line in curve.axes[0].lines if line.get_marker() == "o"]
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == len(lines) == 10
    marks = [tuple(place) for each in reliability.axes[0].collections for place in np.asarray(each.get_offsets())]
    assert len(set(marks)) == len(marks) > 100
    names = [entry.name for entry in many.entries]
    assert [text.get_text() for figure in (curve, reliability) for text in figure.legends[0].get_texts()] == 2 * names


def test_a_partition_that_does_not_add_up_is_named(believing: Study) -> None:
    run: Run = believing.runs[0]
    assert broken_run_identities(run) == []
    (beliefs,) = run.beliefs
    broken = replace(beliefs)
    broken.__dict__["parts"] = {part: each for part, each in beliefs.parts.items() if part != "believed_wrongly"}
    (fault, *_) = broken_run_identities(replace(run, beliefs=(broken,)))
    assert "the parts of " in fault


def test_a_profile_is_paired_with_the_baseline_and_not_taken_for_feedback(write: Write) -> None:
    look, echo = (Profile(name=PROFILE_NAMES[name]) for name in ("look_before_report", "grounding_echo"))
    runs = [write("base"), write("look", small_records(), profile=look), write("echo", small_records(), profile=echo)]
    found = study(read_runs(runs), with_paper=False)
    pairing = found.pairing
    names = {pair.other.header.spec.profile.row.short for pair in pairing.profile}
    assert (names, pairing.feedback, pairing.refusals) == ({"look_before_report", "grounding_echo"}, (), ())
    assert all(pair.base.header.run_id == "base" for pair in pairing.profile)
    rows = make_report(found, ()).tables["profile_shifts"].rows
    assert {row.cells["profile"] for row in rows} == names
    assert all(row.cells["dW"][0] == 0.0 for row in rows)
    assert [entry.panel for entry in found.entries].count("condition") == 2
