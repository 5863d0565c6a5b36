"""`vigil probe`: what a model believed at the steps of a finished run."""

from collections import Counter
from typing import Annotated

import typer

from vigil.cli.arguments import RunArgument
from vigil.cli.progress import progress
from vigil.cli.text import print_notes
from vigil.records.costs import Prices
from vigil.records.probe_file import PROBES_FILE, ProbeTable
from vigil.runner.probes.finished import FinishedProbeSettings, FinishedProbing, plan_probing, probe_run


def probe(
    run: RunArgument,
    settings: FinishedProbeSettings,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Do not ask; print how many calls and tokens the probes would need.")
    ] = False,
) -> None:
    """Examples:
    vigil probe runs/gpt-4o --dry-run --prices 2.5,10
    vigil probe runs/gpt-4o --steps at-goal,at-report --framing both
    """
    probing = plan_probing(run, settings)
    print_notes(probing.run.notes)
    if dry_run:
        _print_estimate(probing, settings.prices)
        return
    with progress("probe") as show:
        table = probe_run(probing, settings, show)
    print_probes(table, settings.prices)
    print(f"Probes: {run / PROBES_FILE}")
    if table.errors:
        raise typer.Exit(1)


def _print_estimate(probing: FinishedProbing, prices: Prices | None) -> None:
    low, high = probing.input_tokens()
    print(f"{probing.probes} probes of {len(probing.plays)} plays; nothing was sent.")
    print(f"{'input tokens':14} {low:>14,} .. {high:>14,}")
    if prices is not None:
        print(f"{'cost of input':14} {prices.cost_of(low, 0):>14,.2f} .. {prices.cost_of(high, 0):>14,.2f}")


def print_probes(table: ProbeTable, prices: Prices | None) -> None:
    """Print how many probes were answered, which were not and why, and what they cost."""
    rows = table.rows.values()
    answered = sum(row.answer is not None for row in rows)
    missing = Counter(row.invalid.reason for row in rows if row.invalid is not None)
    reasons = f" ({', '.join(f'{count} {reason}' for reason, count in missing.most_common())})" if missing else ""
    cost = prices.cost(table.tokens) if prices is not None else None
    spent = "" if cost is None else f", {cost:,.2f}"
    print(
        f"Probes: {answered} answered, {missing.total()} without an answer{reasons}; "
        f"{table.tokens}{spent}, which the figures of the episodes do not include."
    )
    if table.errors:
        print(f"{table.errors} probes failed at the server; the same command asks them again.")
    if table.foreign:
        print(f"{table.foreign} rows of {PROBES_FILE} are of another run or another question, and do not count.")
