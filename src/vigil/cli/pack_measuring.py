"""`vigil pack baselines` and `vigil pack sheet`: what a frozen pack comes to, in figures and to the eye."""

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

import vigil
from vigil.assets.sizes import AssetDatabase
from vigil.authoring.packing.baselines import AGENTS, BASELINES, baselines_table, broken_promises, guess_lines, measured
from vigil.authoring.packing.dataset_card import write_card
from vigil.authoring.review.contact_sheets import pick_sample, write_sheets
from vigil.authoring.ways.solvers import PRIVILEGED, privileged_agent
from vigil.cli.arguments import PackArgument
from vigil.cli.progress import run_progress
from vigil.cli.text import say
from vigil.errors import SettingError, SimulatorError
from vigil.pack import Pack
from vigil.runner.run import run_pack
from vigil.runner.settings import RunSettings
from vigil.runner.shared_settings import AssetFile, Workers
from vigil.sim import make_simulator
from vigil.summary import settle_run, summarise


def baselines(
    pack: PackArgument,
    log_dir: Annotated[Path, typer.Option(help="Folder for the runs; the same command continues them.")],
    card: Annotated[
        bool, typer.Option("--card", help="Also write the figures beside the pack and into its card.")
    ] = False,
    workers: Workers = None,
    assets: AssetFile = None,
) -> None:
    """Example: vigil pack baselines vigil_mini --log-dir runs/baselines"""
    loaded = Pack.load(pack)
    say(loaded.manifest.version_notes)
    summaries = {name: _summary(loaded, name, log_dir / name, workers, assets) for name in AGENTS}
    found = measured(loaded, summaries, vigil.__version__)
    print(*baselines_table(found), *guess_lines(found), sep="\n")
    if card:
        (loaded.folder / BASELINES).write_text(found.model_dump_json(indent=1) + "\n", encoding="utf-8")
        print(write_card(loaded))
    broken = broken_promises(found)
    for promise in broken:
        print(f"broken: {promise}")
    if broken:
        raise typer.Exit(2)


def _summary(pack: Pack, agent: str, folder: Path, workers: int | None, assets: Path | None) -> dict:
    settings = RunSettings(
        pack=pack.folder,
        agent=agent,
        agent_factory=privileged_agent if agent in PRIVILEGED else None,
        log_dir=folder,
        workers=workers,
        asset_database=assets,
    )
    with run_progress(agent) as show:
        result = run_pack(settings, on_progress=show)
    if not result.is_complete:
        raise SimulatorError(
            f"{result.errors} episodes of {agent!r} ended as errors; the same command plays them again."
        )
    return summarise(settle_run(result.episodes, result.records))


def sheet(
    pack: PackArgument,
    out: Annotated[Path, typer.Option(help="Folder to write a sheet for each family into.")],
    n: Annotated[int, typer.Option("--n", min=1, help="Episodes, evenly over the families.")] = 80,
    seed: Annotated[int, typer.Option(min=0, help="Which ones.")] = 0,
    assets: AssetFile = None,
) -> None:
    """Example: vigil pack sheet vigil_mini --n 80 --out sheets"""
    if out.exists() and not out.is_dir():
        raise SettingError(f"--out {str(out)!r} is a file; give a folder.")
    loaded = Pack.load(pack)
    say(loaded.manifest.version_notes)
    with closing(make_simulator("mujoco", assets=AssetDatabase.of(assets))) as simulator:
        shown = pick_sample(loaded.episodes, n, seed)
        print(*write_sheets(shown, loaded.house_of, simulator, out), sep="\n")
