"""`vigil pack baselines`, `levels`, `difficulty`, `sheet`: measurements and contact sheets of a frozen pack."""

from __future__ import annotations

import json
from collections import Counter
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer
from rich.table import Table

import vigil
from vigil.base.settings import Setting
from vigil.cli.arguments import AsJson, LevelsFile, PackArgument, Reveal, RunArguments
from vigil.cli.packs import load_pack
from vigil.cli.progress import progress, read_runs_shown, run_progress
from vigil.cli.text import console, print_notes
from vigil.errors import SettingError, SimulatorError
from vigil.packs.private import check_revealed, is_private
from vigil.runner.shared_settings import AssetFile, PackLocation, Workers

if TYPE_CHECKING:
    from vigil.analysis.measures.calibration import Correlation, DifficultyCalibration, Success
    from vigil.authoring.packing.baselines import Baselines
    from vigil.packs.pack import Pack
    from vigil.runner.run import RunResult
    from vigil.scoring.levels import EpisodeLevel


def baselines(
    pack: PackArgument,
    log_dir: Annotated[
        Path,
        Setting(
            "Folder in which the runs of the agents are recorded. If the command was interrupted, give it again "
            "to continue these runs."
        ),
    ],
    card: Annotated[
        bool, Setting("Also write the results into the pack's folder and into its card (README.md).")
    ] = False,
    workers: Workers = None,
    assets: AssetFile = None,
) -> None:
    """Example: vigil pack baselines vigil_mini --log-dir runs/baselines"""
    from vigil.authoring.packing.baselines import (
        BASELINES,
        baselines_table,
        broken_promises,
        guess_lines,
        strongest_lines,
    )
    from vigil.authoring.packing.dataset_card import write_card
    from vigil.packs.pack import Pack

    loaded = Pack.load(pack)
    print_notes(loaded.manifest.version_notes)
    found = _baselines_of(loaded, log_dir, workers, assets)
    print(*baselines_table(found), *strongest_lines(found), *guess_lines(found), sep="\n")
    if card:
        (loaded.folder / BASELINES).write_text(found.model_dump_json(indent=1) + "\n", encoding="utf-8")
        print(write_card(loaded))
    broken = broken_promises(found)
    for promise in broken:
        print(f"broken: {promise}")
    if broken:
        raise typer.Exit(2)


def _baselines_of(pack: Pack, log_dir: Path, workers: int | None, assets: Path | None) -> Baselines:
    """Return the baselines of a pack, after its agents have played it."""
    from vigil.analysis.measures.chores import read_chores_runs
    from vigil.authoring.packing.baselines import AGENTS, LIST_AGENTS, list_baselines, measured_baselines
    from vigil.packs.pack import CHORES_SUITE
    from vigil.protocol.profile import BASELINE, ITEMISED_REPORT
    from vigil.scoring.summary import score_run, summarise

    has_lists = pack.manifest.suite == CHORES_SUITE
    agents, profile = (LIST_AGENTS, ITEMISED_REPORT) if has_lists else (AGENTS, BASELINE)
    asked = {"pack": pack.folder, "profile": profile, "workers": workers, "asset_database": assets}
    results = {name: _played(name, log_dir=log_dir / name, **asked) for name in agents}
    if has_lists:
        scores = {name: read_chores_runs([each.folder], pack.folder)[0].scores() for name, each in results.items()}
        return list_baselines(pack, scores, vigil.__version__)
    summaries = {name: summarise(score_run(each.episodes, each.records)) for name, each in results.items()}
    return measured_baselines(pack, summaries, vigil.__version__)


def _played(agent: str, **settings: Any) -> RunResult:
    """Play a pack with an agent and return the result. Raises SimulatorError if some episodes ended as errors."""
    from vigil.authoring.solving.solvers import PRIVILEGED, privileged_agent
    from vigil.runner.run import run_pack
    from vigil.runner.settings import RunSettings

    factory = privileged_agent if agent in PRIVILEGED else None
    with run_progress(agent) as show:
        result = run_pack(RunSettings(agent=agent, agent_factory=factory, **settings), on_progress=show)
    if not result.is_complete:
        raise SimulatorError(
            f"{result.errors} episodes of {agent!r} ended as errors; the same command plays them again."
        )
    return result


