"""Measures of an entry: its figures, its tables and its plays, computed from the records alone.

Signs of contamination or fraud, which follow from the plays, are facts that readers should know. The site shows them;
they never change a rank.
"""

import hashlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import pandas as pd
from markupsafe import escape

from vigil.analysis.measures.chores import read_chores_runs
from vigil.analysis.measures.closure import SUITE, read_closure_runs
from vigil.analysis.measures.metrics import measure, plays_of_k, regimes
from vigil.analysis.measures.rows import read_runs
from vigil.analysis.measures.study import RunEntry, study
from vigil.analysis.tables.belief_tables import belief_tables
from vigil.analysis.tables.chores_tables import chores_tables
from vigil.analysis.tables.closure_tables import closure_tables
from vigil.analysis.tables.page import html_table
from vigil.analysis.tables.registry import TABLES
from vigil.analysis.tables.table import Table
from vigil.packs.pack import CHORES_SUITE, Pack
from vigil.protocol.actions import InteractPixel
from vigil.records.record import EpisodeRecord, RunHeader
from vigil.scoring.levels import LEVELS
from vigil.scoring.rates import Rate
from vigil.scoring.saved_run import SavedRun
from vigil.web.leaderboard.bundle import Frames
from vigil.web.leaderboard.metadata import EntryMetadata

Figure = tuple[float | None, float | None, float | None]
"""Value of a figure and its 95 % interval, as fractions; None where there is nothing to count."""
Figures = dict[str, Figure]
RATES = ("W", "B", "Delta", "FR", "NR", "IL")
CLOSURE_RATES = ("C", "correct_pairs", "false_success", "no_report")
CHORES_RATES = ("W", "B", "T", "skill", "overclaim", "underclaim")
COLUMNS: Mapping[str | None, tuple[str, ...]] = {None: RATES, SUITE: CLOSURE_RATES, CHORES_SUITE: CHORES_RATES}
"""Suite of a pack -> names of the figures that the table of entries shows."""
RANKED_BY: Mapping[str | None, str] = {None: "B", SUITE: "C", CHORES_SUITE: "B"}
"""Suite of a pack -> name of the figure by which entries are ranked: the share of plays that were closed truthfully."""
_TABLES = (
    "family_rates",
    "levels",
    "strata",
    "regimes",
    "outcome_partition",
    "clustered",
    "several_plays",
    "after_goal",
    "invalid_replies",
    "models",
)
_OF_PLAY = ("episode_id", "epoch", "attempt", "house", "family", "W", "closed", "end", "reported", "steps")
_DIGITS = 6
"""Number of decimals to which figures are rounded. The check accepts differences up to `TOLERANCE`."""
TOLERANCE = 2e-6
MIN_REPLIES = 4
"""Plays with fewer replies are not compared with other plays, because short plays are often alike."""
FASTEST_REPLY_S = 0.05
MOST_TOKENS_PER_S = 5000
_SLACK_S = 1.0


@dataclass(frozen=True)
class Measures:
    """Results that are computed from an entry's records."""

    figures: Figures
    tables: tuple[str, ...]
    """The tables of the entry's page, as HTML."""
    regimes: tuple[str, ...]
    plays: pd.DataFrame
    """A row for each scored play; `closed` says whether the play was closed truthfully (see `RANKED_BY`)."""
    frames: Frames
    timing_faults: dict[str, int]
    """Reason why the times of a play are impossible -> number of plays with this fault."""


def measures_of(run: SavedRun, pack: Pack) -> Measures:
    """Return the measures of a saved run. Raises RecordError, PackMismatch or EpisodeError."""
    suite = pack.manifest.suite
    if suite == SUITE:
        of_suite = read_closure_runs([run.folder], pack.folder)[0]
        closed = {_key(each): each.C for each in of_suite.outcomes}
        rates = of_suite.rates()
        figures = _from_json(rates["all"], CLOSURE_RATES)
        for kind, found in rates.items():
            if kind != "all":
                figures |= _from_json(found, ("C",), f"kind.{kind}.")
        shown, found_regimes = closure_tables([of_suite]).values(), {}
    elif suite == CHORES_SUITE:
        lists = read_chores_runs([run.folder], pack.folder)[0]
        closed = {_key(each): each.B for each in lists.outcomes}
        figures = _from_json(lists.scores(), CHORES_RATES)
        shown, found_regimes = chores_tables([lists]).values(), {}
    else:
        whole = study(read_runs([run.folder], pack.folder), with_paper=False)
        entry = whole.entries[0]
        closed = {key: row.outcome.B for key, row in run.table.rows.items() if row.outcome is not None}
        figures = dict(_of_families(entry))
        shown = [*(TABLES[name](whole) for name in _TABLES), *belief_tables(whole).values()]
        found_regimes = regimes(entry.overall)
    plays, frames, faults = _plays(run, pack, closed)
    return Measures(
        {name: _rounded(figure) for name, figure in figures.items()},
        tuple(_html(table) for table in shown if table.rows),
        tuple(f"{name} ({certainty})" if certainty else name for name, certainty in found_regimes.items()),
        plays,
        frames,
        faults,
    )


