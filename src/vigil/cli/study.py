"""`vigil study`: plays the runs of a study's file, shows their progress, and reports them together."""

import shutil
import subprocess
import sys
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.table import Table

from vigil.base.settings import Setting
from vigil.cli.arguments import Imports, Reveal, WithPaper
from vigil.cli.progress import read_runs_shown
from vigil.cli.text import console, print_note, print_notes
from vigil.errors import RecordError, SettingError, VigilError
from vigil.runner.shared_settings import AssetFile, Workers

if TYPE_CHECKING:
    from vigil.analysis.report import Format
    from vigil.packs.pack import Pack
    from vigil.records.shards import Shard
    from vigil.runner.plan import RunPlan
    from vigil.studies.planned_runs import PlannedRun
    from vigil.studies.progress import RunEstimate
    from vigil.studies.study_file import StudySource

COPY = "study.yaml"
"""Name of the copy of a study's file in the study's folder."""
_LATEX = {"tectonic": (), "lualatex": ("-interaction=nonstopmode",), "pdflatex": ("-interaction=nonstopmode",)}
"""LaTeX programs, in order of preference, with their options."""
_LATEX_SECONDS = 120
_LATEX_PASSES = 4
"""Maximum number of times that LaTeX runs; page numbers and the columns of long tables are right only after several."""

StudyPath = Annotated[
    Path | None,
    typer.Argument(
        metavar="STUDY",
        help="File of the study.",
        show_default=f"{COPY} in this folder, else the study that was played last under runs/",
    ),
]
Models = Annotated[list[str] | None, Setting("Name of a model: use only its runs; may be repeated.", name="model")]
Conditions = Annotated[
    list[str] | None, Setting("Name of a condition: use only the runs under it; may be repeated.", name="condition")
]


@dataclass(frozen=True, kw_only=True)
class ExecutionOptions:
    """How `vigil study run` executes the runs. What is not given stays as the study's file says."""

    shard: Annotated[
        "Shard | None",
        Setting(
            "Play only part I of N of each run. The same command without this option joins the parts.",
            metavar="I/N",
            read="vigil.records.shards:parse_shard",
        ),
    ] = None
    executor: Annotated[
        Literal["local", "ray"] | None,
        Setting(
            "Where the simulators run: on this machine (local), or on a Ray cluster (ray).",
            unset="as the study's file says",
        ),
    ] = None
    ray_address: Annotated[str | None, Setting("Address of the Ray cluster.", metavar="HOST:PORT")] = None
    workers: Workers = None


def run(
    execution: ExecutionOptions,
    study: StudyPath = None,
    model: Models = None,
    condition: Conditions = None,
    dry_run: Annotated[
        bool,
        Setting(
            "Do not play; print how many calls, tokens and hours the remaining plays need, and what they cost, at "
            "least and at most."
        ),
    ] = False,
    imports: Imports = None,
) -> None:
    """Examples:
    vigil study run study.yaml --dry-run
    vigil study run study.yaml --model GPT-5.4 --condition feedback
    """
    from vigil.studies.planned_runs import planned_runs, selected_runs

    del imports  # done when it was read
    source = _source(study)
    runs = selected_runs(planned_runs(source), model or (), condition or ())
    changed = {name: value for name, value in vars(execution).items() if value is not None}
    plans = [(one, _plan(one, **changed)) for one in runs]
    if dry_run:
        _print_estimates(source, plans)
        return
    copy = source.study.place / COPY
    copy.parent.mkdir(parents=True, exist_ok=True)
    if copy.resolve() != source.text.path.resolve():
        shutil.copyfile(source.text.path, copy)  # `vigil study report` finds it there
    complete = [_play(one, plan) for one, plan in plans]
    if not all(complete):
        print("Some runs are not complete; the same command continues them.", file=sys.stderr)
        raise typer.Exit(1)


