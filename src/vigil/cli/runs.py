"""`vigil run`, `vigil probe`, `vigil verify` and `vigil merge`."""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vigil.base.settings import Setting
from vigil.cli.arguments import Imports, RunArgument
from vigil.cli.progress import progress, run_progress
from vigil.cli.text import print_notes
from vigil.errors import SettingError, check_known
from vigil.runner.settings import FinishedProbeSettings, MergeSettings, RunSettings, VerifySettings

if TYPE_CHECKING:
    from vigil.records.costs import Prices
    from vigil.records.probe_file import ProbeTable
    from vigil.runner.plan import RunPlan
    from vigil.runner.progress import RunProgress
    from vigil.runner.run import RunResult
    from vigil.runner.verify_run import Verification

NewRun = Annotated[Path, typer.Argument(metavar="OUT", help="New folder to which the joined run is written.")]
Shards = Annotated[
    list[Path],
    typer.Argument(metavar="SHARD...", help="Folders of the parts to join, made by `vigil run --shard I/N`."),
]


def run(
    settings: RunSettings,
    dry_run: Annotated[
        bool, Setting("Do not play; print how many calls and tokens the run could need at least and at most.")
    ] = False,
    imports: Imports = None,
) -> None:
    """Examples:
    vigil run --pack starter --agent solver --log-dir runs/solver
    vigil run --pack starter --model openai/gpt-4o --log-dir runs/gpt-4o
    vigil run --env http://127.0.0.1:8380 --agent "exec:python my_agent.py"
    """
    from vigil.cli.models import source_of_coordinates
    from vigil.runner.plan import plan_run

    del imports  # done when it was read
    if settings.env is not None:
        _play_remotely(settings, dry_run)
        return
    plan = plan_run(with_agent(settings))
    print_notes(plan.pack.manifest.version_notes)
    if plan.endpoint is not None:
        print(f"Model: {plan.endpoint.access.description}.")
        is_given = settings.coordinates is not None
        why = "as --coordinates says" if is_given else source_of_coordinates(plan.spec.agent)
        print(f"Coordinates: {plan.spec.profile.coordinates} ({why}).")
    if dry_run:
        _print_estimate(plan)
        return
    result = play_plan(plan)
    _print_result(result, plan.pack.folder)
    if not result.is_complete:
        raise typer.Exit(1)


def _play_remotely(settings: RunSettings, dry_run: bool) -> None:
    from vigil.integrations.serve.playing import play_remotely
    from vigil.runner.plan import plan_remote_run

    if dry_run:
        raise SettingError(
            "--dry-run cannot be used with --env: the episodes are on the server. Leave out one of the two options."
        )
    count = play_remotely(plan_remote_run(settings), lambda done: print(f"played: {done}", file=sys.stderr, flush=True))
    print(f"{count} episodes were played at {settings.env}; the server keeps their records and scores.")


def verify(run: RunArgument, settings: VerifySettings) -> None:
    """Example: vigil verify runs/solver"""
    from vigil.runner.verify_run import verify_run

    with progress("verify") as show:
        found = verify_run(run, settings, on_progress=show)
    print_notes((*found.header.version_notes, *found.notes))
    for difference in found.differences:
        print(difference)
    _print_what_was_verified(found, settings)
    if not found.checked:
        print("Nothing was verified: the run has no episode that ended without error.")
    elif settings.frames and not found.frames:
        print("No frame was compared: the agent did not look at a frame in this run.")
    if found.errors:
        print(f"{found.errors} rows ended as errors; there is nothing to verify in them.")
    if found.left_out:
        print(f"{found.left_out} rows of the file are not verified: they are not scored either (see above).")
    if not found.is_verified:
        raise typer.Exit(1)


def _print_what_was_verified(found: Verification, settings: VerifySettings) -> None:
    faults = f"{len(found.differences)} differences"
    if found.is_records_only:
        print(
            f"{found.checked} records checked (identities, prompts, budgets, ends; replies were parsed again): {faults}"
        )
        print(
            f"Not checked, because this needs the simulator ({found.header.simulator_version}): poses, states, clicked "
            "objects and refused actions. For verdicts, the records are enough: vigil score."
        )
        return
    kind = "exactly" if found.is_exact else "within 1 mm and 0.01 degrees"
    pictures = f" and {found.frames} frames" if settings.frames else ""
    print(f"{found.checked} episodes played again{pictures}, compared {kind}: {faults}")


def play_plan(plan: RunPlan) -> RunResult:
    """Play what remains of a run, show its progress, and return the result."""
    from vigil.runner.run import play_run

    with run_progress(plan.spec.agent) as show:

        def show_with_warnings(where: RunProgress) -> None:
            show(where)
            if where.warning is not None:
                print(f"WARNING: {where.warning}", file=sys.stderr, flush=True)

        return play_run(plan, on_progress=show_with_warnings)


def merge(out: NewRun, shards: Shards, settings: MergeSettings) -> None:
    """Example: vigil merge runs/gpt-4o shards/gpt-4o/*"""
    from vigil.cli.scores import print_run
    from vigil.runner.merge import merge_runs
    from vigil.scoring.saved_run import read_run

    merge_runs(out, shards, settings)
    run = read_run(out, settings.pack)
    print_notes(run.notes)
    print_run(out, settings.pack)
    print(f"Records: {out}")