def figure_text(name: str, figure: Figure) -> str:
    """Return a figure as text, in percent with its interval, e.g. `B 91.2 [83.0, 95.9]`."""
    value, low, high = figure
    ends = "" if low is None or high is None else f" [{100 * low:.1f}, {100 * high:.1f}]"
    return f"{name} –" if value is None else f"{name} {100 * value:.1f}{ends}"


def changed_figures(claimed: Figures, found: Figures) -> Iterator[str]:
    """Yield a text for each claimed figure that differs from the figure computed from the records."""
    for name in sorted(claimed.keys() | found.keys()):
        ours, theirs = found.get(name), claimed.get(name)
        if ours is None or theirs is None:
            yield f"figure {name!a}: claimed {theirs}, found {ours}"
            continue
        for part, old, new in zip(("value", "low end", "high end"), theirs, ours, strict=True):
            is_equal = old == new if old is None or new is None else abs(old - new) <= TOLERANCE
            if not is_equal:
                yield f"figure {name}, {part}: claimed {old}, found {new}"


def _of_families(entry: RunEntry) -> Iterator[tuple[str, Figure]]:
    for name in RATES:
        yield name, _figure(entry.overall.rate(name), entry.by_houses[name])
    of_level = dict(iter(entry.run.rows.dropna(subset=["level"]).groupby("level")))
    parts = [(f"family.{name}", part) for name, part in entry.family_parts()]
    parts += [
        (f"level.{name}", entry.part(rows, measure(rows)))
        for name in LEVELS
        if (rows := of_level.get(name)) is not None
    ]
    for part_name, part in parts:
        for name in ("W", "B"):
            yield f"{part_name}.{name}", _figure(part.overall.rate(name), part.by_houses[name])
    if entry.run.header.spec.epochs > 1:
        for name in ("W", "B"):
            for found in plays_of_k(entry.run.rows, name):
                value, interval = found.every
                low, high = interval or (None, None)
                yield f"pass^{found.k}.{name}", (value, low, high)


def _figure(rate: Rate, interval: tuple[float, float] | None) -> Figure:
    if rate.value is None:
        return None, None, None
    low, high = interval or rate.interval or (None, None)
    return rate.value, low, high


def _from_json(values: Mapping[str, Any], names: Sequence[str], above: str = "") -> Figures:
    ends = values["intervals"]
    return {above + name: (values[name], *ends.get(name, (None, None))) for name in names if name in values}


def _rounded(figure: Figure) -> Figure:
    value, low, high = (None if part is None else round(float(part), _DIGITS) for part in figure)
    return value, low, high


def _key(outcome: Any) -> tuple[str, int]:
    return outcome.outcome.episode_id, outcome.outcome.epoch


def _plays(
    run: SavedRun, pack: Pack, closed: Mapping[tuple[str, int], bool]
) -> tuple[pd.DataFrame, Frames, dict[str, int]]:
    reader, rows = PlayReader(run.header, pack), []
    frames, count = hashlib.sha256(), 0
    for key, row in sorted(run.table.rows.items()):
        if row.outcome is None:
            continue
        record, outcome = run.table.record(key), row.outcome
        for step in record.steps:
            if step.frame_sha256 is not None:
                frames.update(step.frame_sha256.encode())
                count += 1
        tokens = {"input_tokens": record.tokens.input, "output_tokens": record.tokens.output}
        facts = {name: closed[key] if name == "closed" else getattr(outcome, name) for name in _OF_PLAY}
        rows.append({**facts, **tokens, **reader.facts(record)})
    return pd.DataFrame(rows), Frames(count=count, sha256=frames.hexdigest()), dict(reader.timing_faults)


