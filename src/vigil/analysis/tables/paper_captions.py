"""Captions of the paper's tables, for a document that has only these tables: each can be read alone."""

from collections.abc import Iterable, Sequence

from vigil.analysis.measures.study import Study
from vigil.analysis.tables.table import Table, TableRow

_W_AND_B = "W: the world reached the goal. B: W, and closed by a matching report."
_PAIRS = f"Each cell is W/B in %. {_W_AND_B}"
_FAMILIES = (
    "PG: pixel grounding, DA: distance approach, VS: view search, SV: state verification, AI: approach and interact, "
    "SI: search and interact, SM: sequential manipulation, CR: constraint resolving."
)
_ORDER = "this study's rows by B, published rows as printed."
_GAP = "Δ = W − B, in points."
_FR = "FR: closed by a report that does not match the world."
_NR = "NR: no report within the step budget (IL not included)."
_IL = "IL: ended by too many invalid replies."
_NO_REPORT = "NoRep: no report, by budget (NR) or invalid limit (IL)."

CAPTIONS: dict[str, str] = {
    "benchmark_comparison": (
        "Embodied benchmarks compared (arXiv:2605.08747). Size: episodes or tasks evaluated. Task level: High, "
        "tasks that chain several skills; Low, tasks of one basic skill. Native control: the agent controls the body "
        "by small steps instead of naming objects or sub-tasks. Fine-grained: results are reported by capacity. "
        "Decoupled: what is scored separately. Active termination: how the agent itself ends an episode. No feedback: "
        "the agent does not learn whether an action succeeded."
    ),
    "global_cross_section": f"Outcomes under native control. {_PAIRS} {_GAP} {_FAMILIES} Order: {_ORDER}",
    "full_panel": f"Primary panel by group of models. {_PAIRS} {_FAMILIES} Order in each group: {_ORDER}",
    "extended_panel": (
        f"Extended panel: rows outside the main tables. Rates in %. {_W_AND_B} {_GAP} {_FR} {_NO_REPORT} {_IL} "
        "Steps: mean per episode."
    ),
    "prompt_sensitivity": (
        f"Neutral prompt, without the two lines that warn of claims that are not grounded. {_PAIRS} {_FAMILIES} "
        f"Order in each group: {_ORDER}"
    ),
    "proprio_minimal": (
        "Action feedback: +FB tells the agent two facts after each action, base does not: `too_far` (the clicked "
        "object is out of reach) and `path_blocked` (an obstacle stopped a move). Left: mean number of these events "
        "per episode, and of retries (repeats of an identical `interact_pixel`). Right: change of the rates, +FB minus "
        f"base, in points. {_W_AND_B} {_FR} {_NR} {_IL} Order: this study's rows by B of base, published rows as "
        "printed."
    ),
    "counterfactual": (
        f"B in %, as reported and if reports followed a policy. {_W_AND_B} Always: a success report is added "
        "to each episode, or replaces its report (bold if above B). Rand.: one of the two admissible labels at random, "
        "in expectation W/2."
    ),
    "belief_lag": (
        "Closure lag and premature commitment. W+: number, of all episodes, in which the world reached the goal (W=1). "
        "Lag: mean steps from then to the matching report, over episodes with both (B=1). NoRep | W=1: number of W+ "
        "episodes without a report. FS: number of episodes in which success is reported with W=0; FS @0: the share of "
        "them, in %, in which no condition of the goal is nearer to being met than at the start."
    ),
    "conditional_report": (
        f"Report rates given the world, in %. {_W_AND_B} Stop: the agent ends the episode by a report. n: number of "
        "episodes. Orange: P(rep | W=0) of 85 or more (FR-heavy: reports without the goal). Blue: P(no rep | W=1) of "
        "40 or more (NR-heavy: the goal without a report); no tint where n is below 5 or outside the main tables."
    ),
    "open_repeat_robustness": (
        f"Repeated runs under the same settings: mean ± half-range, in %. {_W_AND_B} {_GAP} {_FR} {_NR} {_IL}"
    ),
    "failure_taxonomy": (
        "Labels of an episode. B, FR, NR, IL and Other are exclusive and partition all scored episodes."
    ),
    "family_specs": (
        "Task families. Steps: step budget. Invalid limit: number of invalid replies allowed. Success: what W "
        "requires; B also requires a matching report."
    ),
    "episode_distribution": (
        "Episodes of each family that this study plays{packs}, and those of the published pack (arXiv:2605.08747)."
    ),
    "action_specs": "Action space of the agent.",
    "intents": "Intents of `interact_pixel`.",
    "report_statuses": "Statuses of a report.",
}
"""Table -> its caption. The text after a caption explains the table's episodes and marks."""
GOALS = {
    "target_grounded": "target pointed at",
    "agent_near_target": "agent near the target",
    "object_state": "object in the asked state",
    "VS object_state": "target seen",
    "report_status": "asked state in view at the end, and never changed",
    "object_held": "object held",
    "object_at_receptacle": "object at its receptacle",
    "all_of": "several of these",
    "CR": "constraint resolved, and ",
}
"""Kind of goal, after a family's code if the words are only for that family -> words in the table of families. A kind
that is not listed is shown by its name. The words of a code alone stand before those of all kinds of the family."""
_EXCLUDED = "from the main results (B = 0 or IL > 50 %)"
_HEADINGS = {
    "Published: the paper's own pack and simulator": "Published",
    "Excluded from the main tables (low compliance or zero B)": f"Excluded {_EXCLUDED}",
    "excluded from the paper's main tables (low compliance or zero B)": f"excluded {_EXCLUDED}",
    "the paper's supplementary variants": "other sizes and serving modes",
    "Extended panel, by the study's word": "Excluded by the study",
    "Supplementary variants, by the study's word": "Other sizes and serving modes",
}
"""Part of a heading in a report -> its words in a paper."""
_SUPPLEMENTARY = "other sizes and serving modes"
PRIVILEGED_MARK = "‡: scripted, with access to the hidden state."
_PUBLISHED_N, _PUBLISHED_PER_FAMILY = 1000, 125
_REPEATS = "open_repeat_robustness"
_BY_MODEL = (
    "global_cross_section",
    "full_panel",
    "extended_panel",
    "prompt_sensitivity",
    "counterfactual",
    "belief_lag",
    "conditional_report",
)
"""Tables in which each row of the study is one run."""
_BY_FAMILY = ("global_cross_section", "full_panel", "prompt_sensitivity")


