"""`vigil report` and `vigil figure`: what saved runs show."""

from pathlib import Path
from typing import Annotated

import typer
from matplotlib.figure import Figure

from vigil.analysis.measures.closure import is_closure_run, read_closure_runs
from vigil.analysis.measures.metrics import broken_run_identities
from vigil.analysis.measures.rows import Run, read_runs
from vigil.analysis.measures.study import Study, study
from vigil.analysis.plots.diagrams import pipeline_figure, protocol_figure
from vigil.analysis.plots.figures import FIGURES
from vigil.analysis.plots.style import figure_bytes
from vigil.analysis.plots.trajectory import (
    AgentTrajectory,
    find_record,
    make_trajectory,
    trajectory_animation,
    trajectory_figure,
)
from vigil.analysis.report import FORMATS, Format, make_report, markdown_report, write_report
from vigil.cli.arguments import Epoch, LevelsFile, Reveal, RunArguments, WithPaper
from vigil.cli.text import print_notes
from vigil.errors import RecordError, SettingError, did_you_mean
from vigil.packs.pack import Pack
from vigil.packs.private import REVEAL, check_revealed, is_private
from vigil.protocol.episode import Episode
from vigil.protocol.families import FAMILIES, Family
from vigil.runner.shared_settings import AssetFile, PackLocation
from vigil.runner.workers.frames import first_frames, frames_of_record
from vigil.scoring.levels import read_levels
from vigil.scoring.saved_run import find_runs, load_run_pack, pack_folder

STILLS, MOVING = (".png", ".pdf", ".svg"), (".gif", ".webp")
WITH_FRAMES = ("protocol", "pipeline", "trajectory")
_Frames = tuple[Path | None, bool]
"""Asset database for drawing frames, and whether frames of private packs may be drawn."""


def report(
    runs: RunArguments,
    format_: Annotated[
        list[str] | None,
        typer.Option("--format", help="Format of the report: md, html, latex, json, csv or all; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to which the report is written.", show_default="print the report as Markdown"),
    ] = None,
    pack: PackLocation = None,
    with_paper: WithPaper = True,
    episode: Annotated[
        list[str] | None, typer.Option(help="Id of an episode whose trajectories are also shown; may be repeated.")
    ] = None,
    diagram: Annotated[
        bool, typer.Option("--diagram", help="Also show the diagram that explains the protocol.")
    ] = False,
    assets: AssetFile = None,
    levels: LevelsFile = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check",
            help="Do not write a report, but check that the rates of each run fit together, e.g. that B, FR, "
            "NR, IL and Other add up to all scored episodes.",
        ),
    ] = False,
    reveal: Reveal = False,
) -> None:
    """Examples:
    vigil report runs/solver runs/gpt-4o --out report
    vigil report runs/* --format latex --format csv --out report
    vigil report runs/* --check
    """
    if check:
        _check(runs, pack)
        return
    formats = _formats(format_ or [])
    stress = [run for run in runs if is_closure_run(run, pack)]
    scored_runs = read_runs(
        [run for run in runs if run not in stress],
        pack,
        levels=None if levels is None else read_levels(levels),
    )
    found = study(scored_runs, with_paper=with_paper)
    closure = read_closure_runs(stress, pack)
    if out is None and format_:
        raise SettingError(f"--format {' '.join(format_)} writes files: say where with --out FOLDER.")
    if out is None:
        print(markdown_report(make_report(found, (), closure=closure), figures=False))
        return
    further = _further(found, pack, episode or [], diagram, (assets, reveal))
    written = write_report(found, out, formats, further, closure=closure, reveals=reveal)
    _warn(found)
    if "csv" in formats and not reveal:
        print_notes(
            f"{run.name}: its pack is private, so rows.csv and rows.parquet do not have its episodes ({REVEAL})."
            for run in scored_runs
            if run.is_private
        )
    pages = [path for path in written if path.stem == "report"]
    for path in written if len(written) <= 3 else pages:
        print(path)
    if len(written) > 3:
        print(f"{len(written) - len(pages)} more files under {out}")


