"""Where changes of B come from, events over models, and progress at false success, from rows counted by hand."""

import pytest

from tests.support.published_runs import EpisodeScript, Write, good, make_episodes, small_records
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.tables.sources_of_change import event_reductions, false_success_progress, gain_sources
from vigil.protocol.families import Family
from vigil.protocol.profile import ACTION_FEEDBACK, Profile

FEEDBACK = Profile(name=ACTION_FEEDBACK)
BASE = {"PG": (True, "NR"), "DA": (False, "success"), "VS": (True, "success"), "AI": (True, "success")}
OTHER = {"PG": (True, "success"), "DA": (True, "success"), "VS": (True, "NR"), "AI": (False, "success")}
"""Family -> W and end, before and after; the four families show the four ways in which B changes."""


def script(ends: dict[str, tuple[bool, str]], family: Family) -> EpisodeScript:
    return EpisodeScript(family, *ends[family]) if family in ends else good(family)


@pytest.fixture
def paired(write: Write) -> Study:
    base = write("base", small_records(lambda family: script(BASE, family)))
    other = write("other", small_records(lambda family: script(OTHER, family)), profile=FEEDBACK)
    return study(read_runs([base, other]))


def test_each_change_of_b_has_one_source(paired: Study) -> None:
    (row,) = gain_sources(paired).rows
    of_family = len(make_episodes(2)) // 8
    counts = {name: row.cells[name] for name in ("closed", "reached", "unclosed", "lost")}
    assert counts == dict.fromkeys(counts, of_family)
    assert row.cells["n"] == 8 * of_family


def test_the_parts_add_up_to_the_change(write: Write) -> None:
    base = write("base", small_records(lambda family: script(BASE, family)))
    good = write("other", small_records(), profile=FEEDBACK)
    (row,) = gain_sources(study(read_runs([base, good]))).rows
    closure, goals, both = (row.cells[name][0] for name in ("closure", "goals", "both"))
    assert (closure, goals, both) == pytest.approx((12.5, 12.5, 25.0))


def test_without_a_pair_no_change_has_a_source(write: Write) -> None:
    assert gain_sources(study(read_runs([write("alone")]))).rows == ()


def test_reductions_count_models_with_fewer_events(write: Write) -> None:
    found = study(read_runs([write("alone")]), with_paper=True)
    rows = {row.cells["model"]: dict(row.cells) for row in event_reductions(found).rows}
    assert found.published is not None
    printed = [row for _, row in found.published.rows("proprio_minimal")]
    for event, cells in rows.items():
        changes = [100 * (after / before - 1) for before, after in (row[event] for row in printed) if before]
        assert cells["models"] == len(changes)
        assert cells["fewer"] == sum(change < 0 for change in changes)
        assert (cells["lowest"], cells["highest"]) == pytest.approx((min(changes), max(changes)))
    assert set(rows) == {"too_far", "path_blocked", "retry"}


def test_progress_is_counted_at_false_success_only(write: Write) -> None:
    def ends(family: Family) -> EpisodeScript:
        return EpisodeScript(family, False, "success" if family in ("SI", "SM") else "NR", advanced=family == "SM")

    (row,) = false_success_progress(study(read_runs([write("false", small_records(ends))]))).rows
    of_family = len(make_episodes(2)) // 8
    assert (row.cells["FS"], row.cells["without"]) == (2 * of_family, 0)
    assert row.cells["share 0"][0] == pytest.approx(50.0)
    shares = [row.cells[f"share {name}"][0] for name in ("0", "to 25", "to 50", "to 75", "above 75")]
    assert sum(shares) == pytest.approx(100.0)
    assert row.cells["median"] == pytest.approx(row.cells["mean"])
    assert row.cells["mean"] > 0.0