def levels(
    pack: PackArgument,
    out: Annotated[
        Path | None,
        Setting("File to which the levels are written, one line per episode. If unset, they are only printed."),
    ] = None,
    workers: Workers = None,
    assets: AssetFile = None,
) -> None:
    """Example: vigil pack levels vigil_mini --out mini.levels.jsonl

    `vigil report` finds the file `levels.jsonl` in a pack's folder by itself. Give it any other file with --levels.
    """
    from vigil.authoring.packing.episode_measures import pack_levels
    from vigil.authoring.packing.verify import VerificationSettings
    from vigil.runner.workers.pool import worker_count
    from vigil.scoring.levels import dump_levels

    loaded, database = load_pack(pack, assets)
    settings = VerificationSettings(assets=database, workers=worker_count(workers))
    with progress("levels") as show:
        found = pack_levels(loaded, settings, show)
    _print_levels(loaded, found)
    if out is not None:
        out.write_bytes(dump_levels(found))
        print(out)


def _print_levels(pack: Pack, found: list[EpisodeLevel]) -> None:
    """Print the number of episodes by family and level, and the means of the terms of the index of difficulty."""
    from vigil.protocol.families import FAMILIES
    from vigil.scoring.levels import COSTS, LEVELS

    family_of = {episode.id: episode.family for episode in pack.episodes}
    counts = Counter((family_of[each.episode_id], each.level) for each in found)
    table = Table("family", *LEVELS, "index", *COSTS)
    for family in FAMILIES:
        own = [each for each in found if family_of[each.episode_id] == family]
        if own:
            means = [f"{np.mean([getattr(each.measures, name) for each in own]):.2f}" for name in COSTS]
            index = f"{np.mean([each.index for each in own]):.2f}"
            table.add_row(family, *(str(counts[family, level]) for level in LEVELS), index, *means)
    console().print(table)


def difficulty(
    runs: RunArguments,
    pack: PackLocation = None,
    levels: LevelsFile = None,
    of: Annotated[
        Literal["W", "B"],
        Setting(
            "What counts as success in an episode: W (the goal was reached) or B (it was also reported correctly).",
            name="success",
        ),
    ] = "B",
    as_json: AsJson = False,
) -> None:
    """Example: vigil pack difficulty runs/* --levels mini.levels.jsonl

    Give runs of one pack, by as many models or agents as you have. Repeats of a model count as more plays of the same
    agent.
    """
    from vigil.analysis.measures.calibration import calibrate_difficulty
    from vigil.scoring.levels import read_levels

    given = None if levels is None else read_levels(levels)
    found = calibrate_difficulty(read_runs_shown(runs, pack, levels=given), of)
    if as_json:
        print(json.dumps(_calibration_json(found)))
    else:
        _print_calibration(found, of)


def _calibration_json(found: DifficultyCalibration) -> dict[str, object]:
    fitted = found.fit
    abilities = zip(fitted.plays.agents, fitted.ability.tolist(), fitted.ability_se.tolist(), strict=True)
    of_episodes = [fitted.difficulty, fitted.difficulty_se, found.indices, found.discriminations]
    columns = [[_number(value) for value in column.tolist()] for column in of_episodes]
    names = ("difficulty", "se", "index", "discrimination")
    texts = zip(fitted.plays.episodes, found.families.tolist(), found.levels.tolist(), strict=True)
    return {
        "agents": [{"agent": agent, "ability": ability, "se": error} for agent, ability, error in abilities],
        "episodes": [
            {"episode_id": name, "family": family, "level": level, **dict(zip(names, row, strict=True))}
            for (name, family, level), row in zip(texts, zip(*columns, strict=True), strict=True)
        ],
        "reliability": found.reliability,
        "index": {
            "overall": _correlation_json(found.overall),
            "within_families": _correlation_json(found.within_families),
        },
        "suspects": found.suspects,
    }


