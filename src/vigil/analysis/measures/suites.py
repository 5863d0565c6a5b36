"""Runs of the suites, which reports show in separate sections."""

from collections.abc import Sequence
from pathlib import Path

from vigil.analysis.measures.chores import read_chores_runs
from vigil.analysis.measures.closure import SUITE, SuiteRun, read_closure_runs, suite_of
from vigil.packs.pack import CHORES_SUITE


def read_suites(folders: Sequence[Path], pack: str | Path | None = None) -> tuple[list[Path], list[SuiteRun]]:
    """Return the run folders whose pack is not of a suite, and the runs of suites.

    Raises RecordError, PackMismatch or EpisodeError.
    """
    suite = {folder: suite_of(folder, pack) for folder in folders}
    closure = read_closure_runs([folder for folder in folders if suite[folder] == SUITE], pack)
    chores = read_chores_runs([folder for folder in folders if suite[folder] == CHORES_SUITE], pack)
    return [folder for folder in folders if suite[folder] not in (SUITE, CHORES_SUITE)], [*closure, *chores]