def with_agent(settings: RunSettings) -> RunSettings:
    """Return the settings. If the agent may see hidden state, they include the function that makes the agent.

    Raises SettingError if the agent is unknown.
    """
    from vigil.agents.registry import is_known
    from vigil.agents.scripted import SCRIPTS

    name = settings.agent
    if name is None or is_known(name):
        return settings
    from vigil.authoring.solving.solvers import PRIVILEGED, privileged_agent

    check_known("Agent", name, (*PRIVILEGED, *SCRIPTS), "Choose one of", ", or exec:COMMAND.")
    return replace(settings, agent_factory=privileged_agent)


def _print_estimate(plan: RunPlan) -> None:
    from vigil.protocol.reasoning import declared_thinking
    from vigil.runner.dry_run import REASONING_NOT_COUNTED, estimate, max_tokens_of

    expected, prices = estimate(plan), plan.execution.prices
    if plan.endpoint is None:
        print(f"{expected.episodes} episodes; {plan.spec.agent} calls no model.")
        return
    missing, spec = plan.endpoint.access.missing, plan.spec
    can_think = declared_thinking(spec.agent, spec.thinking, spec.sampling) is None and max_tokens_of(spec) is None
    print_notes([missing] * bool(missing) + [REASONING_NOT_COUNTED] * can_think)
    print(f"{expected.episodes} episodes; nothing was sent. Lowest: each is reported at once. Highest: all steps used.")
    for name in ("calls", "probes", "input_tokens", "output_tokens"):
        low, high = getattr(expected, name)
        if name == "probes" and not high:
            continue
        print(f"{name.replace('_', ' '):14} {low:>14,} .. {high:>14,}")
    if prices is not None:
        low, high = expected.cost(prices)
        print(f"{'cost':14} {low:>14,.2f} .. {high:>14,.2f}")


def _print_result(result: RunResult, pack: Path) -> None:
    from vigil.cli.scores import print_run
    from vigil.records.costs import describe_costs
    from vigil.runner.run_folder import LOGS_FOLDER

    print_notes((*result.header.spec.program_notes, *result.notes))
    print_run(result.folder, pack)
    if result.partial_line_file is not None:
        print(
            f"The previous run was interrupted while it wrote a row; the partial row is in {result.partial_line_file}."
        )
    if result.resumed:
        print(f"Played before, and not played again: {result.resumed} of {len(result.records)} episodes.")
    if result.header.prices is not None:
        print(f"Cost so far: {describe_costs(result.header.prices, result.tokens)}.")
    if result.probes is not None:
        print_probes(result.probes, result.header.prices)
    print(f"Records: {result.folder}")
    if not result.is_complete:
        print(f"{result.errors} episodes ended as errors and are not scored; the same command plays them again.")
        print(f"What agents and simulators wrote to standard error: {result.folder / LOGS_FOLDER}")


def probe(
    run: RunArgument,
    settings: FinishedProbeSettings,
    dry_run: Annotated[
        bool, Setting("Send nothing to the model; only print how many calls and tokens the probes would need.")
    ] = False,
) -> None:
    """Examples:
    vigil probe runs/gpt-4o --dry-run --prices 2.5,10
    vigil probe runs/gpt-4o --steps at-goal,at-report --framing both
    """
    from vigil.records.probe_file import PROBES_FILE
    from vigil.runner.probes import plan_probing, probe_run

    probing = plan_probing(run, settings)
    print_notes(probing.run.notes)
    if dry_run:
        low, high = probing.input_tokens()
        print(f"{probing.probes} probes of {len(probing.plays)} plays; nothing was sent.")
        print(f"{'input tokens':14} {low:>14,} .. {high:>14,}")
        if settings.prices is not None:
            cheap, dear = settings.prices.cost_of(low, 0), settings.prices.cost_of(high, 0)
            print(f"{'cost of input':14} {cheap:>14,.2f} .. {dear:>14,.2f}")
        return
    with progress("probe") as show:
        table = probe_run(probing, settings, show)
    print_probes(table, settings.prices)
    print(f"Probes: {run / PROBES_FILE}")
    if table.errors:
        raise typer.Exit(1)


def print_probes(table: ProbeTable, prices: Prices | None) -> None:
    """Print how many probes were answered, why others were not, and what the probes cost."""
    rows = table.rows.values()
    answered = sum(row.answer is not None for row in rows)
    missing = Counter(row.invalid.reason for row in rows if row.invalid is not None)
    reasons = f" ({', '.join(f'{count} {reason}' for reason, count in missing.most_common())})" if missing else ""
    cost = prices.cost(table.tokens) if prices is not None else None
    spent = "" if cost is None else f", {cost:,.2f}"
    print(
        f"Probes: {answered} answered, {missing.total()} without an answer{reasons}; "
        f"{table.tokens}{spent}, which are not in the figures of the episodes."
    )
    if table.errors:
        print(f"{table.errors} probes failed at the server; the same command asks all probes that are missing.")
    print_notes(table.notes)