def _check(runs: list[Path], pack: str | Path | None) -> None:
    scored_runs = read_runs(runs, pack)
    faults = [fault for run in scored_runs for fault in broken_run_identities(run)]
    for fault in faults:
        print(fault)
    episodes = sum(run.n for run in scored_runs)
    print(f"{len(scored_runs)} runs, {episodes} scored episodes: {len(faults)} identities broken")
    if faults:
        raise typer.Exit(1)


def _formats(names: list[str]) -> tuple[Format, ...]:
    wanted = [name for text in names for name in text.split(",")]
    for name in wanted:
        if name not in (*FORMATS, "all"):
            raise SettingError(
                f"Format {name!r} does not exist.{did_you_mean(name, FORMATS)} Known: {', '.join(FORMATS)}."
            )
    if "all" in wanted:
        return FORMATS
    return tuple(name for name in FORMATS if name in wanted) or ("md", "html")


def _further(
    found: Study, pack: str | Path | None, episodes: list[str], diagram: bool, frames: _Frames
) -> dict[str, tuple[Figure, str]]:
    """Return the figures that need frames: name -> figure and caption."""
    drawn: dict[str, tuple[Figure, str]] = {}
    for number, episode_id in enumerate(episodes, start=1):
        having = [run for run in found.runs if episode_id in set(run.rows["episode_id"])]
        if not having:
            known = sorted({str(known) for run in found.runs for known in run.rows["episode_id"]})
            guess = did_you_mean(episode_id, known)
            raise SettingError(f"No run has a scored record of episode {episode_id!r}.{guess}")
        episode, tracks = _tracks(having, pack, episode_id, 1, frames)
        drawn[f"trajectory_{number}"] = (trajectory_figure(episode, tracks), f"Trajectories on episode {episode_id}.")
        best = min(tracks, key=lambda one: (not one.outcome.B, not one.outcome.W, one.name))
        drawn[f"pipeline_{number}"] = (pipeline_figure(episode, best), f"The pipeline, on {episode_id} by {best.name}.")
    if diagram and not found.runs:
        raise SettingError("The diagram shows the eight families: also give a run on a pack of these families.")
    if diagram:
        place = str(pack_folder(found.runs[0].header, pack))
        drawn["protocol"] = (_protocol(place, frames), "The eight families in two tiers, each with a first frame.")
    return drawn


def _warn(found: Study) -> None:
    for warning in found.warnings:
        print(f"! {warning}")


def figure(
    name: Annotated[str, typer.Argument(help=f"Figure to draw: {', '.join((*FIGURES, *WITH_FRAMES))}.")],
    runs: Annotated[
        list[Path] | None,
        typer.Argument(help="Folders of the runs to draw; the figure trajectory shows each run in a row of frames."),
    ] = None,
    out: Annotated[
        Path,
        typer.Option(help="File to write, ending in .png, .pdf or .svg; for the figure trajectory also .gif or .webp."),
    ] = Path("figure.png"),
    episode: Annotated[
        str | None, typer.Option(help="Id of the episode to draw, for the figures trajectory and pipeline.")
    ] = None,
    epoch: Epoch = 1,
    columns: Annotated[
        int, typer.Option(min=2, max=40, help="Maximum number of frames that the figure trajectory shows for each run.")
    ] = 6,
    pack: PackLocation = None,
    with_paper: WithPaper = True,
    assets: AssetFile = None,
    reveal: Reveal = False,
    are_runs: Annotated[
        bool,
        typer.Option(
            "--runs",
            help=(
                "Optional word that may be written before the folders of the runs, to make the command easier to "
                "read. It has no effect."
            ),
        ),
    ] = False,
) -> None:
    """Examples:
    vigil figure plane runs/* --out plane.pdf
    vigil figure trajectory --episode ID --runs runs/a runs/b runs/c --out trajectory.png
    vigil figure protocol --pack starter --out protocol.png
    """
    del are_runs
    kind = _kind_of(out, name)
    if name == "protocol":
        content = figure_bytes(_protocol(pack or "starter", (assets, reveal)), kind)
    elif name in WITH_FRAMES:
        content = _trajectory(name, _scored_runs(runs, name), pack, (episode, epoch, columns), (assets, reveal), kind)
    elif name in FIGURES:
        drawn = FIGURES[name](study(_scored_runs(runs, name, pack), with_paper=with_paper))
        if drawn is None:
            raise SettingError(f"These runs have nothing to show in the figure {name!r}.")
        content = figure_bytes(drawn, kind)
    else:
        known = (*FIGURES, *WITH_FRAMES)
        raise SettingError(f"Figure {name!r} does not exist.{did_you_mean(name, known)} Known: {', '.join(known)}.")
    out.write_bytes(content)
    print(out)


