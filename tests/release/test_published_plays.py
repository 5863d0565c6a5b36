"""Plays that are published with the docs open as runs, with the verdicts that readers got."""

import shutil
from functools import cache
from pathlib import Path

import pytest

from tools.published_plays import publish_plays
from vigil.analysis.measures.chores import score_lists
from vigil.packs.pack import Pack
from vigil.records.record import read_header
from vigil.runner.verify_run import VerifySettings, verify_run
from vigil.scoring.chore_answers import list_answers
from vigil.scoring.saved_run import SavedRun, read_run

PLAYS = Path(__file__).parents[2] / "docs" / "packs" / "plays"
OLD = {
    "vigil_balanced_1000_v2_1": (24, 20, 20),
    "vigil_balanced_1000_v2_2": (24, 20, 15),
    "vigil_closure_400_v1": (19, 13, 13),
    "vigil_closure_400_v2": (24, 21, 21),
    "vigil_closure_400_v3": (25, 19, 17),
    "vigil_mini_v4": (80, 77, 73),
    "vigil_mini_v5": (80, 77, 73),
    "vigil_mini_v4_baseline": (4, 2, 2),
    "vigil_mini_v4_look_before_report": (4, 3, 3),
}
"""Folder with plays of a pack that is not packaged any more -> number of plays, of W and of B."""
PRESENT = {
    "vigil_closure_400_v5": (40, 36, 36),
}
"""The same for plays of packaged packs."""
LISTS = {"vigil_chores_200_v5": (24, 22, 19)}
"""Folder with plays of packaged lists -> number of plays, of W and of B of lists."""
OLD_LISTS = {
    "vigil_chores_200_v2": (8, 4, 3),
    "vigil_chores_200_v3": (24, 21, 17),
    "vigil_chores_200_v4": (17, 14, 14),
    "vigil_chores_200_v4_handed_over": (9, 8, 8),
}
"""Folder with plays of lists that are not packaged any more -> number of plays, of W and of B of lists."""
OTHER_PROMPT = "vigil_chores_200_v2"
"""Folder with plays whose prompt has another text today."""
OLD_UNCOUNTED = ("vigil_mini_v4_stop_only",)
"""Folders with plays to which W and B do not apply, of a pack that is not packaged any more."""

REWORDED = {"vigil_balanced_1000_v2_2": [("vigil_drawer_seed9201_cr_51b504", 6, "invalid")]}
"""Folder -> the rejected replies (episode, step, fact) that are rejected today for the same reason in other words."""


@cache
def published(name: str) -> SavedRun:
    """Return the run of a folder of plays."""
    return read_run(PLAYS / name)


def counts_of(run: SavedRun) -> tuple[int, int, int]:
    """Return the numbers of plays, of W and of B; a list of chores counts as one play."""
    is_of_lists = run.folder.name in {*LISTS, *OLD_LISTS}
    outcomes = list(score_lists(run, list_answers(run.pack_folder))) if is_of_lists else run.table.scores().outcomes
    return len(outcomes), sum(one.W for one in outcomes), sum(one.B for one in outcomes)


def test_every_folder_of_plays_is_counted() -> None:
    assert {path.name for path in PLAYS.iterdir()} == {*OLD, *OLD_LISTS, *OLD_UNCOUNTED, *PRESENT, *LISTS}


@pytest.mark.parametrize("folder", sorted(PLAYS.iterdir()), ids=lambda folder: folder.name)
def test_plays_lie_within_the_times_of_their_run(folder: Path) -> None:
    assert untimely_plays(published(folder.name)) == []


def untimely_plays(run: SavedRun) -> list[str]:
    """Return the plays that began before their run began, or ended after it ended."""
    records = [run.table.record(key) for key in sorted(run.table.rows)]
    started, ended = run.header.started, run.header.ended
    assert ended is not None
    return [record.episode_id for record in records if not started <= record.started <= record.ended <= ended]


@pytest.mark.parametrize("name", [*PRESENT, *LISTS])
def test_plays_of_packaged_packs_hold(name: str) -> None:
    run = published(name)
    assert run.notes == ()
    assert counts_of(run) == {**PRESENT, **LISTS}[name]
    found = verify_run(PLAYS / name, VerifySettings(records_only=True))
    assert found.left_out == 0
    assert found.differences == ()


@pytest.mark.parametrize("name", [*OLD, *OLD_LISTS, *OLD_UNCOUNTED])
def test_published_plays_are_a_run_with_its_pack(name: str) -> None:
    run = published(name)
    if name not in OLD_UNCOUNTED:
        assert counts_of(run) == {**OLD, **OLD_LISTS}[name]
    assert any("shapes 4 (here" in note for note in run.notes) == (run.header.spec.versions.shapes == 4)
    assert any("has another text for" in note for note in run.notes) == (name == OTHER_PROMPT)
    found = verify_run(PLAYS / name, VerifySettings(records_only=True))
    assert found.left_out == 0
    assert [(fault.episode_id, fault.step, fault.fact) for fault in found.differences] == REWORDED.get(name, [])
    pack = Pack.load(run.pack_folder, run.header.spec.pack_sha256)
    played = set(run.header.spec.episode_ids)
    twins = {pack.pairs.get(episode_id) for episode_id in played} - {None}
    assert {one.id for one in pack.episodes} == played | {name for name, pair in pack.pairs.items() if pair in twins}


def test_a_moved_run_finds_the_pack_that_lies_in_it(tmp_path: Path) -> None:
    name = "vigil_closure_400_v1"
    moved = shutil.copytree(PLAYS / name, tmp_path / "elsewhere")
    assert read_run(moved).pack_folder == moved / "pack"


def test_plays_are_published_from_a_run(tmp_path: Path) -> None:
    run = read_run(PLAYS / "vigil_closure_400_v2")
    records = [run.table.record(key) for key in sorted(run.table.rows)[:3]]
    first_only = read_header(run.folder).model_copy(update={"ended": records[0].ended})
    publish_plays(tmp_path / "plays", run.pack_folder, records, first_only)
    again = read_run(tmp_path / "plays")
    assert untimely_plays(again) == []
    assert [key[0] for key in sorted(again.table.rows)] == [record.episode_id for record in records]
    assert again.table.left_out == ()
    assert again.header.spec.pack_versions == run.header.spec.pack_versions