def status(study: StudyPath = None, model: Models = None, condition: Conditions = None) -> None:
    """Example: vigil study status study.yaml"""
    from vigil.studies.planned_runs import planned_runs, selected_runs
    from vigil.studies.progress import state_of

    source = _source(study)
    table = Table(title=f"{source.study.name}: {source.study.place}", title_justify="left")
    for heading in ("run", "role", "scored", "errors", "state"):
        table.add_column(heading, justify="right" if heading in ("scored", "errors") else "left", overflow="fold")
    total = [0, 0]
    for one in selected_runs(planned_runs(source), model or (), condition or ()):
        state = state_of(one, _plan(one))
        total = [total[0] + state.scored, total[1] + state.planned]
        table.add_row(
            one.label.name, one.label.role, f"{state.scored}/{state.planned}", str(state.errors), state.description
        )
    console().print(table)
    print(f"{total[0]:,} of {total[1]:,} plays are scored.")


def report(
    study: StudyPath = None,
    out: Annotated[
        Path | None, Setting("Folder to which the report is written.", unset="report in the study's folder")
    ] = None,
    pdf: Annotated[
        bool, typer.Option("--pdf/--no-pdf", help="Whether to make a PDF too, where a LaTeX program is installed.")
    ] = True,
    style: Annotated[
        Literal["report", "paper"],
        Setting(
            "Style of the LaTeX and the PDF: report shows everything; paper shows only the paper's tables, in the "
            "paper's form."
        ),
    ] = "report",
    with_paper: WithPaper = True,
    assets: AssetFile = None,
    reveal: Reveal = False,
) -> None:
    """Examples:
    vigil study report study.yaml
    vigil study report study.yaml --style paper
    """
    from vigil.analysis.measures.study import study as measured_study
    from vigil.analysis.measures.suites import read_suites
    from vigil.analysis.plots.style import on_paper
    from vigil.analysis.report import write_report
    from vigil.cli.report_figures import study_figures
    from vigil.studies.planned_runs import labels_of, planned_runs

    source = _source(study)
    runs = planned_runs(source)
    played = [one for one in runs if one.saved() is not None]
    if not played:
        raise RecordError(
            f"No run of study {source.study.name!r} was played yet. First run: vigil study run {source.text.path}"
        )
    others, suites = read_suites([one.folder for one in played])
    scored = read_runs_shown(others, labels=labels_of(runs))
    found = measured_study(scored, with_paper=with_paper)
    absent = [one.label.name for one in runs if one not in played]
    if absent:
        shown = f"{len(absent)} of the study's {len(runs)} runs are not played: {', '.join(absent)}."
        found = replace(found, warnings=(shown, *found.warnings))
    place = out or source.study.place / "report"
    latex = next((name for name in _LATEX if shutil.which(name)), None) if pdf else None
    with on_paper("page" if style == "paper" else None):
        further = study_figures(found, source.study.episodes, (assets, reveal)) if scored else {}
    is_wanted = latex is not None or style == "paper"
    formats: tuple[Format, ...] = ("html", "md", "latex") if is_wanted else ("html", "md")
    write_report(found, place, formats, further, suites=suites, reveals=reveal, style=style)
    for warning in found.warnings:
        print(f"! {warning}")
    if latex is not None:
        print(_make_pdf(latex, place))
    print(place / "report.html")


def _source(study: Path | None) -> "StudySource":
    from vigil.studies.study_file import read_study

    return read_study(study or _last_study())


def _last_study() -> Path:
    """Return the study's file in the current folder, or else the copy of the study that was played last. Raises
    SettingError if there is none."""
    from vigil.runner.plan import RUNS_FOLDER

    if Path(COPY).is_file():
        return Path(COPY)
    copies = sorted(RUNS_FOLDER.glob(f"*/{COPY}"), key=lambda path: path.stat().st_mtime_ns)
    if not copies:
        raise SettingError(
            f"Give the file of a study: this folder does not contain {COPY}, and no study was played under runs/."
        )
    return copies[-1]


def _plan(run: "PlannedRun", **changed: object) -> "RunPlan":
    """Return the plan of a run, or of one part of it. Raises errors that name the run."""
    from vigil.cli.runs import with_agent
    from vigil.runner.plan import plan_run

    settings = replace(run.settings, **changed)  # pyright: ignore[reportArgumentType] - options of the command line
    if settings.shard is not None:
        settings = replace(settings, log_dir=run.part_folder(settings.shard))
    try:
        return plan_run(with_agent(settings), _loaded_pack(settings.pack))
    except VigilError as error:
        raise type(error)(f"{run.label.name}: {error}") from None