def shown_heading(group: str) -> str:
    """Return the heading of a group of rows in a paper: short, and explained by the caption."""
    for said, shown in _HEADINGS.items():
        group = group.replace(said, shown)
    return group


def caption(table: Table, study: Study) -> str:
    """Return the caption of a table in a paper, with its numbers of episodes and its marks explained."""
    text = CAPTIONS[table.name]
    if table.name == "episode_distribution":
        return text.format(packs=_packs(study))
    if table.name not in (*_BY_MODEL, _REPEATS, "proprio_minimal"):
        return text
    return " ".join((text, *_bold(table), *_groups(table), *_episodes(table, study), *_marks(table, study)))


def _bold(table: Table) -> list[str]:
    if table.name != "global_cross_section":
        return []
    sides = {row.is_published for row in table.rows if row.bold}
    named = {True: "of the published rows", False: "of this study's rows without ‡"}
    if not sides:
        return []
    return [f"Bold: highest W, highest B, lowest Δ {' and '.join(named[side] for side in sorted(sides))}."]


def _groups(table: Table) -> list[str]:
    """Return the sentences that explain the headings of groups outside the main tables."""
    headings = " ".join({shown_heading(row.group).lower() for row in table.rows})
    found = [_IL] if "il > 50" in headings and "IL:" not in CAPTIONS[table.name] else []
    are_apart = "il > 50" in headings and _SUPPLEMENTARY in headings
    return [*found, *([f"{_SUPPLEMENTARY.capitalize()} are listed whatever their B and IL."] if are_apart else [])]


def _episodes(table: Table, study: Study) -> list[str]:
    """Return a sentence with the number of episodes of the study's rows; empty if the table has no such rows."""
    own = [row for row in table.rows if not row.is_published]
    if not own:
        return []
    if table.name == "proprio_minimal":
        return [f"This study: {_span(row.cells['n'] for row in own)} episodes, played under both."]
    if table.name == _REPEATS:
        sizes = _span(len(one) for repeats in study.pairing.repeats for one in repeats.tables)
        return [f"This study: {_span(row.cells['runs'] for row in own)} runs of {sizes} episodes."]
    names = {row.cells["model"] for row in own}
    entries = [entry for entry in study.entries if entry.name in names]
    each = _span(family.n for entry in entries for family in entry.families.values())
    families = f" ({each} in each family)" if table.name in _BY_FAMILY else ""
    return [f"This study: {_span(entry.overall.n for entry in entries)} episodes{families}."]


def _marks(table: Table, study: Study) -> list[str]:
    marks = []
    if any(row.is_published for row in table.rows):
        families = f" ({_PUBLISHED_PER_FAMILY} in each family)" if table.name in _BY_FAMILY else ""
        runs = "two runs of " if table.name == _REPEATS else ""
        marks.append(
            f"†: as published (arXiv:2605.08747), {runs}{_PUBLISHED_N:,} other episodes{families} in another simulator."
        )
    if any(row.is_privileged for row in table.rows):
        marks.append(PRIVILEGED_MARK)
    if any("(T)" in row.cells["model"] for row in table.rows):
        models = study.published.models if study.published else ()
        shown = {row.cells["model"] for row in table.rows if row.is_published}
        others = [f"{each.name}†" for each in models if each.thinking and "(T)" not in each.name and each.name in shown]
        also = f", as {'is' if len(others) == 1 else 'are'} {' and '.join(others)}" if others else ""
        marks.append(f"(T): served in thinking mode{also}.")
    return marks


def _packs(study: Study) -> str:
    names = sorted({entry.run.header.spec.pack for entry in study.entries})
    return f" from its {'pack' if len(names) == 1 else 'packs'} ({', '.join(names)})" if names else ""


def _span(numbers: Iterable[int]) -> str:
    known = sorted(set(numbers)) or [0]
    return f"{known[0]:,}" if len(known) == 1 else f"{known[0]:,}–{known[-1]:,}"


def without_condition(rows: Sequence[TableRow]) -> dict[str, str]:
    """Return {name: name without the condition in brackets} of the rows; unchanged where two would be the same."""
    names = [row.cells["model"] for row in rows]
    short = {name: name.rsplit(" [", 1)[0] if name.endswith("]") else name for name in names}
    return short if len(set(short.values())) == len(names) else {name: name for name in names}