def _html(table: Table) -> str:
    """Return a table as HTML for an entry's page. It scrolls by keyboard, and its terms link to the glossary."""
    box = f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(table.title)}">'
    return html_table(table).replace('<div class="box">', box).replace('href="#term-', 'href="../glossary.html#')


class PlayReader:
    """Reads from each play the facts from which signs follow, and counts impossible timings."""

    def __init__(self, header: RunHeader, pack: Pack) -> None:
        self._header = header
        self._solutions = {name: found.actions[:-1] for name, found in pack.solutions.items()}
        self.timing_faults: Counter[str] = Counter()

    def facts(self, record: EpisodeRecord) -> dict[str, Any]:
        """Return hashes of a play's replies, of the replies with their times, and of all its actions but the last.

        Also return whether these actions are those of the solution. The hash of the actions is empty if none of them
        is a click, because plays without clicks are often alike.
        """
        replies = hashlib.sha256()
        for step in record.steps:
            replies.update(f"{len(step.reply.text)}\n{step.reply.text}\n".encode())
        times = "\n".join([f"{record.started} {record.ended}", *(repr(step.reply.seconds) for step in record.steps)])
        acted = tuple(step.action for step in record.steps[:-1])
        self.timing_faults.update(self._timing(record))
        actions = "\n".join(action.model_dump_json() for action in acted if action is not None)
        has_click = any(isinstance(action, InteractPixel) for action in acted)
        return {
            "replies_sha256": replies.hexdigest(),
            "play_sha256": hashlib.sha256(f"{replies.hexdigest()}\n{times}".encode()).hexdigest(),
            "actions_sha256": hashlib.sha256(actions.encode()).hexdigest() if has_click else "",
            "is_solution": len(acted) >= MIN_REPLIES - 1 and acted == self._solutions.get(record.episode_id),
        }

    def _timing(self, record: EpisodeRecord) -> Iterator[str]:
        replies = [step.reply for step in record.steps]
        began, started, ended = _utc(self._header.started), _utc(record.started), _utc(record.ended)
        if ended < started or any(reply.seconds < 0 for reply in replies):
            yield "they end before they begin"
        elif sum(reply.seconds for reply in replies) > (ended - began).total_seconds() + _SLACK_S:
            yield "their replies took longer than from the beginning of the run to the end of the play"
        if started < began or (self._header.ended and ended > _utc(self._header.ended)):
            yield "they were played before the run began or after it ended"
        if self._header.spec.agent_kind != "model":
            return
        if any(reply.reply_source == "server" and reply.seconds < FASTEST_REPLY_S for reply in replies):
            yield f"a reply of a server took less than {FASTEST_REPLY_S:g} s"
        rates = [reply.usage.output_tokens / reply.seconds for reply in replies if reply.usage and reply.seconds > 0]
        if max(rates, default=0.0) > MOST_TOKENS_PER_S:
            yield f"a reply has more than {MOST_TOKENS_PER_S:,} tokens a second"


def _utc(when: datetime) -> datetime:
    """Return a time with its time zone; a time without a zone is taken as UTC."""
    return when if when.tzinfo is not None else when.replace(tzinfo=UTC)


def own_signs(
    header: RunHeader, metadata: EntryMetadata, plays: pd.DataFrame, timing_faults: dict[str, int]
) -> Iterator[str]:
    """Yield the signs that follow from one entry alone."""
    models, total = header.answering_models, len(plays)
    if len(models) > 1:
        yield f"The answers name {len(models)} models, not one: {', '.join(models)}."
    if metadata.model_release is not None and header.started.date() < metadata.model_release:
        yield f"The run began on {header.started.date()}, before the stated release on {metadata.model_release}."
    if metadata.submission_date < (header.ended or header.started).date():
        yield f"The stated day of submission, {metadata.submission_date}, is before the end of the run."
    solved = sum(plays["is_solution"])
    if solved:
        yield f"{solved} of {total} plays are, action by action, the solution that is published with the pack."
    for fault, count in sorted(timing_faults.items()):
        yield f"Impossible timing in {count} of {total} plays: {fault}."