def _kind_of(out: Path, name: str) -> str:
    suffix = out.suffix.lower()
    known = (*STILLS, *MOVING) if name == "trajectory" else STILLS
    if suffix not in known:
        raise SettingError(f"--out {str(out)!r}: give a file that ends in {', '.join(known)}.")
    if not out.parent.is_dir():
        raise SettingError(f"--out {str(out)!r}: folder {str(out.parent)!r} does not exist. Make it first.")
    return suffix[1:]


def _scored_runs(folders: list[Path] | None, name: str, pack: str | Path | None = None) -> list[Run]:
    if not folders:
        raise SettingError(f"The figure {name!r} is drawn from runs: give their folders.")
    given = find_runs(folders)
    order = [folder.resolve() for folder in given]
    return sorted(read_runs(given, pack), key=lambda run: order.index(run.folder))


def _trajectory(
    name: str,
    runs: list[Run],
    pack: str | Path | None,
    what: tuple[str | None, int, int],
    frames: _Frames,
    kind: str,
) -> bytes:
    episode_id, epoch, columns = what
    if episode_id is None:
        example = runs[0].header.spec.episode_ids[0]
        raise SettingError(f"Say which episode to draw: --episode ID, e.g. {example}.")
    episode, tracks = _tracks(runs, pack, episode_id, epoch, frames)
    if name == "pipeline":
        return figure_bytes(pipeline_figure(episode, tracks[0], min(columns, 6)), kind)
    if f".{kind}" in MOVING:
        return trajectory_animation(episode, tracks, kind)
    return figure_bytes(trajectory_figure(episode, tracks, columns), kind)


def _tracks(
    runs: list[Run], pack: str | Path | None, episode_id: str, epoch: int, frames: _Frames
) -> tuple[Episode, list[AgentTrajectory]]:
    assets, reveals = frames
    loaded = [(run, load_run_pack(run.header, pack)) for run in runs]
    for _, found in loaded:
        check_revealed(found.name, is_private(found.manifest.meta), "A picture of its episodes", reveals=reveals)
    episode = loaded[0][1].episode(episode_id)
    if any(other.episode(episode_id) != episode for _, other in loaded):
        raise RecordError(f"Episode {episode_id!r} is not the same in the packs of these runs. Give runs of one pack.")
    return episode, [_track(run, found, episode, epoch, assets) for run, found in loaded]


def _track(run: Run, pack: Pack, episode: Episode, epoch: int, assets: Path | None) -> AgentTrajectory:
    record = find_record(run, pack.episodes, (episode.id, epoch))
    return make_trajectory(
        run.name, episode, record, frames_of_record(run.folder, run.header.spec, pack, record, assets)
    )


def _protocol(pack: str | Path, frames: _Frames) -> Figure:
    assets, reveals = frames
    loaded = Pack.load(pack)
    check_revealed(loaded.name, is_private(loaded.manifest.meta), "A picture of its episodes", reveals=reveals)
    episodes = {episode.family: episode for episode in reversed(loaded.episodes)}
    shown: dict[Family, Episode] = {family: episodes[family] for family in FAMILIES if family in episodes}
    return protocol_figure(first_frames(loaded, shown, assets), shown)