@cache
def _loaded_pack(pack: str | Path) -> "Pack":
    from vigil.packs.pack import Pack

    return Pack.load(pack)


"""Cache of packs, since the runs of a study share one or two."""


def _play(run: "PlannedRun", plan: "RunPlan") -> bool:
    """Play what remains of a run, and return whether it is complete. A failure is only printed; other runs go on."""
    from vigil.cli.runs import play_plan
    from vigil.studies.progress import join_parts

    name = run.label.name
    try:
        if plan.spec.shard is None and join_parts(run):
            print(f"{name}: parts joined.")
        result = play_plan(plan)
    except VigilError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return False
    print_notes(result.notes)
    scored = len(result.records) - result.errors
    print(f"{name}: {scored} scored, {result.errors} errors, {result.resumed} played before: {result.folder}")
    return result.is_complete


def _print_estimates(source: "StudySource", plans: "list[tuple[PlannedRun, RunPlan]]") -> None:
    from vigil.studies.progress import estimate_rest, parts_of

    table = Table(title=f"{source.study.name}: at least .. at most", title_justify="left")
    table.add_column("run", overflow="fold")
    for heading in ("episodes left", "calls", "input tokens", "output tokens", "cost", "hours"):
        table.add_column(heading, justify="right")
    found = [(one, estimate_rest(one, plan, source.study.call_seconds)) for one, plan in plans]
    for one, left in found:
        table.add_row(one.label.name, f"{left.cost.episodes:,}", *_bounds(left))
    print_notes(
        sorted({plan.endpoint.access.missing for _, plan in plans if plan.endpoint and plan.endpoint.access.missing})
    )
    console().print(table)
    called = [left for _, left in found if left.hours is not None]
    calls, hours = (
        [sum(pair[end] for pair in pairs) for end in (0, 1)]
        for pairs in ([left.cost.calls for left in called], [left.hours or (0.0, 0.0) for left in called])
    )
    print(f"All runs: {calls[0]:,} to {calls[1]:,} calls, {hours[0]:,.1f} to {hours[1]:,.1f} hours one by one.")
    costs = [left.money for left in called]
    if called and None not in costs:
        low, high = (sum(pair[end] for pair in costs if pair) for end in (0, 1))
        print(f"Cost of all runs: {low:,.2f} to {high:,.2f}.")
    print(f"Nothing was sent. Hours assume {source.study.call_seconds:g} s for a call (`call_seconds` of the file).")
    for one, _ in plans:
        if parts_of(one):
            print_note(f"{one.label.name}: parts are not joined and count as unplayed.")


def _bounds(left: "RunEstimate") -> list[str]:
    if left.hours is None:
        return ["no model", "", "", "", ""]
    counts = [left.cost.calls, left.cost.input_tokens, left.cost.output_tokens]
    money = "-" if left.money is None else f"{left.money[0]:,.2f} .. {left.money[1]:,.2f}"
    return [*(f"{low:,} .. {high:,}" for low, high in counts), money, f"{left.hours[0]:.1f} .. {left.hours[1]:.1f}"]


def _make_pdf(program: str, folder: Path) -> str:
    """Compile the report's LaTeX, and return a line with the path of the PDF or with the reason why there is none."""
    command = [program, *_LATEX[program], "report.tex"]
    try:
        for _ in range(_LATEX_PASSES):
            done = subprocess.run(command, cwd=folder, capture_output=True, timeout=_LATEX_SECONDS, check=False)
            if done.returncode:
                return f"{program} failed: there is no PDF. It says why in {folder / 'report.log'}."
            if b"Rerun" not in done.stdout:
                break
    except subprocess.TimeoutExpired:
        return f"{program} took more than {_LATEX_SECONDS} s: there is no PDF."
    return str(folder / "report.pdf")
