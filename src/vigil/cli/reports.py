"""`vigil report` and `vigil figure`: tables and figures of saved runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from vigil.base.settings import Setting
from vigil.cli.arguments import Epoch, LevelsFile, Reveal, RunArguments, WithPaper
from vigil.cli.progress import read_runs_shown
from vigil.cli.text import print_notes
from vigil.errors import SettingError, check_known
from vigil.packs.private import REVEAL
from vigil.runner.shared_settings import AssetFile, PackLocation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vigil.analysis.measures.rows import Run
    from vigil.analysis.report import Format
    from vigil.cli.report_figures import FrameSource

STILLS, MOVING = (".png", ".pdf", ".svg"), (".gif", ".webp")
WITH_FRAMES = ("protocol", "pipeline", "trajectory")
OF_RUNS = (
    *("outcome_partition", "belief_closure", "plane", "closure_curves", "feedback_shift"),
    *("belief_curve", "belief_reliability", "belief_partition"),
)
"""Names of the figures in `FIGURES` and `BELIEF_FIGURES`, repeated here so that the help need not load them."""


@dataclass(frozen=True, kw_only=True)
class ReportOptions:
    """What `vigil report` shows, in which formats, and where it writes."""

    formats: Annotated[
        tuple[str, ...],
        Setting("Format of the report: md, html, latex, json, csv or all; may be repeated.", name="format"),
    ] = ()
    style: Annotated[
        Literal["report", "paper"],
        Setting(
            "Style of the LaTeX: report shows everything; paper shows only the paper's tables, with the paper's "
            "columns, in 7-point type, one or two text columns wide."
        ),
    ] = "report"
    out: Annotated[
        Path | None, Setting("Folder to which the report is written.", unset="print the report as Markdown")
    ] = None
    pack: PackLocation = None
    episodes: Annotated[
        tuple[str, ...], Setting("Id of an episode whose trajectories are also shown; may be repeated.", name="episode")
    ] = ()
    diagram: Annotated[bool, Setting("Also show the diagram that explains the protocol.")] = False
    assets: AssetFile = None
    check: Annotated[
        bool,
        Setting(
            "Do not write a report, but check that the rates of each run fit together, e.g. that B, FR, "
            "NR, IL and Other add up to all scored episodes."
        ),
    ] = False


def report(
    runs: RunArguments,
    options: ReportOptions,
    with_paper: WithPaper = True,
    levels: LevelsFile = None,
    reveal: Reveal = False,
) -> None:
    """Examples:
    vigil report runs/solver runs/gpt-4o --out report
    vigil report runs/* --format latex --format csv --out report
    vigil report runs/* --format latex --style paper --out paper
    vigil report runs/* --check
    """
    from vigil.analysis.measures.study import study
    from vigil.analysis.measures.suites import read_suites
    from vigil.analysis.report import make_report, markdown_report, write_report
    from vigil.cli.report_figures import framed_figures
    from vigil.scoring.levels import read_levels

    pack, out = options.pack, options.out
    if options.check:
        _check(runs, pack)
        return
    formats = _formats(options.formats)
    if out is None and options.formats:
        raise SettingError(f"--format {' '.join(options.formats)} writes files: give their folder with --out.")
    others, suites = read_suites(runs, pack)
    scored_runs = read_runs_shown(others, pack, levels=None if levels is None else read_levels(levels))
    found = study(scored_runs, with_paper=with_paper)
    if out is None:
        print(markdown_report(make_report(found, (), suites=suites), figures=False))
        return
    further = framed_figures(found, pack, options.episodes, options.diagram, (options.assets, reveal))
    written = write_report(found, out, formats, further, suites=suites, reveals=reveal, style=options.style)
    for warning in found.warnings:
        print(f"! {warning}")
    if "csv" in formats and not reveal:
        print_notes(
            f"{run.name}: its pack is private, so rows.csv and rows.parquet do not have its episodes ({REVEAL})."
            for run in scored_runs
            if run.is_private
        )
    _print_files(written, out)


def _print_files(written: Sequence[Path], out: Path) -> None:
    """Print the paths of all files if there are few, else those of the pages and the number of other files."""
    pages = [path for path in written if path.stem == "report"]
    for path in written if len(written) <= 3 else pages:
        print(path)
    if len(written) > 3:
        print(f"{len(written) - len(pages)} more files under {out}")


def _check(runs: list[Path], pack: str | Path | None) -> None:
    from vigil.analysis.measures.metrics import broken_run_identities

    scored_runs = read_runs_shown(runs, pack)
    faults = [fault for run in scored_runs for fault in broken_run_identities(run)]
    for fault in faults:
        print(fault)
    episodes = sum(run.n for run in scored_runs)
    print(f"{len(scored_runs)} runs, {episodes} scored episodes: {len(faults)} identities broken")
    if faults:
        raise typer.Exit(1)


def _formats(names: Sequence[str]) -> "tuple[Format, ...]":
    from vigil.analysis.report import FORMATS

    wanted = [name for text in names for name in text.split(",")]
    for name in wanted:
        if name != "all":
            check_known("Format", name, FORMATS)
    if "all" in wanted:
        return FORMATS
    return tuple(name for name in FORMATS if name in wanted) or ("md", "html")


@dataclass(frozen=True, kw_only=True)
class FigureOptions:
    """What `vigil figure` draws, and where it writes."""

    out: Annotated[
        Path, Setting("File to write, ending in .png, .pdf or .svg; for the figure trajectory also .gif or .webp.")
    ] = Path("figure.png")
    episode: Annotated[str | None, Setting("Id of the episode to draw, for the figures trajectory and pipeline.")] = (
        None
    )
    columns: Annotated[
        int, Setting("Maximum number of frames that the figure trajectory shows for each run.", minimum=2, maximum=40)
    ] = 6
    width: Annotated[
        Literal["column", "page"] | None,
        Setting(
            "Draw the figure for a paper: as wide as a page or a column of the paper, on white, without a title.",
            unset="for a screen",
        ),
    ] = None
    pack: PackLocation = None
    assets: AssetFile = None
    are_runs: Annotated[
        bool,
        Setting(
            "Optional word that may be written before the folders of the runs, to make the command easier to "
            "read. It has no effect.",
            name="runs",
        ),
    ] = False


def figure(
    name: Annotated[str, typer.Argument(help=f"Figure to draw: {', '.join((*OF_RUNS, *WITH_FRAMES))}.")],
    options: FigureOptions,
    runs: Annotated[
        list[Path] | None,
        typer.Argument(help="Folders of the runs to draw; the figure trajectory shows each run as a row of frames."),
    ] = None,
    epoch: Epoch = 1,
    with_paper: WithPaper = True,
    reveal: Reveal = False,
) -> None:
    """Examples:
    vigil figure plane runs/* --width column --out plane.pdf
    vigil figure trajectory --episode ID --runs runs/a runs/b runs/c --out trajectory.png
    vigil figure protocol --pack starter --out protocol.png
    """
    from vigil.analysis.plots.style import figure_bytes, on_paper
    from vigil.cli.report_figures import protocol_of

    out, width, pack = options.out, options.width, options.pack
    kind, frames = _kind_of(out, name), (options.assets, reveal)
    if width is not None and f".{kind}" in MOVING:
        raise SettingError(
            f"--width is for still figures, but {str(out)!r} is an animation. Leave out --width, or give another --out."
        )
    if width == "column" and name in ("protocol", "pipeline"):
        raise SettingError(f"The figure {name!r} is too wide for one column of a paper: give --width page.")
    with on_paper(width):
        if name == "protocol":
            content = figure_bytes(protocol_of(pack or "starter", frames), kind)
        elif name in WITH_FRAMES:
            play = options.episode, epoch, options.columns
            content = _trajectory(name, _scored_runs(runs, name), pack, play, frames, kind)
        else:
            content = figure_bytes(_figure_of_runs(name, runs, pack, with_paper=with_paper), kind)
    out.write_bytes(content)
    print(out)


def _figure_of_runs(name: str, runs: list[Path] | None, pack: str | Path | None, *, with_paper: bool) -> "Figure":
    """Return a figure of the measures of runs. Raises SettingError if it does not exist or has nothing to show."""
    from vigil.analysis.measures.study import study
    from vigil.analysis.plots.belief_figures import BELIEF_FIGURES
    from vigil.analysis.plots.figures import FIGURES

    figures = FIGURES | BELIEF_FIGURES
    check_known("Figure", name, (*figures, *WITH_FRAMES))
    drawn = figures[name](study(_scored_runs(runs, name, pack), with_paper=with_paper))
    if drawn is None:
        raise SettingError(f"These runs have nothing to show in the figure {name!r}.")
    return drawn


def _kind_of(out: Path, name: str) -> str:
    suffix = out.suffix.lower()
    known = (*STILLS, *MOVING) if name == "trajectory" else STILLS
    if suffix not in known:
        raise SettingError(f"--out {str(out)!r}: give a file that ends in {', '.join(known)}.")
    if not out.parent.is_dir():
        raise SettingError(f"--out {str(out)!r}: folder {str(out.parent)!r} does not exist. Make it first.")
    return suffix[1:]


def _scored_runs(folders: list[Path] | None, name: str, pack: str | Path | None = None) -> "list[Run]":
    from vigil.scoring.saved_run import find_runs

    if not folders:
        raise SettingError(f"The figure {name!r} is drawn from runs: give their folders.")
    given = find_runs(folders)
    order = [folder.resolve() for folder in given]
    return sorted(read_runs_shown(given, pack), key=lambda run: order.index(run.folder))


def _trajectory(
    name: str,
    runs: "list[Run]",
    pack: str | Path | None,
    what: tuple[str | None, int, int],
    frames: "FrameSource",
    kind: str,
) -> bytes:
    from vigil.analysis.plots.diagrams import pipeline_figure
    from vigil.analysis.plots.style import figure_bytes
    from vigil.analysis.plots.trajectory import trajectory_animation, trajectory_figure
    from vigil.cli.report_figures import tracks_of

    episode_id, epoch, columns = what
    if episode_id is None:
        example = runs[0].header.spec.episode_ids[0]
        raise SettingError(f"Say which episode to draw: --episode ID, e.g. {example}.")
    episode, tracks = tracks_of(runs, pack, episode_id, epoch, frames)
    if name == "pipeline":
        return figure_bytes(pipeline_figure(episode, tracks[0], min(columns, 6)), kind)
    if f".{kind}" in MOVING:
        return trajectory_animation(episode, tracks, kind)
    return figure_bytes(trajectory_figure(episode, tracks, columns), kind)