def _correlation_json(found: Correlation) -> dict[str, object]:
    return {**asdict(found), "value": _number(found.value)}


def _number(value: float) -> float | None:
    """Return a number as JSON allows it: None for NaN."""
    return value if np.isfinite(value) else None


def _print_calibration(found: DifficultyCalibration, of: Success) -> None:
    from vigil.analysis.measures.calibration import FEW_AGENTS
    from vigil.scoring.levels import LEVELS

    fitted = found.fit
    hits, plays = fitted.plays.hits.sum(axis=1), fitted.plays.plays.sum(axis=1)
    abilities = Table("agent", "plays", f"{of} %", "ability (logits)", "standard error")
    for at in np.argsort(-fitted.ability, kind="stable"):
        share, ability, error = 100 * hits[at] / plays[at], fitted.ability[at], fitted.ability_se[at]
        abilities.add_row(fitted.plays.agents[at], f"{plays[at]:.0f}", f"{share:.1f}", f"{ability:.2f}", f"{error:.2f}")
    console().print(abilities)
    by_level = Table("level", "episodes", "mean index", "mean difficulty (logits)", "their mean standard error")
    for level in LEVELS:
        is_own = found.levels == level
        if is_own.any():
            columns = (found.indices, fitted.difficulty, fitted.difficulty_se)
            by_level.add_row(level, str(is_own.sum()), *(f"{column[is_own].mean():.2f}" for column in columns))
    if by_level.row_count:
        console().print(by_level)
    for words, one in (("all episodes", found.overall), ("within families", found.within_families)):
        print(f"index and fitted difficulty, rank correlation, {words}: {_correlation_words(one)}")
    if found.has_few_agents:
        print(
            f"With only {len(fitted.plays.agents)} agents, the difficulties are uncertain (reliability "
            f"{found.reliability:.2f}). This makes the correlations smaller, and their intervals are widened to allow "
            f"for it. Give runs of {FEW_AGENTS} agents or more."
        )
    for name in found.suspects:
        print(f"look at {name}: able agents fail it more often than weak ones")


def _correlation_words(found: Correlation) -> str:
    if not np.isfinite(found.value):
        return f"unknown ({found.n} episodes with a level)"
    between = "" if found.interval is None else f" [{found.interval[0]:.2f}, {found.interval[1]:.2f}]"
    return f"{found.value:.2f}{between} ({found.n} episodes)"


def sheet(
    pack: PackArgument,
    out: Annotated[Path, Setting("Folder to which the sheets are written, one picture per family.")],
    count: Annotated[int, Setting("Number of episodes to show, drawn evenly from the families.", minimum=1)] = 80,
    seed: Annotated[int, Setting("Random seed of the choice of episodes to show.", minimum=0)] = 0,
    assets: AssetFile = None,
    reveal: Reveal = False,
) -> None:
    """Example: vigil pack sheet vigil_mini --count 80 --out sheets"""
    from vigil.assets.database import AssetDatabase
    from vigil.authoring.review.contact_sheets import pick_sample, write_sheets
    from vigil.packs.pack import Pack
    from vigil.sim import make_simulator

    if out.exists() and not out.is_dir():
        raise SettingError(f"--out {str(out)!r} is a file; give a folder.")
    loaded, database = Pack.load(pack), AssetDatabase.from_file(assets)
    print_notes(loaded.manifest.version_notes)
    what = "A sheet of its frames and instructions"
    check_revealed(loaded.name, is_private(loaded.manifest.meta), what, reveals=reveal)
    loaded.check_assets(database)
    with closing(make_simulator("mujoco", assets=database)) as simulator:
        shown = pick_sample(loaded.episodes, count, seed)
        print(*write_sheets(shown, loaded.house_of, simulator, out), sep="\n")
